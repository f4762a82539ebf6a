// SPDX-License-Identifier: GPL-3.0-or-later
// VTU files in every encoding, and what can be wrong in them.
#include <string>

#include "core/io/mesh_reader.h"
#include "core/io/mesh_refusal_testing.h"
#include "core/io/vtu_testing.h"
#include "core/io/vtu_writer.h"
#include "core/mesh/mesh_testing.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"

namespace ndmap {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

std::vector<VtuStyle> Styles() {
  std::vector<VtuStyle> styles;
  for (auto format :
       {VtuStyle::kAscii, VtuStyle::kBinary, VtuStyle::kAppendedRaw, VtuStyle::kAppendedBase64}) {
    for (auto compressor : {VtuStyle::kNone, VtuStyle::kZlib, VtuStyle::kLzma}) {
      for (int bits = 0; bits < 16; ++bits) {
        styles.push_back(
            {format, compressor, (bits & 1) != 0, (bits & 2) != 0, (bits & 4) != 0, (bits & 8) != 0, false});
      }
    }
  }
  return styles;
}

TEST(VtuReaderTest, EveryEncoding) {
  const VolumeMesh mesh = AllKinds();
  int read = 0;
  for (const VtuStyle& style : Styles()) {
    const auto file = ReadVolumeMeshFromBytes(Vtu(mesh, style));
    ASSERT_TRUE(file.ok()) << file.status() << "\n" << Vtu(mesh, style);
    EXPECT_EQ(file->mesh.points, mesh.points);
    EXPECT_EQ(file->mesh.kinds, mesh.kinds);
    EXPECT_EQ(file->mesh.corners, mesh.corners);
    EXPECT_THAT(file->notes, testing::IsEmpty());
    ++read;
  }
  EXPECT_EQ(read, 192);
}

TEST(VtuReaderTest, CutAnywhere) {
  for (const VtuStyle& style :
       {VtuStyle{}, VtuStyle{VtuStyle::kBinary, VtuStyle::kZlib}, VtuStyle{VtuStyle::kAppendedRaw},
        VtuStyle{VtuStyle::kAppendedBase64}, VtuStyle{VtuStyle::kAppendedRaw, VtuStyle::kZlib}}) {
    const std::string whole = Vtu(AllKinds(), style);
    const size_t needed =
        whole.find(style.format < VtuStyle::kAppendedRaw ? "</VTKFile>" : "</AppendedData>");
    for (size_t size = 0; size + 5 < needed; ++size) {
      EXPECT_THAT(Why(whole.substr(0, size)), testing::Not("accepted")) << size << " of " << whole.size();
    }
  }
}

TEST(VtuReaderTest, PrismsInGmshsOrderAreTurned) {
  VtuStyle style;
  style.gmsh_prisms = true;
  const auto file = ReadVolumeMeshFromBytes(Vtu(UnitMesh(CellKind::kPrism), style));
  ASSERT_TRUE(file.ok()) << file.status();
  EXPECT_EQ(file->mesh.corners, UnitMesh(CellKind::kPrism).corners);
  EXPECT_THAT(file->notes,
              ElementsAre("turned the one prism: their triangles are listed the other way round than VTU "
                          "says"));
}

TEST(VtuReaderTest, WhatThisProjectWrites) {
  VtuPiece piece;
  for (const Point3& p : UnitCorners(CellKind::kHexahedron)) piece.AddPoint(p, 0);
  piece.AddHexahedron({0, 1, 2, 3, 4, 5, 6, 7}, {});
  std::string bytes;
  ASSERT_TRUE(WriteVtu(piece, [&](absl::string_view part) {
                bytes.append(part.data(), part.size());
                return absl::OkStatus();
              }).ok());
  const auto file = ReadVolumeMeshFromBytes(bytes);
  ASSERT_TRUE(file.ok()) << file.status();
  EXPECT_EQ(file->mesh.points, UnitCorners(CellKind::kHexahedron));
  EXPECT_THAT(file->mesh.corners, ElementsAre(0, 1, 2, 3, 4, 5, 6, 7));
}

TEST(VtuReaderTest, FlatCellsAreLeftOutAndOthersRefused) {
  const std::string good = Vtu(UnitMesh(CellKind::kTetrahedron));
  const std::string flat = Change(Change(Change(Change(good, "NumberOfCells=\"1\"", "NumberOfCells=\"3\""),
                                                "0 1 2 3 \n</", "0 1 2 0 1 2 3 1 \n</"),
                                         "\n4 \n", "\n3 7 8 \n"),
                                  "\n10 \n", "\n5 10 1 \n");
  const auto file = ReadVolumeMeshFromBytes(flat);
  ASSERT_TRUE(file.ok()) << file.status();
  EXPECT_EQ(file->mesh.cells(), 1u);
  EXPECT_EQ(file->mesh.source.Cell(0), 1u);
  EXPECT_THAT(file->notes,
              ElementsAre("left out what has fewer than three dimensions: 1 triangles, 1 vertices"));
  EXPECT_EQ(Why(Change(good, "\n10 \n", "\n42 \n")),
            "cell 0, counted from 0, is of VTK's type 42 (polyhedra); tetrahedra (10), hexahedra (12), "
            "wedges (13) and "
            "pyramids (14) can be read");
  EXPECT_THAT(Why(Change(good, "\n10 \n", "\n99 \n")),
              StartsWith("cell 0, counted from 0, is of VTK's type 99; tet"));
  EXPECT_EQ(Why(Change(good, "\n10 \n", "\n12 \n")),
            "cell 0, counted from 0, is a hexahedron with 4 corners; 8 expected");
}

TEST(VtuReaderTest, PiecesHavePointsOfTheirOwn) {
  const std::string one = Vtu(CubeMesh(1, 1, 1));
  const size_t begin = one.find("<Piece"), end = one.find("</UnstructuredGrid>");
  const std::string two =
      one.substr(0, end) + Change(one.substr(begin, end - begin), "1 1 1", "1 1 2") + one.substr(end);
  const auto file = ReadVolumeMeshFromBytes(two);
  ASSERT_TRUE(file.ok()) << file.status();
  EXPECT_EQ(file->mesh.cells(), 2u);
  EXPECT_EQ(file->mesh.points.size(), 16u);
  EXPECT_EQ(file->mesh.Corners(1)[0], 8u);
  EXPECT_THAT(file->notes, Contains(StartsWith("has 2 pieces, each with points of its own")));
}

// VTK describes arrays in elements within them.
TEST(VtuReaderTest, ElementsWithinAnArrayAreNotItsNumbers) {
  const std::string good = Vtu(AllKinds());
  const size_t points = good.find("</DataArray>", good.find("<Points>"));
  std::string keyed = good;
  keyed.insert(points, "<InformationKey name=\"RANGE\"><Value index=\"0\">0.5</Value></InformationKey>\n");
  const auto file = ReadVolumeMeshFromBytes(keyed);
  ASSERT_TRUE(file.ok()) << file.status();
  EXPECT_EQ(file->mesh.points, AllKinds().points);
  // A piece there is none, and does not move the one whose array is under way.
  std::string piece = good;
  piece.insert(points, "<Piece NumberOfPoints=\"1\" NumberOfCells=\"1\"/> more");
  EXPECT_EQ(Why(piece), "array 'Points' of line 11: entry 33, counted from 0, is 'more', no finite number");
}

TEST(VtuFaultTest, Xml) {
  const std::string good = Vtu(AllKinds());
  EXPECT_EQ(Why(Change(good, "</Points>", "</Point>")), "line 14: mismatched tag");
  EXPECT_EQ(Why("<html>"), "line 1: begins with 'html'; VTKFile expected");
  EXPECT_THAT(Why("<!DOCTYPE a [<!ENTITY b \"c\">]><VTKFile/>"), HasSubstr("document type declaration"));
  EXPECT_THAT(Why(Change(good, "\"UnstructuredGrid\"", "\"PolyData\"")),
              HasSubstr("is a VTK file of type 'PolyData'; UnstructuredGrid expected"));
  EXPECT_THAT(Why(Change(good, "\"UnstructuredGrid\"", "\"PUnstructuredGrid\"")),
              HasSubstr("is an index of pieces"));
  EXPECT_THAT(Why(Change(good, "version=\"1.0\" byte", "compressor=\"vtkLZ4DataCompressor\" byte")),
              HasSubstr("is compressed by 'vtkLZ4DataCompressor'; save it with zlib, LZMA or none"));
  EXPECT_EQ(Why(Change(good, "NumberOfCells=\"4\"", "NumberOfCells=\"-4\"")),
            "line 4: '-4' stands where NumberOfCells should be");
  EXPECT_EQ(Why("<VTKFile type=\"UnstructuredGrid\"></VTKFile>"), "has no Piece");
}

TEST(VtuFaultTest, ArraysThatDoNotFit) {
  const std::string good = Vtu(AllKinds());
  EXPECT_EQ(Why(Change(good, "NumberOfPoints=\"11\"", "NumberOfPoints=\"12\"")),
            "array 'Points' of line 11: has 33 entries; 36 expected");
  EXPECT_EQ(Why(Change(good, "NumberOfCells=\"4\"", "NumberOfCells=\"99999999999\"")),
            "array 'types' of line 22: has 4 entries; 99999999999 expected");
  EXPECT_EQ(Why(Change(good, "NumberOfPoints=\"11\"", "NumberOfPoints=\"99999999999\"")),
            "has more points than 32 bits can count");
  EXPECT_EQ(Why(Change(good, "Name=\"offsets\"", "Name=\"other\"")),
            "truncated or damaged: a piece has no array 'offsets'");
  EXPECT_EQ(Why(Change(good, "Name=\"offsets\"", "Name=\"types\"")),
            "line 22: a second array 'types' in a piece");
  EXPECT_EQ(Why(Change(good, "NumberOfComponents=\"3\"", "NumberOfComponents=\"2\"")),
            "array 'Points' of line 11: has 2 components; 3 expected");
  EXPECT_EQ(
      Why(Change(good, "\n8 14 19 23 \n", "\n8 7 19 23 \n")),
      "cell 1, counted from 0, has offset 7, out of range; it begins at 8 and connectivity has 23 entries");
  EXPECT_EQ(
      Why(Change(good, "\n8 14 19 23 \n", "\n8 14 19 24 \n")),
      "cell 3, counted from 0, has offset 24, out of range; it begins at 19 and connectivity has 23 entries");
  EXPECT_EQ(Why(Change(good, "5 9 6 10 \n", "5 9 6 11 \n")),
            "cell 3, counted from 0, has point 11, out of range; there are 11, counted from 0");
  EXPECT_EQ(Why(Change(good, "5 9 6 10 \n", "5 9 6 -1 \n")),
            "cell 3, counted from 0, has point -1, out of range; there are 11, counted from 0");
  EXPECT_EQ(Why(Change(good, "5 9 6 10 \n", "5 9 6 10.5 \n")),
            "array 'connectivity' of line 16: entry 22, counted from 0, is '10.5', no integer");
  EXPECT_EQ(Why(Change(good, "2.25 \n", "nan \n")),
            "array 'Points' of line 11: entry 32, counted from 0, is 'nan', no finite number");
}

TEST(VtuFaultTest, BinaryData) {
  const std::string raw = Vtu(AllKinds(), {VtuStyle::kAppendedRaw});
  const size_t data = raw.find("  _") + 3;
  // The points come second, after 33 floats with 8 bytes of header.
  std::string bad = raw;
  bad.replace(data + 8 + 33 * 4, 8, "\xff\xff\xff\xff\xff\xff\xff\xff");
  EXPECT_THAT(Why(bad),
              HasSubstr("array 'Points' of line 9: truncated: 18446744073709551615 bytes are promised"));
  bad = raw;
  bad.replace(data + 8 + 33 * 4 + 8 + 6, 2, "\xf0\x7f");
  EXPECT_EQ(Why(bad), "point 0 (cells and points counted from 0) has a coordinate that is not finite");
  EXPECT_THAT(Why(Change(raw, "offset=\"140\"", "offset=\"99999\"")),
              HasSubstr("truncated: begins at 99999 of"));
  EXPECT_THAT(Why(Change(raw, "type=\"Float64\"", "type=\"Int64\"")),
              HasSubstr("is of type 'Int64'; Float32 or Float64"));
  EXPECT_THAT(Why(Change(raw, "format=\"appended\"", "format=\"other\"")), HasSubstr("has format 'other'"));

  const std::string base64 = Vtu(AllKinds(), {VtuStyle::kBinary});
  EXPECT_THAT(Why(Change(base64, "format=\"binary\">\n  ", "format=\"binary\">\n  ~")),
              HasSubstr("is not base64"));
}

TEST(VtuFaultTest, CompressedData) {
  const std::string good = Vtu(AllKinds(), {VtuStyle::kAppendedRaw, VtuStyle::kZlib});
  // The points' offset, then their header: number of blocks, size of a block, size of the last.
  const size_t points = good.find("<Points>");
  const size_t offset = good.find("offset=\"", points) + 8;
  const size_t header = good.find("  _") + 3 + std::stoul(good.substr(offset));
  std::string bad = good;
  bad.replace(header, 8, "\xff\xff\xff\xff\xff\xff\xff\x0f");
  EXPECT_THAT(Why(bad), HasSubstr("compressed blocks are promised"));
  bad = good;
  bad.replace(header + 8, 8, std::string("\0\0\0\1\0\0\0\0", 8));  // 16 MiB of a few bytes.
  EXPECT_THAT(Why(bad), HasSubstr("compressed block 0 is damaged"));
  bad.replace(header + 8, 8, std::string("\0\0\0\0\0\1\0\0", 8));
  EXPECT_EQ(ReadVolumeMeshFromBytes(bad).status().code(), absl::StatusCode::kResourceExhausted);
  bad = good;
  bad.replace(header + 24, 8, "\xff\xff\xff\xff\xff\xff\xff\xff");
  EXPECT_THAT(Why(bad), HasSubstr("truncated: compressed block 0 is not whole"));
  bad = good;
  bad[header + 24 + 8 * 7 + 5] ^= 0x55;
  EXPECT_THAT(Why(bad), HasSubstr("is damaged"));
}

}  // namespace
}  // namespace ndmap

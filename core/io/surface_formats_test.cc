// SPDX-License-Identifier: GPL-3.0-or-later
// Files as files: formats and dialects, what is truncated, too large or no number.
#include <lzma.h>
#include <sys/stat.h>

#include <cstring>
#include <limits>

#include "absl/strings/str_cat.h"
#include "core/io/sample_surface.h"
#include "core/io/surface_reader_testing.h"

namespace ndmap {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

TEST_F(SurfaceReaderTest, EveryFormatGivesTheSameTetrahedron) {
  const std::pair<std::string, std::string> files[] = {{"t.off", kOff},
                                                       {"t.OBJ", kObj},
                                                       {"text.ply", PlyText()},
                                                       {"little.ply", PlyBinary(false)},
                                                       {"big.ply", PlyBinary(true)},
                                                       {"text.stl", StlText()},
                                                       {"binary.stl", StlBinary()}};
  for (const auto& [name, content] : files) {
    SCOPED_TRACE(name);
    const auto file = ReadSurface(Write(name, content));
    ASSERT_TRUE(file.ok()) << file.status();
    EXPECT_TRUE(ValidateClosedSurface(file->surface).ok());
    EXPECT_EQ(file->surface.points.size(), 4u);
    EXPECT_EQ(file->surface.triangles.size(), 4u);
    EXPECT_THAT(file->notes, IsEmpty());
    EXPECT_THAT(file->warnings, IsEmpty());
    EXPECT_EQ(BoundingBox(file->surface).hi, (Point3{1, 1, 1}));
  }
}

TEST_F(SurfaceReaderTest, DialectsOfOff) {
  for (const std::string& content :
       {With(kOff, "OFF\n4 4 6", "OFF 4 4 6"), With(kOff, "OFF\n", "# comment\nOFF # more\n\n"),
        With(kOff, "\n", "\r\n"), With(With(kOff, "OFF", "COFF"), "0 0 0\n", "0 0 0 255 0 0 255\n"),
        With(kOff, "3 0 2 1", "3 0 2 1 255 0 0")}) {
    const auto file = ReadSurface(Write("a.off", content));
    EXPECT_TRUE(file.ok()) << file.status() << "\n" << content;
  }
}

TEST_F(SurfaceReaderTest, ObjKeywordsOfOthersAreSkipped) {
  const auto file = ReadSurface(
      Write("a.obj", absl::StrCat("mtllib a.mtl\no thing\nvn 0 0 1\nvt 0 0\n", kObj, "l 1 2\nusemtl x\n")));
  EXPECT_TRUE(file.ok()) << file.status();
}

TEST_F(SurfaceReaderTest, NoFileFolderOrExtension) {
  const std::string missing = (folder_ / "missing.off").string();
  EXPECT_EQ(ReadSurface(missing).status(), absl::NotFoundError(missing + ": no such file"));
  const std::string folder = (folder_ / "folder.off").string();
  std::filesystem::create_directory(folder);
  EXPECT_EQ(ReadSurface(folder).status(), absl::InvalidArgumentError(folder + ": is a directory"));
  EXPECT_THAT(Error("a.vtk", kOff), StartsWith("unknown extension; .off"));
  EXPECT_THAT(Error("a", kOff), StartsWith("unknown extension; .off"));
  const std::string pipe = (folder_ / "pipe.off").string();
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_EQ(ReadSurface(pipe).status(), absl::InvalidArgumentError(pipe + ": is not a regular file"));
}

TEST_F(SurfaceReaderTest, LargerThanTheLimit) {
  const std::string path = Write("a.off", kOff);
  ReadLimits limits;
  limits.max_bytes = 50;
  EXPECT_EQ(ReadSurface(path, limits).status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(ReadSurfaceFromBytes(kOff, SurfaceFormat::kOff, limits).status().code(),
            absl::StatusCode::kResourceExhausted);
}

TEST_F(SurfaceReaderTest, EmptyInEveryFormat) {
  for (const char* name : {"a.off", "a.obj", "a.ply", "a.stl"}) {
    EXPECT_EQ(Error(name, ""), "is empty");
    EXPECT_EQ(Error(name, " \n\n"), "is empty");
  }
  EXPECT_EQ(Error("a.off.xz", ""), "is empty");
}

TEST_F(SurfaceReaderTest, AnotherFormatThanTheExtensionSays) {
  EXPECT_THAT(Error("a.off", kObj), HasSubstr("line 1: begins with 'v'; OFF expected"));
  EXPECT_THAT(Error("a.obj", kOff), HasSubstr("line 2: begins with '4', which is no OBJ keyword"));
  EXPECT_THAT(Error("a.ply", kOff), HasSubstr("line 1: does not begin with ply"));
  EXPECT_THAT(Error("a.stl", kOff), HasSubstr("truncated: 66 bytes; a binary STL file has 84 and more"));
  EXPECT_THAT(Error("a.off", "OFF BINARY\n"), HasSubstr("binary OFF"));
}

TEST_F(SurfaceReaderTest, NoFacesInEveryFormat) {
  EXPECT_EQ(Error("a.off", "OFF\n1 0 0\n0 0 0\n"), "has no faces");
  EXPECT_EQ(Error("a.obj", "v 0 0 0\n"), "has no faces");
  EXPECT_EQ(Error("a.ply", With(PlyText().substr(0, PlyText().rfind("3 0 2 1")), "face 4", "face 0")),
            "has no faces");
  EXPECT_EQ(Error("b.ply", "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nend_header\n"),
            "has no faces: the header has no element face");
  EXPECT_EQ(Error("text.stl", "solid\nendsolid\n"), "has no faces");
  std::string binary = StlBinary().substr(0, 84);
  binary[80] = 0;
  EXPECT_EQ(Error("binary.stl", binary), "has no faces");
  EXPECT_EQ(Error("degenerate.off", "OFF\n2 2 0\n0 0 0\n1 0 0\n3 0 1 1\n2 0 1\n"),
            "has no faces that are not degenerate");
}

// Cut anywhere, a file is refused; where counts tell, as truncated.
TEST_F(SurfaceReaderTest, TruncatedAnywhereInEveryFormat) {
  const std::pair<SurfaceFormat, std::string> files[] = {{SurfaceFormat::kOff, kOff},
                                                         {SurfaceFormat::kObj, kObj},
                                                         {SurfaceFormat::kPly, PlyText()},
                                                         {SurfaceFormat::kPly, PlyBinary(false)},
                                                         {SurfaceFormat::kPly, PlyBinary(true)},
                                                         {SurfaceFormat::kStl, StlText()},
                                                         {SurfaceFormat::kStl, StlBinary()}};
  for (const auto& [format, content] : files) {
    // What the last line can lose: its end and a name; a digit is one character here.
    const size_t whole = content.size() - (format == SurfaceFormat::kStl && content.back() == '\n' ? 14 : 1);
    for (size_t size = 0; size < whole; ++size) {
      EXPECT_FALSE(ReadSurfaceFromBytes(content.substr(0, size), format).ok()) << size << " bytes of:\n"
                                                                               << content;
    }
  }
  EXPECT_EQ(Error("a.off", std::string(kOff).substr(0, 34)),
            "truncated: line 2 promises 4 points and 4 faces, which cannot be in 34 bytes");
  EXPECT_EQ(Error("long.off", "OFF\n4 1 0\n0.00000000000 0 0\n1.000000000 0 0\n0 1.00000 0\n"),
            "truncated: 4 points promised, the file has 3");
  EXPECT_EQ(Error("b.off", std::string(kOff).substr(0, 58)), "truncated: 4 faces promised, the file has 3");
  EXPECT_THAT(Error("c.off", std::string(kOff).substr(0, sizeof(kOff) - 3)),
              HasSubstr("truncated in line 10: face 3"));
  EXPECT_THAT(Error("d.off", "OFF\n4 4"), HasSubstr("truncated"));
  EXPECT_THAT(Error("a.obj", std::string(kObj).substr(0, 45)), HasSubstr("not closed: 3 edges"));
  EXPECT_THAT(Error("b.obj", "v 1 2"), HasSubstr("truncated in line 1: a point needs three coordinates"));
  const std::string text = PlyText();
  EXPECT_THAT(Error("text.ply", text.substr(0, text.size() - 4)), HasSubstr("face 3 of 4: truncated"));
  EXPECT_THAT(Error("header.ply", text.substr(0, 60)), HasSubstr("truncated: the header has no end_header"));
  EXPECT_THAT(Error("binary.ply", PlyBinary(false).substr(0, PlyBinary(false).size() - 1)),
              HasSubstr("face 3 of 4: truncated"));
  EXPECT_THAT(Error("text.stl", StlText().substr(0, 300)), HasSubstr("truncated"));
  EXPECT_THAT(Error("binary.stl", With(StlBinary(), "solid", "STLB_").substr(0, 200)),
              HasSubstr("truncated: the header promises 4 facets in 284 bytes; the file has 200"));
}

TEST_F(SurfaceReaderTest, HeadersThatPromiseTheWorld) {
  EXPECT_THAT(Error("a.off", With(kOff, "4 4 6", "2000000000 4 6")),
              HasSubstr("truncated: line 2 promises 2000000000"));
  EXPECT_THAT(Error("b.off", With(kOff, "4 4 6", "4 2000000000 6")), HasSubstr("truncated: line 2 promises"));
  EXPECT_THAT(Error("c.off", With(kOff, "4 4 6", "-4 4 6")), HasSubstr("-4 points and 4 faces cannot be"));
  EXPECT_THAT(Error("d.off", With(kOff, "4 4 6", "99999999999999999999 4 6")),
              HasSubstr("is not an integer"));
  EXPECT_THAT(Error("e.off", With(kOff, "3 0 2 1", "2000000000 0 2 1")),
              HasSubstr("promises 2000000000 corners"));
  EXPECT_THAT(Error("a.ply", With(PlyText(), "vertex 4", "vertex 2000000000")), HasSubstr("of 2000000000"));
  EXPECT_THAT(Error("b.ply", With(PlyBinary(false), "face 4", "face 2000000000")),
              HasSubstr("face 4 of 2000000000"));
  EXPECT_THAT(Error("c.ply", With(PlyText(), "face 4", "face 4000000000")),
              HasSubstr("4000000000 elements cannot be"));
  std::string lists = With(PlyBinary(false), "uchar int vertex", "int int vertex");
  EXPECT_THAT(Error("d.ply", lists), HasSubstr("face 0 of 4"));
  EXPECT_THAT(Error("e.ply", With(PlyText(), "element vertex", "element thing 1000000000\nelement vertex")),
              HasSubstr("'thing' has no properties"));
  std::string stl = With(StlBinary(), "solid", "STLB_");
  std::memset(stl.data() + 80, 0xff, 4);
  EXPECT_THAT(Error("a.stl", stl), HasSubstr("truncated: the header promises 4294967295 facets"));
}

TEST_F(SurfaceReaderTest, IndexOutOfRangeInEveryFormatWithIndices) {
  EXPECT_THAT(Error("a.off", With(kOff, "3 1 2 3", "3 1 2 4")),
              HasSubstr("line 9: face 2 has index 4 out of range; there are 4 points"));
  EXPECT_THAT(Error("b.off", With(kOff, "3 1 2 3", "3 1 2 -1")),
              HasSubstr("line 9: face 2 has index -1 out of range"));
  EXPECT_THAT(Error("c.off", With(kOff, "3 1 2 3", "3 1 2 1.5")),
              HasSubstr("line 9: index '1.5' is not an integer"));
  EXPECT_THAT(Error("a.obj", With(kObj, "f 1 3 2", "f 1 3 0")), HasSubstr("line 5: index 0 out of range"));
  EXPECT_THAT(Error("b.obj", With(kObj, "f 1 3 2", "f 1 3 5")),
              HasSubstr("line 5: index 5 out of range; there are 4"));
  EXPECT_THAT(Error("c.obj", With(kObj, "f 1 3 2", "f 1 3 -5")), HasSubstr("line 5: index -5 out of range"));
  EXPECT_THAT(Error("d.obj", With(kObj, "f 1 3 2", "f 1 3 x")),
              HasSubstr("line 5: corner 'x' is not an index"));
  EXPECT_THAT(Error("a.ply", With(PlyText(), "3 1 2 3", "3 1 2 4")),
              HasSubstr("line 18: face 2 of 4: index 4 out of range; there are 4 points"));
  EXPECT_THAT(Error("b.ply", With(PlyText(), "3 1 2 3", "3 1 2 -3")),
              HasSubstr("face 2 of 4: index -3 out of range"));
  for (bool big : {false, true}) {
    std::string binary = PlyBinary(big);
    binary[binary.size() - (big ? 1 : 4)] = 7;
    EXPECT_THAT(Error("c.ply", binary), HasSubstr("face 3 of 4: index 7 out of range"));
  }
}

TEST_F(SurfaceReaderTest, NotANumberOrInfiniteInEveryFormat) {
  for (const char* bad : {"nan", "inf", "-inf", "1e999", "1.2.3", "x"}) {
    SCOPED_TRACE(bad);
    const bool number = bad[1] != '.' && bad[0] != 'x';
    const auto says = HasSubstr(number ? "is not finite" : "is not a number");
    EXPECT_THAT(Error("a.off", With(kOff, "0 1 0\n", absl::StrCat("0 ", bad, " 0\n"))),
                AllOf(HasSubstr("line 5"), says));
    EXPECT_THAT(Error("a.obj", With(kObj, "v 0 1 0", absl::StrCat("v 0 ", bad, " 0"))),
                AllOf(HasSubstr("line 3"), says));
    EXPECT_THAT(Error("a.stl", With(StlText(), "vertex 0 1 0", absl::StrCat("vertex 0 ", bad, " 0"))),
                AllOf(HasSubstr("line 5"), says));
    EXPECT_THAT(Error("a.ply", With(PlyText(), "0 1 0 9", absl::StrCat("0 ", bad, " 0 9"))),
                AllOf(HasSubstr(number ? "vertex 2 of 4: has a coordinate that" : "vertex 2 of 4: "), says));
  }
  for (float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    for (bool big : {false, true}) {
      std::string ply = PlyBinary(big), value;
      Append(bad, big, &value);
      ply.replace(ply.find("end_header\n") + 11 + 13, 4, value);
      EXPECT_THAT(Error("b.ply", ply), HasSubstr("vertex 1 of 4: has a coordinate that is not finite"));
    }
    std::string stl = StlBinary();
    std::memcpy(stl.data() + 84 + 50 + 12, &bad, 4);
    EXPECT_THAT(Error("b.stl", stl), HasSubstr("facet 1 has a coordinate that is not finite"));
  }
}

TEST_F(SurfaceReaderTest, WhatIsWrittenReadsBackBitForBit) {
  const TriangleSurface knot = *MakeSample("knot", {.triangles = 1000, .scale = 0.1});
  const std::string path = (folder_ / "knot.off").string();
  ASSERT_TRUE(WriteOff(path, knot).ok());
  const auto file = ReadSurface(path);
  ASSERT_TRUE(file.ok()) << file.status();
  EXPECT_EQ(file->surface.points, knot.points);
  EXPECT_EQ(file->surface.triangles, knot.triangles);
  EXPECT_THAT(std::string(WriteOff((folder_ / "no" / "a.off").string(), knot).message()),
              HasSubstr("cannot be written"));
}

TEST_F(SurfaceReaderTest, CompressedWithXz) {
  std::string compressed(1 << 16, '\0');
  size_t size = 0;
  ASSERT_EQ(lzma_easy_buffer_encode(6, LZMA_CHECK_CRC64, nullptr, reinterpret_cast<const uint8_t*>(kOff),
                                    sizeof(kOff) - 1, reinterpret_cast<uint8_t*>(compressed.data()), &size,
                                    compressed.size()),
            LZMA_OK);
  compressed.resize(size);
  const std::string path = Write("a.off.xz", compressed);
  EXPECT_TRUE(ReadSurface(path).ok()) << ReadSurface(path).status();
  ReadLimits limits;
  limits.max_bytes = sizeof(kOff) - 2;
  EXPECT_EQ(ReadSurface(path, limits).status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(Error("b.off.xz", compressed.substr(0, size - 9)), "truncated: its xz compression has no end");
  EXPECT_EQ(Error("c.off.xz", kOff), "is not compressed with xz");
  compressed[30] ^= 1;
  EXPECT_EQ(Error("d.off.xz", compressed), "its xz compression is damaged");
  EXPECT_THAT(Error("e.vtk.xz", compressed), testing::Not(IsEmpty()));
}

TEST_F(SurfaceReaderTest, PlyHeadersThatMakeNoSense) {
  EXPECT_THAT(Error("a.ply", With(PlyText(), "element vertex 4\n", "")),
              HasSubstr("a property without an element"));
  EXPECT_THAT(Error("b.ply", With(PlyText(), "float x", "quad x")),
              HasSubstr("line 5: 'quad' is no PLY type"));
  EXPECT_THAT(Error("c.ply", With(PlyText(), "float z", "float w")),
              HasSubstr("vertices need the properties x, y and z"));
  EXPECT_THAT(Error("d.ply", With(PlyText(), "float z", "float x")), HasSubstr("vertex has 'x' twice"));
  EXPECT_THAT(Error("e.ply", With(PlyText(), "vertex_indices", "corners")),
              HasSubstr("faces need a list vertex_indices"));
  EXPECT_THAT(Error("f.ply", With(PlyText(), "uchar int vertex", "float int vertex")),
              HasSubstr("length is an integer"));
  EXPECT_THAT(Error("g.ply", With(PlyText(), "ascii", "utf8")), HasSubstr("line 2: 'utf8' is no PLY format"));
  EXPECT_THAT(Error("h.ply", With(PlyText(), "element face", "element vertex")),
              HasSubstr("a second element 'vertex'"));
  EXPECT_THAT(Error("i.ply", With(PlyText(), "3 0 2 1\n", "-3 0 2 1\n")),
              HasSubstr("face 0 of 4: a list of -3 values"));
}

TEST_F(SurfaceReaderTest, StlTextThatMakesNoSense) {
  EXPECT_THAT(Error("a.stl", With(StlText(), "  endloop\n endfacet\n", "")),
              HasSubstr("line 7: a facet within a facet"));
  EXPECT_THAT(Error("b.stl", With(StlText(), " facet normal 0 0 1\n", "")),
              HasSubstr("line 3: a vertex outside a facet"));
  EXPECT_THAT(Error("c.stl", With(StlText(), "   vertex 0 1 0\n", "")),
              HasSubstr("facet 0 has 2 corners; 3 expected"));
  EXPECT_THAT(Error("d.stl", With(StlText(), "outer", "inner")),
              HasSubstr("line 3: 'inner' is no word of a text STL"));
}

}  // namespace
}  // namespace ndmap

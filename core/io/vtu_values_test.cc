// SPDX-License-Identifier: GPL-3.0-or-later
// Arrays of points and cells read back. Files that VTK wrote are read in tests/cli.
#include "core/io/vtu_values.h"

#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/io/file_bytes.h"
#include "core/io/vtu_writer.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"

namespace ndmap {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class VtuValuesTest : public ::testing::Test {
 protected:
  // Of its own: tests run side by side.
  VtuValuesTest()
      : folder_(absl::StrCat(::testing::TempDir(), "/vtu_values_", getpid(), "_",
                             ::testing::UnitTest::GetInstance()->current_test_info()->name())) {
    std::filesystem::create_directories(folder_);
  }
  ~VtuValuesTest() override { std::filesystem::remove_all(folder_); }
  std::string Path(const std::string& name) { return folder_ + "/vtu_values_" + name; }
  std::string Write(const std::string& name, const std::string& text) {
    EXPECT_TRUE(internal::WriteFileBytes(Path(name), text).ok());
    return Path(name);
  }
  // Two points and a polyhedron of no faces that matter.
  static std::string Text(const std::string& arrays) {
    return "<VTKFile type=\"UnstructuredGrid\" byte_order=\"LittleEndian\"><UnstructuredGrid>"
           "<Piece NumberOfPoints=\"2\" NumberOfCells=\"1\"><PointData>" +
           arrays +
           "</PointData><CellData><DataArray type=\"Int64\" Name=\"id\">64</DataArray><DataArray "
           "type=\"UInt8\" "
           "Name=\"level\">1</DataArray><DataArray type=\"Float32\" Name=\"x\">7</DataArray></CellData>"
           "</Piece></UnstructuredGrid></VTKFile>";
  }
  const std::string folder_;
  static std::string Array(const std::string& type, const std::string& name, const std::string& values,
                           const std::string& more = "") {
    return "<DataArray type=\"" + type + "\" Name=\"" + name + "\" " + more + ">" + values + "</DataArray>";
  }
};

const char kId[] = "<DataArray type=\"Int64\" Name=\"id\">8 -3</DataArray>";

TEST_F(VtuValuesTest, WhatWasWrittenIsReadThroughTheIndex) {
  VtuPiece piece;
  piece.AddPoint({0, 0, 0}, 5);
  piece.AddPoint({1, 0, 0}, 6);
  VtuField speeds, rocks;
  speeds.name = "speed";
  speeds.type = VtuField::Type::kVectors;
  speeds.doubles = {1, 2, 3, 4, 5, 6};
  rocks.name = "rock";
  rocks.type = VtuField::Type::kTexts;
  rocks.texts = {"k\xc3\xa4se", ""};
  piece.point_fields = {speeds, rocks};
  ASSERT_TRUE(WriteVtuFile(piece, Path("0.vtu")).ok());
  piece.point_ids = {6, 7};
  piece.point_fields[0].doubles = {4, 5, 6, 7, 8, 9};
  ASSERT_TRUE(WriteVtuFile(piece, Path("1.vtu")).ok());
  ASSERT_TRUE(
      WritePvtuFileLike(Path("0.vtu"), {"vtu_values_0.vtu", "vtu_values_1.vtu"}, Path("mesh.pvtu")).ok());
  const auto speed = ReadVtuValues(Path("mesh.pvtu"), VtuPart::kPoints, "speed", VtuKind::kReals);
  ASSERT_TRUE(speed.ok()) << speed.status();
  EXPECT_THAT(speed->ids, ElementsAre(5, 6, 6, 7));
  EXPECT_EQ(speed->components, 3u);
  EXPECT_THAT(speed->reals, ElementsAre(1, 2, 3, 4, 5, 6, 4, 5, 6, 7, 8, 9));
  EXPECT_THAT(speed->levels, IsEmpty());
  const auto rock = ReadVtuValues(Path("mesh.pvtu"), VtuPart::kPoints, "rock", VtuKind::kTexts);
  ASSERT_TRUE(rock.ok()) << rock.status();
  EXPECT_THAT(rock->texts, ElementsAre("k\xc3\xa4se", "", "k\xc3\xa4se", ""));
}

TEST_F(VtuValuesTest, NumbersOfAnyTypeAreTaken) {
  for (const char* type : {"Float64", "Float32", "Int8", "UInt64"}) {
    const auto read = ReadVtuValues(Write("a.vtu", Text(kId + Array(type, "x", "3 4"))), VtuPart::kPoints,
                                    "x", VtuKind::kReals);
    ASSERT_TRUE(read.ok()) << read.status();
    EXPECT_THAT(read->ids, ElementsAre(8, -3));
    EXPECT_THAT(read->reals, ElementsAre(3, 4));
    EXPECT_THAT(ReadVtuValues(Path("a.vtu"), VtuPart::kPoints, "x", VtuKind::kIntegers)->integers,
                ElementsAre(3, 4));
  }
  const auto odd = ReadVtuValues(Write("a.vtu", Text(kId + Array("Float64", "x", "nan -inf"))),
                                 VtuPart::kPoints, "x", VtuKind::kReals);
  ASSERT_TRUE(odd.ok()) << odd.status();
  EXPECT_TRUE(std::isnan(odd->reals[0]));
  EXPECT_EQ(odd->reals[1], -INFINITY);
  const auto cells = ReadVtuValues(Path("a.vtu"), VtuPart::kCells, "x", VtuKind::kReals);
  ASSERT_TRUE(cells.ok()) << cells.status();
  EXPECT_THAT(cells->ids, ElementsAre(64));
  EXPECT_THAT(cells->levels, ElementsAre(1));
  EXPECT_THAT(cells->reals, ElementsAre(7));
}

TEST_F(VtuValuesTest, StringsAsVtkWritesThem) {
  const std::string strings =
      "<Array type=\"String\" Name=\"x\" format=\"ascii\"> 97 98 0 -61 -92 0 </Array>";
  const auto read =
      ReadVtuValues(Write("a.vtu", Text(kId + strings)), VtuPart::kPoints, "x", VtuKind::kTexts);
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_THAT(read->texts, ElementsAre("ab", "\xc3\xa4"));
  const auto numbers = ReadVtuValues(Write("a.vtu", Text(kId + Array("Float32", "x", "3 -4"))),
                                     VtuPart::kPoints, "x", VtuKind::kTexts);
  ASSERT_TRUE(numbers.ok()) << numbers.status();
  EXPECT_THAT(numbers->texts, ElementsAre("3", "-4"));
}

TEST_F(VtuValuesTest, WhatIsWrongIsSaidInOneSentence) {
  const auto error = [&](const std::string& arrays, VtuKind kind = VtuKind::kReals) {
    const absl::Status status =
        ReadVtuValues(Write("bad.vtu", Text(arrays)), VtuPart::kPoints, "x", kind).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(status.message(), HasSubstr("bad.vtu: "));
    return std::string(status.message());
  };
  EXPECT_THAT(error(""), HasSubstr("its points have no array 'id'"));
  EXPECT_THAT(error(kId), HasSubstr("its points have no array 'x'"));
  EXPECT_THAT(error(kId + Array("Float64", "x", "1")), HasSubstr("has 1 entries; 2 expected"));
  EXPECT_THAT(error(kId + Array("Float64", "x", "1 a")), HasSubstr("no number"));
  EXPECT_THAT(error(kId + Array("Float64", "x", "1 2 3 4", "NumberOfComponents=\"2\"")),
              HasSubstr("has 2 components"));
  EXPECT_THAT(error(kId + Array("Float64", "x", "1 2.5"), VtuKind::kIntegers),
              HasSubstr("the value 2.5, expected whole"));
  EXPECT_THAT(error(kId + Array("Float64", "x", "1 nan"), VtuKind::kIntegers), HasSubstr("expected whole"));
  EXPECT_THAT(error(kId + std::string("<Array type=\"String\" Name=\"x\">7 0</Array>")),
              HasSubstr("array 'x' has texts, expected numbers"));
  EXPECT_THAT(error(kId + std::string("<Array type=\"String\" Name=\"x\">97 0</Array>"), VtuKind::kTexts),
              HasSubstr("has 1 texts; 2 expected"));
  EXPECT_EQ(ReadVtuValues(Path("none.vtu"), VtuPart::kPoints, "x", VtuKind::kReals).status().code(),
            absl::StatusCode::kNotFound);
  const std::string index = Write("bad.pvtu",
                                  "<VTKFile type=\"PUnstructuredGrid\"><PUnstructuredGrid><Piece "
                                  "Source=\"vtu_values_bad.pvtu\"/></PUnstructuredGrid></VTKFile>");
  EXPECT_THAT(ReadVtuValues(index, VtuPart::kPoints, "x", VtuKind::kReals).status().message(),
              HasSubstr("is an index of pieces"));
}

}  // namespace
}  // namespace ndmap

// SPDX-License-Identifier: GPL-3.0-or-later
// What the writer promises its callers. That VTK understands the files is tested with VTK: tests/vtk.
#include "core/io/vtu_writer.h"

#include <array>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"

namespace ndmap {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

VtuPiece Row(int cubes) {
  VtuPiece piece;
  for (int x = 0; x <= cubes; ++x) {
    for (const auto& [y, z] : {std::pair{0, 0}, {1, 0}, {1, 1}, {0, 1}}) {
      const int64_t id = piece.points.size();
      piece.AddPoint({x * 1.0, y * 1.0, z * 1.0}, id);
    }
  }
  for (int64_t x = 0; x < cubes; ++x) {
    std::array<int64_t, 8> corners;
    for (int64_t c = 0; c < 8; ++c) corners[c] = 4 * x + c;
    piece.AddHexahedron(corners, {.block = 1, .level = 2, .state = 3, .id = x});
  }
  return piece;
}

VtuPiece Tetrahedron() {
  VtuPiece piece;
  piece.AddPoint({0, 0, 0}, 0);
  piece.AddPoint({1, 0, 0}, 1);
  piece.AddPoint({0, 1, 0}, 2);
  piece.AddPoint({0, 0, 1}, 3);
  piece.AddPolyhedron({3, 3, 3, 3}, {0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3}, {});
  return piece;
}

std::string Written(const VtuPiece& piece, const VtuArrays& arrays = {}) {
  std::string bytes;
  const absl::Status status = WriteVtu(
      piece,
      [&](absl::string_view chunk) {
        absl::StrAppend(&bytes, chunk);
        return absl::OkStatus();
      },
      arrays);
  EXPECT_TRUE(status.ok()) << status;
  return bytes;
}

TEST(VtuWriterTest, ChunksAreSmallAndTogetherTheFile) {
  VtuPiece piece = Row(20000);
  uint64_t random = 1;  // coordinates that do not compress, so that there are several chunks
  for (Point3& p : piece.points) {
    for (double& x : p) {
      random = random * 6364136223846793005u + 1442695040888963407u;
      x = static_cast<double>(random >> 11);
    }
  }
  std::vector<size_t> sizes;
  std::string bytes;
  ASSERT_TRUE(WriteVtu(piece, [&](absl::string_view chunk) {
                sizes.push_back(chunk.size());
                absl::StrAppend(&bytes, chunk);
                return absl::OkStatus();
              }).ok());
  ASSERT_GE(sizes.size(), 2);
  for (size_t i = 0; i + 1 < sizes.size(); ++i) EXPECT_EQ(sizes[i], kVtuChunkBytes);
  EXPECT_LE(sizes.back(), kVtuChunkBytes);
  EXPECT_EQ(bytes, Written(piece)) << "the same piece gives the same bytes";

  const std::string path = testing::TempDir() + "/vtu_writer_test.vtu";
  ASSERT_TRUE(WriteVtuFile(piece, path).ok());
  std::ifstream file(path, std::ios::binary);
  EXPECT_EQ(bytes, std::string(std::istreambuf_iterator<char>(file), {}));
  std::filesystem::remove(path);
}

TEST(VtuWriterTest, AFailingSinkEndsTheWritingWithItsError) {
  int calls = 0;
  const absl::Status status = WriteVtu(Row(1), [&](absl::string_view) {
    ++calls;
    return absl::CancelledError("client went away");
  });
  EXPECT_EQ(status, absl::CancelledError("client went away"));
  EXPECT_EQ(calls, 1);
}

TEST(VtuWriterTest, ArraysThatAreNotWantedAreNeitherCheckedNorDeclared) {
  VtuPiece piece = Row(2);
  piece.state.clear();
  piece.point_ids.clear();
  const VtuArrays arrays{.point_id = false, .state = false};
  for (const std::string& text : {Written(piece, arrays), PvtuText({"a.vtu"}, arrays)}) {
    EXPECT_THAT(text, Not(HasSubstr("state")));
    EXPECT_THAT(text, HasSubstr("PointData>\n</"));
    EXPECT_THAT(text, HasSubstr("\"level\""));
  }
}

TEST(VtuWriterTest, PolyhedraListEachPointOnceAndHexahedraKeepTheirPlace) {
  VtuPiece piece = Row(1);
  piece.AddPolyhedron({3, 3, 3, 3}, {0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3}, {.id = 1});
  piece.AddHexahedron({0, 1, 2, 3, 4, 5, 6, 7}, {.id = 2});
  EXPECT_THAT(piece.offsets, testing::ElementsAre(8, 12, 20));
  EXPECT_THAT(piece.face_offsets, testing::ElementsAre(-1, 17, -1));
  EXPECT_THAT(Written(piece), HasSubstr("faceoffsets"));
}

TEST(VtuWriterTest, PieceNamesAreEscaped) {
  EXPECT_THAT(PvtuText({"a&b<c>\"d\".vtu"}), HasSubstr("Source=\"a&amp;b&lt;c&gt;&quot;d&quot;.vtu\""));
}

VtuPiece RowWithFields() {
  VtuPiece piece = Row(2);
  piece.point_fields = {{"t.emp-1", VtuField::Type::kDoubles, std::vector<double>(12, 0.5), {}, {}},
                        {"wind", VtuField::Type::kVectors, std::vector<double>(36, 0.25), {}, {}}};
  piece.cell_fields = {{"age", VtuField::Type::kIntegers, {}, {7, -7}, {}},
                       {"rock", VtuField::Type::kTexts, {}, {}, {"clay", ""}}};
  return piece;
}

TEST(VtuWriterTest, AnIndexIsMadeLikeAPieceWithFields) {
  const std::string piece = Written(RowWithFields());
  const absl::StatusOr<std::string> index = PvtuTextLike(piece, {"a.vtu", "b.vtu"});
  ASSERT_TRUE(index.ok()) << index.status();
  EXPECT_THAT(*index, HasSubstr("<PDataArray type=\"Float64\" Name=\"t.emp-1\"/>\n"));
  EXPECT_THAT(*index, HasSubstr("<PDataArray type=\"Float64\" Name=\"wind\" NumberOfComponents=\"3\"/>\n"));
  EXPECT_THAT(*index, HasSubstr("<PDataArray type=\"Int64\" Name=\"age\"/>\n"));
  EXPECT_THAT(*index, HasSubstr("<PArray type=\"String\" Name=\"rock\"/>\n"));
  // Without fields it is the other one.
  EXPECT_EQ(PvtuTextLike(Written(Row(1)), {"a.vtu"}).value(), PvtuText({"a.vtu"}));
  for (absl::string_view other : {absl::string_view(""), absl::string_view("<PointData>\nx\n</PointData>"),
                                  absl::string_view(piece).substr(300)}) {
    EXPECT_EQ(PvtuTextLike(other, {"a.vtu"}).status().code(), absl::StatusCode::kInvalidArgument) << other;
  }
}

struct BadCase {
  const char* name;
  VtuPiece piece;
  std::function<void(VtuPiece&)> damage;
  const char* message;
};

TEST(VtuWriterTest, ArraysThatDoNotFitAreRefusedBeforeAnythingIsWritten) {
  const BadCase cases[] = {
      {"vector of two", RowWithFields(), [](VtuPiece& p) { p.point_fields[1].doubles.resize(33); },
       "array wind has 11 entries for 12 points"},
      {"cell without text", RowWithFields(), [](VtuPiece& p) { p.cell_fields[1].texts.pop_back(); },
       "array rock has 1 entries for 2 cells"},
      {"point without id", Row(2), [](VtuPiece& p) { p.point_ids.pop_back(); },
       "point_ids has 11 entries for 12"},
      {"cell without level", Row(2), [](VtuPiece& p) { p.level.pop_back(); },
       "level has 1 entries for 2 cells"},
      {"cell without end", Row(2), [](VtuPiece& p) { p.offsets.pop_back(); },
       "offsets has 1 entries for 2 cells"},
      {"point out of range", Row(2), [](VtuPiece& p) { p.connectivity[9] = 12; },
       "cell 1 names point 12 of 12"},
      {"negative point", Row(2), [](VtuPiece& p) { p.connectivity[0] = -1; }, "cell 0 names point -1 of 12"},
      {"seven corners", Row(2), [](VtuPiece& p) { p.offsets[0] = 7; },
       "cell 0 is a hexahedron with 7 points"},
      {"offset past the end", Row(2), [](VtuPiece& p) { p.offsets[1] = 17; }, "cell 1 ends at 17 of 16"},
      {"points of no cell", Row(2), [](VtuPiece& p) { p.connectivity.push_back(0); }, "cells use 16 of 17"},
      {"unknown type", Row(2), [](VtuPiece& p) { p.types[1] = 9; }, "cell 1 is of VTK type 9"},
      {"another kind", Row(2), [](VtuPiece& p) { p.types[1] = kVtkTetra; },
       "cell 1 is a tetrahedron with 8 points"},
      {"no faces", Row(2), [](VtuPiece& p) { p.types[1] = kVtkPolyhedron; },
       "cell 1 is a polyhedron whose faces"},
      {"face too long", Tetrahedron(), [](VtuPiece& p) { p.faces[1] = 300; },
       "cell 0 is a polyhedron whose faces"},
      {"face point out of range", Tetrahedron(), [](VtuPiece& p) { p.faces[2] = 4; },
       "cell 0 is a polyhedron"},
      {"fewer faces than said", Tetrahedron(), [](VtuPiece& p) { p.faces[0] = 5; },
       "cell 0 is a polyhedron whose"},
      {"faces past the end", Tetrahedron(), [](VtuPiece& p) { p.face_offsets[0] = 18; },
       "cell 0 is a polyhedron"},
  };
  for (const BadCase& bad : cases) {
    SCOPED_TRACE(bad.name);
    VtuPiece piece = bad.piece;
    const auto refuse = [](absl::string_view) { return absl::InternalError("the sink was called"); };
    EXPECT_TRUE(absl::IsInternal(WriteVtu(piece, refuse))) << "good before the damage";
    bad.damage(piece);
    const absl::Status status = WriteVtu(piece, refuse);
    EXPECT_TRUE(absl::IsInvalidArgument(status)) << status;
    EXPECT_THAT(std::string(status.message()), HasSubstr(bad.message));
  }
}

TEST(VtuWriterTest, NothingIsLeftBehindOnAnError) {
  const std::string folder = testing::TempDir() + "/vtu_writer_test_folder";
  std::filesystem::create_directories(folder + "/taken/x");  // a folder that is not empty: rename fails
  VtuPiece piece = Row(1);
  EXPECT_FALSE(WriteVtuFile(piece, folder + "/taken").ok());
  EXPECT_FALSE(WriteVtuFile(piece, folder + "/no/such.vtu").ok());
  piece.types[0] = 0;
  EXPECT_TRUE(absl::IsInvalidArgument(WriteVtuFile(piece, folder + "/a.vtu")));
  std::filesystem::remove_all(folder + "/taken");
  EXPECT_THAT(std::vector<std::filesystem::path>(std::filesystem::directory_iterator(folder), {}), IsEmpty());
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace ndmap

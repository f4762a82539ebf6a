// SPDX-License-Identifier: GPL-3.0-or-later
// The ids of random surfaces, whatever the cut: tests/property/surface_property_test.cc. Here: what a piece
// says in a small one, and what is no piece.
#include "core/names/polygon_cells.h"

#include <cmath>
#include <functional>
#include <utility>
#include <vector>

#include "gmock/gmock.h"
#include "gtest/gtest.h"

namespace ndmap {
namespace {

using ::testing::HasSubstr;

// Faces 2 (a triangle), 5 and 9 (quadrilaterals) of some surface around point 0; block 0 has 5 and 9. 2 and 5
// share the edge of points 0 and 2, 5 and 9 that of 0 and 3.
PolygonPiece ThreeFaces() {
  PolygonPiece piece;
  piece.mesh.points = {{0, 0, 0}, {0, -1, 0}, {-1, 0, 0}, {0, 1, 0}, {-1, 1, 0}, {1, 0, 0}, {1, 1, 0}};
  piece.mesh.AddFace({0, 2, 1});
  piece.mesh.AddFace({2, 0, 3, 4});
  piece.mesh.AddFace({5, 6, 3, 0});
  piece.numbers = {2, 5, 9};
  piece.corners_before = {7, 20, 36};
  piece.blocks = {1, 0, 0};
  return piece;
}

TEST(PolygonCellsTest, EdgesAndVerticesAreNamedByTheLowestFace) {
  const auto cells = PolygonCells::Make(ThreeFaces(), BlockId{0}, 2);
  ASSERT_TRUE(cells.ok()) << cells.status();
  const PolygonCells& c = **cells;
  EXPECT_EQ(c.own_faces(), 2u);
  EXPECT_EQ(c.FaceOf(5), 1u);
  EXPECT_EQ(c.FaceOf(6), kNoCell);
  // Corners 2 0 3 4 of face 5: two of them are corners 1 and 0 of face 2.
  EXPECT_EQ(c.VertexName(1, 0).ToString(), "v2#1");
  EXPECT_EQ(c.VertexName(1, 1).ToString(), "v2#0");
  EXPECT_EQ(c.VertexName(1, 2).ToString(), "v5#2");
  EXPECT_EQ(c.VertexName(2, 2).ToString(), "v5#2");
  EXPECT_EQ(c.VertexName(2, 3).ToString(), "v2#0");
  EXPECT_EQ(c.VertexName(2, 0).ToString(), "v9#0");
  EXPECT_EQ(c.EdgeName(1, 0).ToString(), "e2#0");
  EXPECT_EQ(c.EdgeName(1, 1).ToString(), "e5#1");
  EXPECT_EQ(c.EdgeName(2, 2).ToString(), "e5#1");
  EXPECT_EQ(c.EdgeName(2, 3).ToString(), "e9#3");
  EXPECT_EQ(c.Beyond(1, 0), (SideLink{0, 0}));
  EXPECT_EQ(c.Beyond(1, 1), (SideLink{2, 2}));
  EXPECT_TRUE(c.Beyond(1, 2).boundary());
}

TEST(PolygonCellsTest, EveryNameOfAPlaceLeadsToIt) {
  const auto cells = PolygonCells::Make(ThreeFaces(), BlockId{0}, 2);
  ASSERT_TRUE(cells.ok()) << cells.status();
  const auto find = [&](const char* id) { return (*cells)->Find(CellId::Parse(id).value()); };
  for (const char* alias : {"v2#0", "v5#1", "v9#3"}) {
    EXPECT_EQ(find(alias).id.ToString(), "v2#0") << alias;
    EXPECT_THAT(find(alias).at, testing::ElementsAre(SideLink{1, 1}, SideLink{2, 3})) << alias;
  }
  for (const char* alias : {"e5#1", "e9#2"}) {
    EXPECT_EQ(find(alias).id.ToString(), "e5#1") << alias;
    EXPECT_THAT(find(alias).at, testing::UnorderedElementsAre(SideLink{1, 1}, SideLink{2, 2})) << alias;
  }
  EXPECT_EQ(find("e2#0").id.ToString(), "e2#0");
  EXPECT_THAT(find("e2#0").at, testing::ElementsAre(SideLink{1, 0}));
  // Of the other block's face alone; corners that are not there; other kinds of ids; other faces.
  for (const char* none : {"v2#2", "e2#1", "v5#4", "f5", "h5", "v5:1", "f5#0", "v7#0"}) {
    EXPECT_FALSE(find(none).id.valid()) << none;
    EXPECT_TRUE(find(none).at.empty()) << none;
  }
}

TEST(PolygonCellsTest, APieceThatIsNoneIsRefusedWithASentence) {
  const std::vector<std::pair<const char*, std::function<void(PolygonPiece&)>>> wrong = {
      {"do not fit together", [](PolygonPiece& p) { p.numbers.pop_back(); }},
      {"do not fit together", [](PolygonPiece& p) { p.corners_before.pop_back(); }},
      {"do not fit together", [](PolygonPiece& p) { p.mesh.begins.back() = 1000; }},
      {"do not fit together", [](PolygonPiece& p) { std::swap(p.mesh.begins[1], p.mesh.begins[2]); }},
      {"do not fit together", [](PolygonPiece& p) { p = PolygonPiece(); }},
      {"face 0 of a piece of a mesh has fewer than three corners",
       [](PolygonPiece& p) { p.mesh.begins[1] = 2; }},
      {"face 2 of a piece of a mesh has a point that is not there",
       [](PolygonPiece& p) { p.mesh.corners.back() = 7; }},
      {"face 2 of a piece of a mesh has a point twice", [](PolygonPiece& p) { p.mesh.corners.back() = 5; }},
      {"face 1 of a piece of a mesh is out of order", [](PolygonPiece& p) { p.numbers[1] = 2; }},
      {"face 1 of a piece of a mesh has corner numbers that overlap",
       [](PolygonPiece& p) { p.corners_before[1] = 9; }},
      {"do not fit in a label", [](PolygonPiece& p) { p.corners_before[2] = (uint64_t{1} << 44) - 3; }},
      {"does not fit in an id", [](PolygonPiece& p) { p.numbers[2] = CellId::kMaxInitial + 1; }},
      {"in a block that is not there", [](PolygonPiece& p) { p.blocks[1] = 2; }},
      {"without a face of its block",
       [](PolygonPiece& p) {
         p.blocks = {1, 1, 1};
       }},
      {"not finite", [](PolygonPiece& p) { p.mesh.points[3][1] = std::nan(""); }},
      {"faces 2 and 5 of the mesh run an edge in the same direction",
       [](PolygonPiece& p) { std::swap(p.mesh.corners[0], p.mesh.corners[1]); }}};
  for (const auto& [what, spoil] : wrong) {
    PolygonPiece piece = ThreeFaces();
    spoil(piece);
    const auto cells = PolygonCells::Make(std::move(piece), BlockId{0}, 2);
    ASSERT_FALSE(cells.ok()) << what;
    EXPECT_EQ(cells.status().code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(cells.status().message()), HasSubstr(what));
  }
}

}  // namespace
}  // namespace ndmap

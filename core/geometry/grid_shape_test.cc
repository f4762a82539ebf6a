// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/geometry/grid_shape.h"

#include <limits>

#include "gmock/gmock.h"
#include "gtest/gtest.h"

namespace ndmap {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(GridShapeTest, CountsEnlargeTheBoxAboutItsCentre) {
  const auto grid = GridFromCounts({{0, -1, 2}, {4, 1, 10}}, {4, 2, 8}, 0.5);
  ASSERT_TRUE(grid.ok()) << grid.status();
  EXPECT_THAT(grid->lo, ElementsAre(-1, -1.5, 0));
  EXPECT_THAT(grid->hi, ElementsAre(5, 1.5, 12));
  EXPECT_EQ(grid->CellCount(), 64u);
  EXPECT_THAT(grid->Corner(0, 0, 0), ElementsAre(-1, -1.5, 0));
  EXPECT_THAT(grid->Corner(2, 1, 6), ElementsAre(2, 0, 9));
  EXPECT_THAT(grid->Corner(4, 2, 8), ElementsAre(5, 1.5, 12));
}

TEST(GridShapeTest, CubesAreCubesAndCoverTheBox) {
  const Box3 box{{-3, 0, 1}, {4, 2.5, 1.01}};
  const auto grid = GridFromCubes(box, 11);
  ASSERT_TRUE(grid.ok()) << grid.status();
  EXPECT_THAT(grid->cells, ElementsAre(11, 4, 1));
  const double side = 1.001 * 7 / 11;
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR((grid->hi[c] - grid->lo[c]) / grid->cells[c], side, 1e-14);
    EXPECT_NEAR(grid->lo[c] + grid->hi[c], box.lo[c] + box.hi[c], 1e-14);
    EXPECT_LT(grid->lo[c], box.lo[c]);
    EXPECT_GT(grid->hi[c], box.hi[c]);
  }
}

TEST(GridShapeTest, AutoIsNearCubicAndAboutAsMany) {
  for (const Box3& box :
       {Box3{{0, 0, 0}, {1, 1, 1}}, Box3{{0, 0, 0}, {1, 3, 9}}, Box3{{5, 5, 5}, {6, 6, 7}}}) {
    for (uint32_t about : {1u, 8u, 1000u, 100000u}) {
      const auto grid = GridAuto(box, about);
      ASSERT_TRUE(grid.ok()) << grid.status();
      EXPECT_GE(grid->CellCount(), about / 2);
      EXPECT_LE(grid->CellCount(), about * 3 / 2);
      if (about < 1000) continue;
      const double first = (grid->hi[0] - grid->lo[0]) / grid->cells[0];
      for (int c = 1; c < 3; ++c) EXPECT_NEAR((grid->hi[c] - grid->lo[c]) / grid->cells[c] / first, 1, 0.3);
    }
  }
}

TEST(GridShapeTest, AutoGivesAThinBoxOneLayer) {
  const auto grid = GridAuto({{0, 0, 0}, {10, 10, 1e-9}}, 900);
  ASSERT_TRUE(grid.ok()) << grid.status();
  EXPECT_THAT(grid->cells, ElementsAre(30, 30, 1));
}

TEST(GridShapeTest, RefusesWhatHasNoGrid) {
  const double inf = std::numeric_limits<double>::infinity();
  const Box3 unit{{0, 0, 0}, {1, 1, 1}};
  const auto message = [](const absl::StatusOr<GridShape>& grid) {
    EXPECT_EQ(grid.status().code(), absl::StatusCode::kInvalidArgument);
    return std::string(grid.status().message());
  };
  EXPECT_THAT(message(GridFromCounts({{0, 0, 0}, {1, 0, 1}}, {1, 1, 1})),
              HasSubstr("flat: no extent along y"));
  EXPECT_THAT(message(GridFromCubes({{0, 0, 0}, {1, 1, inf}}, 3)), HasSubstr("not finite along z"));
  EXPECT_THAT(message(GridFromCounts({{0, 0, 0}, {1, 1, 1e308}}, {1, 1, 1})),
              HasSubstr("not finite along z"));
  EXPECT_THAT(message(GridFromCounts(unit, {1, 0, 1})), HasSubstr("0 cells along y"));
  EXPECT_THAT(message(GridFromCounts(unit, {1u << 31, 1u << 31, 1u << 31})), HasSubstr("2^32 cells or more"));
  EXPECT_THAT(message(GridFromCounts(unit, {1, 1, 1}, -0.1)), HasSubstr("padding -0.1"));
  EXPECT_THAT(message(GridFromCounts(unit, {1, 1, 1}, inf)), HasSubstr("padding inf"));
  EXPECT_THAT(message(GridFromCubes(unit, 0)), HasSubstr("0 cubes"));
  EXPECT_THAT(message(GridAuto(unit, 0)), HasSubstr("about 0 cells"));
  EXPECT_THAT(message(GridFromCounts({{1e9, 0, 0}, {1e9 + 1e-6, 1, 1}}, {1000, 1, 1})),
              HasSubstr("too small"));
}

TEST(GridShapeTest, RefusesCoordinatesWhoseSquaresAreNotFinite) {
  for (const Box3& box : {Box3{{-2e150, 0, 0}, {1, 1, 1}}, Box3{{0, 0, 0}, {1e160, 1e160, 1e160}}}) {
    for (const auto& grid : {GridFromCounts(box, {2, 2, 2}), GridFromCubes(box, 3), GridAuto(box)}) {
      ASSERT_EQ(grid.status().code(), absl::StatusCode::kInvalidArgument);
      EXPECT_THAT(std::string(grid.status().message()), HasSubstr("are beyond 1e150: scale the surface"));
    }
  }
  EXPECT_TRUE(GridFromCounts({{0, 0, 0}, {1e149, 1e149, 1e149}}, {2, 2, 2}).ok());
}

TEST(CheckDepthTest, NamesTheDeepestLevelOfTheGrid) {
  GridShape grid;
  grid.cells = {10, 11, 9};
  grid.hi = {10, 11, 9};
  EXPECT_TRUE(CheckDepth(grid, 17).ok());
  EXPECT_EQ(CheckDepth(grid, 18).message(),
            "depth 18 is too deep: on a grid of 10x11x9 numbers in files reach level 17");
  grid.lo = {1e6, 0, 0};
  grid.hi[0] = 1e6 + 1e-3;
  EXPECT_EQ(CheckDepth(grid, 17).message(),
            "depth 17 is too deep: on a grid of 10x11x9 coordinates tell corners apart to level 16");
}

}  // namespace
}  // namespace ndmap

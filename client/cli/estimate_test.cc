// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/estimate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <memory>

#include "core/io/sample_surface.h"

namespace ndmap::cli {
namespace {

std::shared_ptr<const TriangleSurface> Sample(const char* kind) {
  return std::make_shared<const TriangleSurface>(*MakeSample(kind));
}

TEST(Estimate, TheSampleIsWithinSomePercentOfTheWholeCount) {
  for (const char* kind : {"bumpy-torus", "knot", "shells"}) {
    const auto surface = Sample(kind);
    const GridShape grid = *GridAuto(BoundingBox(*surface));
    const Estimate exact = EstimateRefinement(surface, grid, 4, 1u << 30);
    const Estimate sampled = EstimateRefinement(surface, grid, 4, 500);
    EXPECT_NEAR(sampled.made() / exact.made(), 1, 0.1) << kind;
    EXPECT_NEAR(sampled.cut() / exact.cut(), 1, 0.15) << kind;
    EXPECT_NEAR(sampled.inside() / exact.inside(), 1, 0.15) << kind;
    // Not by chance equal because nothing was sampled.
    EXPECT_NE(sampled.made(), exact.made()) << kind;
  }
}

TEST(Estimate, EveryLevelHasTheChildrenOfTheOneAbove) {
  const auto surface = Sample("sphere");
  const Estimate estimate = EstimateRefinement(surface, *GridAuto(BoundingBox(*surface)), 3, 1u << 30);
  ASSERT_EQ(estimate.levels.size(), 4u);
  for (size_t l = 1; l < 4; ++l) EXPECT_EQ(estimate.levels[l].cells, 8 * estimate.levels[l - 1].refined);
  for (const auto& level : estimate.levels) {
    EXPECT_EQ(level.cells, level.refined + level.cut + level.inside + level.outside);
  }
}

TEST(DepthForSize, HalvesUntilTheLongestEdgeFits) {
  GridShape grid;
  grid.cells = {2, 1, 1};
  grid.hi = {4, 1, 1};
  EXPECT_EQ(DepthForSize(grid, 2), 0);
  EXPECT_EQ(DepthForSize(grid, 1.99), 1);
  EXPECT_EQ(DepthForSize(grid, 0.25), 3);
  EXPECT_GT(DepthForSize(grid, 1e-30), CellId::kMaxLevel);
}

}  // namespace
}  // namespace ndmap::cli

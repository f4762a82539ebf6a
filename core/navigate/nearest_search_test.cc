// SPDX-License-Identifier: GPL-3.0-or-later
// The search in parts against a look at every vertex.
#include "core/navigate/nearest_search.h"

#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <random>

#include "core/algorithm/refine/frame.h"
#include "core/geometry/compare_distance.h"
#include "core/names/cell_names.h"
#include "core/sim/simulated_blocks.h"

namespace ndmap {
namespace {

struct Counts {
  int choices = 0, slow_choices = 0, steps = 0;
};

class NearestSearchTest : public ::testing::Test {
 protected:
  void Build(const GridShape& grid) {
    ASSERT_TRUE(blocks_.Build(grid).ok());
    initial_ = std::make_unique<GridCells>(grid.cells);
    CellIndexBuilder builder;
    ASSERT_TRUE(builder.Step(blocks_[0], size_t{1} << 20).value());
    index_ = builder.Build();
  }
  CellId Search(const Point3& point, size_t budget, Counts* counts = nullptr) {
    NearestSearch search(*index_, *initial_, point);
    while (true) {
      while (!search.Step(blocks_[0], budget)) {
        if (counts != nullptr) ++counts->steps;
      }
      if (search.done()) return search.nearest().id;
      if (counts != nullptr) {
        ++counts->choices;
        counts->slow_choices += search.ChoosesQuickly() ? 0 : 1;
      }
      search.Choose();
    }
  }
  CellId LookAtAll(const Point3& point) {
    std::optional<std::pair<Point3, CellId>> best;
    auto& map = blocks_[0].map();
    CellNames<Block3> names(map, *initial_);
    auto& cells = map.attributes<3>();
    for (auto it = cells.begin(); it != cells.end(); ++it) {
      const size_t darts = names.Look(it);
      for (size_t k = 0; k < darts; ++k) {
        const Point3 p = Frame<Block3>::StartPoint(map, names.dart(k));
        const int order = best ? CompareDistance(point, p, best->first) : -1;
        if (order < 0 || (order == 0 && names.Name(k, 0) < best->second)) best = {p, names.Name(k, 0)};
      }
    }
    return best->second;
  }

  SimulatedBlocks blocks_{1};
  std::unique_ptr<GridCells> initial_;
  std::shared_ptr<const CellIndex> index_;
};

TEST_F(NearestSearchTest, IsThatOfAllVerticesForPointsNearAndFarAndEquallyFarFromMany) {
  GridShape grid;
  grid.cells = {5, 6, 7};
  grid.lo = {0, 0, 0};
  grid.hi = {5, 6, 7};
  Build(grid);
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> in(-3, 9);
  std::uniform_int_distribution<int> halves(-4, 16);
  for (const double scale : {1.0, 1e-200, 1e3, 1e7, 1e17, 1e160, 1e305}) {
    for (int k = 0; k < 40; ++k) {
      const Point3 p = {scale * in(random), scale * in(random), scale * in(random)};
      EXPECT_EQ(Search(p, 1 + k % 5), LookAtAll(p)) << scale << " " << k;
      // Between cells, and on planes of symmetry.
      const Point3 q = {scale * halves(random) / 2, 0.5 * halves(random), scale * halves(random) / 2};
      EXPECT_EQ(Search(q, 1 + k % 5), LookAtAll(q)) << scale << " " << k;
    }
  }
}

TEST_F(NearestSearchTest, ManyCellsAreWeighedApartFromTheStepsThatLookAtThem) {
  // Boxes are much nearer than the vertices: all are looked at.
  GridShape grid;
  grid.cells = {1, 600, 1};
  grid.lo = {-1000, 0, 0};
  grid.hi = {1000, 600, 1};
  Build(grid);
  const Point3 middle = {0, 300.25, 0.5};
  Counts counts;
  EXPECT_EQ(Search(middle, 10, &counts), LookAtAll(middle));
  EXPECT_EQ(counts.choices, 4);
  EXPECT_EQ(counts.slow_choices, 1);
  EXPECT_GE(counts.steps, 50);
  // Far away it weighs all, and looks at the nearest alone.
  const Point3 far = {0, 1e200, 0};
  counts = {};
  EXPECT_EQ(Search(far, 10, &counts), LookAtAll(far));
  EXPECT_EQ(counts.choices, 1);
  EXPECT_EQ(counts.slow_choices, 1);
  EXPECT_EQ(counts.steps, 0);
}

}  // namespace
}  // namespace ndmap

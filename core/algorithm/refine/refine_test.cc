// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/algorithm/refine/refine.h"

#include <map>
#include <string>

#include "core/io/sample_surface.h"
#include "core/sim/simulated_blocks.h"
#include "gtest/gtest.h"

namespace ndmap {
namespace {

std::map<std::string, CellState> StatesOf(SimulatedBlocks& blocks) {
  std::map<std::string, CellState> states;
  for (size_t b = 0; b < blocks.size(); ++b) {
    auto& cells = blocks[b].map().attributes<3>();
    for (auto it = cells.begin(); it != cells.end(); ++it) {
      const auto& info = blocks[b].map().info_of_attribute<3>(it);
      states[info.id.ToString()] = info.state;
    }
  }
  return states;
}

TEST(RefineTest, KeepsStatesThatWereKnownBefore) {
  SimulatedBlocks blocks(2, std::make_shared<const TriangleSurface>(*MakeSample("sphere", {2000, 1})));
  GridShape grid;
  grid.cells = {9, 9, 9};
  grid.lo = {-1.5, -1.5, -1.5};
  grid.hi = {1.5, 1.5, 1.5};
  ASSERT_TRUE(blocks.Build(grid).ok());
  ASSERT_TRUE(blocks.Run("classify").ok());
  const auto before = StatesOf(blocks);
  Parameters depth;
  depth.Set("depth", int64_t{1});
  const auto refined = blocks.Run("refine", depth);
  ASSERT_TRUE(refined.ok()) << refined.status();
  EXPECT_GT(refined->counts.at("refined"), 0);
  int inside = 0, outside = 0;
  for (const auto& [id, state] : StatesOf(blocks)) {
    const auto known = before.find(id);
    if (known == before.end()) {
      // Children are new: nothing is known of them, and classify asks.
      EXPECT_TRUE(state == CellState::kUnknown) << id;
      continue;
    }
    EXPECT_TRUE(state == known->second) << id;
    inside += state == CellState::kInside;
    outside += state == CellState::kOutside;
  }
  EXPECT_GT(inside, 0);
  EXPECT_GT(outside, 0);
}

GridShape Cube() {
  GridShape grid;
  grid.cells = {4, 4, 4};
  grid.lo = {0, 0, 0};
  grid.hi = {4, 4, 4};
  return grid;
}

TEST(RefineTest, BoxesAndBallsWithoutPointsAreRefused) {
  SimulatedBlocks blocks(2, nullptr);
  ASSERT_TRUE(blocks.Build(Cube()).ok());
  Parameters box, ball;
  box.Set("oracle", "box").Set("depth", int64_t{1}).Set("lo", "0,3,0").Set("hi", "1,2.5,1");
  const absl::Status empty = blocks.Run("refine", box).status();
  EXPECT_EQ(empty.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(empty.message(), "an empty box: parameter 'lo' is 3 in y, above 'hi', which is 2.5");
  ball.Set("oracle", "sphere").Set("depth", int64_t{1}).Set("centre", "1,1,1").Set("radius", -0.5);
  const absl::Status negative = blocks.Run("refine", ball).status();
  EXPECT_EQ(negative.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(negative.message(), "parameter 'radius' is -0.5, below 0");
  // A point is a box and a ball.
  EXPECT_EQ(blocks.Run("refine", box.Set("hi", "0,3,0"))->counts.at("refined"), 2);
  EXPECT_EQ(blocks.Run("refine", ball.Set("radius", 0.0))->counts.at("refined"), 8);
}

TEST(RefineTest, ListedCellsAreCountedOnceAndSoAreThoseThatWereFound) {
  for (size_t count : {1, 3}) {
    SimulatedBlocks blocks(count, nullptr);
    ASSERT_TRUE(blocks.Build(Cube()).ok());
    Parameters list;
    // h1/7 is made by the same phase; level 2 is not refined to depth 2, and not asked for.
    list.Set("oracle", "list").Set("depth", int64_t{2}).Set("cells", "h1 h1/7 h63 h64 h70/1 h1/7.1");
    const auto all = blocks.Run("refine", list);
    ASSERT_TRUE(all.ok()) << all.status();
    EXPECT_EQ(all->counts.at("listed"), 5);
    EXPECT_EQ(all->counts.at("listed_found"), 3);
    // Level by level.
    const auto level = blocks.Run("refine", list.Set("level", int64_t{0}).Set("cells", "h1 h2 h2/0"));
    ASSERT_TRUE(level.ok()) << level.status();
    EXPECT_EQ(level->counts.at("listed"), 2);
    EXPECT_EQ(level->counts.at("listed_found"), 1);
  }
}

}  // namespace
}  // namespace ndmap

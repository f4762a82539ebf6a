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

}  // namespace
}  // namespace ndmap

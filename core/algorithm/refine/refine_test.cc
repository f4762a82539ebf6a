// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/algorithm/refine/refine.h"

#include <map>
#include <random>
#include <string>

#include "core/geometry/surface_index.h"
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
      // Children are new: whether they are cut is known, and classify asks for the side.
      EXPECT_TRUE(state == CellState::kCut || state == CellState::kClear) << id;
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

// Children are told together, when their parent is split: as each box alone would be.
TEST(RefineTest, TellsOfEveryHexahedronWhetherItIsCut) {
  const auto surface = std::make_shared<const TriangleSurface>(*MakeSample("sphere", {500, 1}));
  const SurfaceIndex index(surface);
  for (bool by_level : {false, true}) {
    SimulatedBlocks blocks(2, surface);
    GridShape grid;
    grid.cells = {5, 4, 6};
    grid.lo = {-1.3, -1.7, -1.01};
    grid.hi = {1.4, 1.1, 1.6};
    ASSERT_TRUE(blocks.Build(grid).ok());
    Parameters depth;
    depth.Set("depth", int64_t{3});
    for (int64_t level = 0; level < (by_level ? 3 : 1); ++level) {
      if (by_level) depth.Set("level", level);
      ASSERT_TRUE(blocks.Run("refine", depth).ok());
    }
    int cut = 0, clear = 0;
    for (size_t b = 0; b < blocks.size(); ++b) {
      auto& map = blocks[b].map();
      for (auto it = map.attributes<3>().begin(); it != map.attributes<3>().end(); ++it) {
        const auto& info = map.info_of_attribute<3>(it);
        const bool meets = index.Meets(CellBox<Block3>(map, it));
        ASSERT_TRUE(info.state == (meets ? CellState::kCut : CellState::kClear)) << info.id.ToString();
        ++(meets ? cut : clear);
      }
    }
    EXPECT_GT(cut, 1000);
    EXPECT_GT(clear, 1000);
  }
}

// Hexahedra of any shape, so that every midpoint and centre is rounded, and some split by neighbours before:
// where the children will be is where they are, to the bit.
TEST(RefineTest, ChildrenAreWhereTheirParentSaysToTheBit) {
  constexpr std::array<uint32_t, 3> kCells = {3, 3, 2};
  SimulatedBlocks blocks(2);
  const auto corner = [](uint32_t i, uint32_t j, uint32_t k) {
    std::mt19937 random(i + 10 * j + 100 * k);
    std::uniform_real_distribution<double> shift(-0.3, 0.3);
    const double x = i + shift(random), y = j + shift(random);
    return Point3{x, y, k + shift(random)};
  };
  std::vector<uint32_t> block_of(18);
  for (size_t h = 0; h < block_of.size(); ++h) block_of[h] = h % 2;
  std::vector<std::unique_ptr<BlockAlgorithm>> build;
  for (size_t b = 0; b < 2; ++b) {
    build.push_back(std::make_unique<Build<Block3>>(kCells, corner, Assignment::FromTable(block_of),
                                                    Routing::kDirect, blocks[b]));
  }
  ASSERT_TRUE(Simulator({}).RunPhase(build).ok());
  std::map<std::string, Box3> told;
  int checked = 0;
  for (const char* cells : {"h0 h4 h8 h13 h15", "h0/1 h4/6 h8/0 h13/3", "h1 h3 h5 h7 h10 h12 h16 h4/6.2"}) {
    for (size_t b = 0; b < 2; ++b) {
      auto& map = blocks[b].map();
      for (auto it = map.attributes<3>().begin(); it != map.attributes<3>().end(); ++it) {
        const auto boxes = ChildBoxes(Frame<Block3>::Of(map, it).Corners(map));
        for (unsigned c = 0; c < 8; ++c) told[map.info_of_attribute<3>(it).id.Child(c).ToString()] = boxes[c];
      }
    }
    const auto refined =
        blocks.Run("refine", Parameters().Set("oracle", "list").Set("cells", cells).Set("depth", int64_t{4}));
    ASSERT_TRUE(refined.ok()) << refined.status();
    for (size_t b = 0; b < 2; ++b) {
      auto& map = blocks[b].map();
      for (auto it = map.attributes<3>().begin(); it != map.attributes<3>().end(); ++it) {
        const auto expected = told.find(map.info_of_attribute<3>(it).id.ToString());
        if (expected == told.end()) continue;
        const Box3 box = CellBox<Block3>(map, it);
        EXPECT_EQ(box.lo, expected->second.lo) << expected->first;
        EXPECT_EQ(box.hi, expected->second.hi) << expected->first;
        ++checked;
      }
    }
  }
  EXPECT_GT(checked, 200);
}

}  // namespace
}  // namespace ndmap

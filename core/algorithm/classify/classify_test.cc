// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/algorithm/classify/classify.h"

#include <map>
#include <string>

#include "core/io/sample_surface.h"
#include "core/sim/simulated_blocks.h"
#include "gtest/gtest.h"

namespace ndmap {
namespace {

std::map<std::string, CellState> StatesById(SimulatedBlocks& blocks) {
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

GridShape SevenCubesAround(const TriangleSurface& surface) {
  return GridFromCubes(BoundingBox(surface), 7).value();
}

// Each cell by itself, without neighbours: its box against every triangle, and parity at its centre.
TEST(ClassifyTest, IsWhatEachCellAloneWouldSay) {
  const auto surface = std::make_shared<const TriangleSurface>(*MakeSample("bumpy-torus", {2000, 1}));
  const SurfaceIndex index(surface);
  for (uint32_t count : {1u, 3u}) {
    SimulatedBlocks blocks(count, surface);
    ASSERT_TRUE(blocks.Build(SevenCubesAround(*surface)).ok());
    ASSERT_TRUE(blocks.Run("refine", Parameters().Set("depth", int64_t{2})).ok());
    const auto report = blocks.Run("classify");
    ASSERT_TRUE(report.ok()) << report.status();
    int64_t inside = 0, outside = 0, cut = 0;
    for (size_t b = 0; b < blocks.size(); ++b) {
      auto& map = blocks[b].map();
      for (auto it = map.attributes<3>().begin(); it != map.attributes<3>().end(); ++it) {
        const auto& info = map.info_of_attribute<3>(it);
        const Box3 box = CellBox<Block3>(map, it);
        CellState expected = CellState::kCut;
        if (!index.Meets(box)) {
          expected =
              InsideByParity(*surface, Midpoint(box.lo, box.hi)) ? CellState::kInside : CellState::kOutside;
        }
        ASSERT_TRUE(info.state == expected) << info.id.ToString();
        ++(expected == CellState::kCut ? cut : expected == CellState::kInside ? inside : outside);
      }
    }
    EXPECT_EQ(report->counts.at("cut"), cut);
    EXPECT_EQ(report->counts.at("inside"), inside);
    EXPECT_EQ(report->counts.at("outside"), outside);
    EXPECT_GT(inside, 100);
    EXPECT_GT(outside, 100);
  }
}

// Level by level, with what is outside erased in between: what stays is classified as all at once.
TEST(ClassifyTest, LevelByLevelIsTheSameAsAtTheEnd) {
  const auto surface = std::make_shared<const TriangleSurface>(*MakeSample("bumpy-torus", {2000, 1}));
  SimulatedBlocks by_level(2, surface), at_end(2, surface);
  for (SimulatedBlocks* blocks : {&by_level, &at_end}) {
    ASSERT_TRUE(blocks->Build(SevenCubesAround(*surface)).ok());
    for (int64_t level = 0; level < 3; ++level) {
      ASSERT_TRUE(blocks->Run("refine", Parameters().Set("depth", int64_t{3}).Set("level", level)).ok());
      if (blocks == &at_end && level < 2) continue;
      ASSERT_TRUE(blocks->Run("classify").ok());
      ASSERT_TRUE(blocks->Run("trim").ok());
    }
  }
  EXPECT_EQ(StatesById(by_level), StatesById(at_end));
  EXPECT_EQ(by_level.Run("hash")->digest, at_end.Run("hash")->digest);
}

}  // namespace
}  // namespace ndmap

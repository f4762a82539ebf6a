// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/algorithm/refine/frame.h"

#include "core/sim/simulated_blocks.h"
#include "gtest/gtest.h"

namespace ndmap {
namespace {

// A block's map that counts how often it is asked: a measure that no busy machine changes.
struct CountedBlock {
  using Types = Block3::Types;
  using Dart = Block3::Dart;
  struct Lcc {
    Block3::Lcc& map;
    int64_t asked = 0;

    template <unsigned... B>
    Dart beta(Dart d) {
      ++asked;
      return map.beta<B...>(d);
    }
    template <unsigned i>
    auto attribute(Dart d) {
      ++asked;
      return map.attribute<i>(d);
    }
    template <unsigned i, class Handle>
    auto& info_of_attribute(Handle attribute) {
      return map.info_of_attribute<i>(attribute);
    }
    const auto& point(Dart d) { return map.point(d); }
  };
};

// How often the map is asked for the frame of a hexahedron one edge of which is split into 2^depth parts,
// because its neighbour is refined along that edge.
int64_t AskedForFrame(int depth) {
  GridShape grid;
  grid.cells = {2, 1, 1};
  grid.hi = {2, 1, 1};
  SimulatedBlocks blocks(1);
  EXPECT_TRUE(blocks.Build(grid).ok());
  Parameters along;
  along.Set("oracle", "box").Set("lo", "1.0000001,0,-1").Set("hi", "1.0000002,1,0");
  along.Set("depth", int64_t{depth});
  EXPECT_TRUE(blocks.Run("refine", along).ok());
  auto& cells = blocks[0].map().attributes<3>();
  for (auto it = cells.begin(); it != cells.end(); ++it) {
    const auto& info = blocks[0].map().info_of_attribute<3>(it);
    if (info.id != CellId::Initial(0)) continue;
    CountedBlock::Lcc counted{blocks[0].map()};
    Frame<CountedBlock>::Of(counted, info.reference, hexahedron::ReferenceRole(info.id), 0);
    return counted.asked;
  }
  ADD_FAILURE() << "hexahedron 0 is gone";
  return 0;
}

TEST(FrameTest, ADeeplySplitEdgeCostsItsPartsAndNotTheirSquare) {
  const int64_t few = AskedForFrame(4), many = AskedForFrame(8);
  // There really are 16 and 256 parts.
  EXPECT_GT(few, 16);
  EXPECT_GT(many, 256);
  EXPECT_LT(many, 20 * few);
}

}  // namespace
}  // namespace ndmap

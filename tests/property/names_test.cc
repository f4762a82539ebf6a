// SPDX-License-Identifier: GPL-3.0-or-later
// Ids of cells of every dimension, on random refined maps in random blocks.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <set>

#include "core/names/cell_names.h"
#include "tests/property/property_case.h"

namespace ndmap {
namespace {

using reference::MakeRandomCase;
using reference::RandomCase;
using Types = Block3::Types;
using Lcc = Block3::Lcc;
using Ids = std::array<std::set<CellId>, 4>;

// By dimension, the ids of the cells of each dart.
using NamedDarts = std::map<DartIndex, std::array<CellId, 4>>;

NamedDarts NameDarts(Block3& block, const InitialCells& initial) {
  NamedDarts names;
  CellNames<Block3> cell_names(block.map(), initial);
  auto& cells = block.map().attributes<3>();
  for (auto it = cells.begin(); it != cells.end(); ++it) {
    const size_t darts = cell_names.Look(it);
    for (size_t i = 0; i < darts; ++i) {
      names[IndexOf(block.map(), cell_names.dart(i))] = {cell_names.Name(i, 0), cell_names.Name(i, 1),
                                                         cell_names.Name(i, 2), cell_names.Name(i, 3)};
    }
  }
  return names;
}

Ids IdsOf(const NamedDarts& names) {
  Ids ids;
  for (const auto& [dart, name] : names) {
    for (int i = 0; i < 4; ++i) ids[i].insert(name[i]);
  }
  return ids;
}

absl::StatusOr<std::unique_ptr<SimulatedMap<Block3>>> Make(const RandomCase& c, uint32_t blocks,
                                                           const std::vector<CellId>& refined) {
  auto map = std::make_unique<SimulatedMap<Block3>>(blocks, Routing::kDirect, SimulatorOptions());
  std::vector<uint32_t> block_of = c.block_of;
  for (uint32_t& b : block_of) b %= blocks;
  auto corner = [&c](uint32_t i, uint32_t j, uint32_t k) { return c.Corner(i, j, k); };
  if (absl::Status s = map->BuildGrid(c.grid, corner, block_of); !s.ok()) return s;
  if (absl::Status s = map->RefineList(refined, true); !s.ok()) return s;
  return map;
}

Ids IdsOfBlocks(SimulatedMap<Block3>& map, const InitialCells& initial) {
  Ids all;
  for (auto& block : map.blocks()) {
    Ids own = IdsOf(NameDarts(*block, initial));
    for (int i = 0; i < 4; ++i) all[i].merge(own[i]);
  }
  return all;
}

// Every orbit of <i> has one id, and as many ids as orbits.
template <unsigned i>
void ExpectOneIdPerCell(Block3& global, const NamedDarts& names, const Ids& ids) {
  Lcc& map = global.map();
  size_t cells = 0;
  for (auto it = map.one_dart_per_cell<i>().begin(); it.cont(); ++it) {
    ++cells;
    const CellId id = names.at(IndexOf(map, it))[i];
    EXPECT_EQ(id.dimension(), i);
    for (auto dart = map.darts_of_cell<i>(it).begin(); dart.cont(); ++dart) {
      ASSERT_EQ(names.at(IndexOf(map, dart))[i], id) << id.ToString();
    }
  }
  EXPECT_EQ(ids[i].size(), cells) << "dimension " << i;
}

class NamesTest : public testing::TestWithParam<uint64_t> {};

TEST_P(NamesTest, OneIdPerCellWhateverTheBlocks) {
  const RandomCase c = MakeRandomCase(GetParam());
  SCOPED_TRACE(c.Describe());
  const GridCells initial(c.grid);
  auto map = Make(c, c.blocks, c.refined);
  ASSERT_TRUE(map.ok()) << map.status();
  Block3 global(BlockId{0});
  ASSERT_TRUE(Gather<Types>((*map)->blocks(), global).ok());
  const NamedDarts names = NameDarts(global, initial);
  ASSERT_EQ(names.size(), global.map().number_of_darts());
  const Ids ids = IdsOf(names);
  ExpectOneIdPerCell<0>(global, names, ids);
  ExpectOneIdPerCell<1>(global, names, ids);
  ExpectOneIdPerCell<2>(global, names, ids);
  ExpectOneIdPerCell<3>(global, names, ids);
  // Unique over all dimensions, well formed, readable, and the box gives the id back.
  std::set<CellId> all;
  for (const auto& of_dimension : ids) {
    for (const CellId& id : of_dimension) {
      EXPECT_TRUE(all.insert(id).second) << id.ToString();
      EXPECT_TRUE(id.IsWellFormed()) << id.ToString();
      EXPECT_EQ(NameOf(initial, BoxOf(id)), id) << id.ToString();
      EXPECT_EQ(CellId::Parse(id.ToString()).value(), id);
    }
  }
  // The blocks say the same without asking each other.
  EXPECT_EQ(IdsOfBlocks(**map, initial), ids);
  auto single = Make(c, 1, c.refined);
  ASSERT_TRUE(single.ok()) << single.status();
  EXPECT_EQ(IdsOfBlocks(**single, initial), ids);
}

TEST_P(NamesTest, RefinementElsewhereChangesNoId) {
  const RandomCase c = MakeRandomCase(GetParam());
  SCOPED_TRACE(c.Describe());
  const GridCells initial(c.grid);
  const std::vector<CellId> leaves = c.Leaves();
  const CellId refined = leaves[GetParam() % leaves.size()];
  auto before_map = Make(c, c.blocks, c.refined);
  ASSERT_TRUE(before_map.ok()) << before_map.status();
  const Ids before = IdsOfBlocks(**before_map, initial);
  auto report = (*before_map)
                    ->Run("refine", Parameters()
                                        .Set("oracle", "list")
                                        .Set("cells", refined.ToString())
                                        .Set("depth", int64_t{refined.level() + 1}));
  ASSERT_TRUE(report.ok()) << report.status();
  ASSERT_EQ(report->counts["refined"], 1);
  const Ids after = IdsOfBlocks(**before_map, initial);
  for (int i = 0; i < 4; ++i) {
    for (const CellId& id : before[i]) {
      if (after[i].contains(id)) continue;
      // Only cells of the refined hexahedron may go; vertices never do.
      EXPECT_GT(i, 0) << id.ToString();
      EXPECT_EQ(id.level(), refined.level()) << id.ToString();
    }
  }
  EXPECT_FALSE(after[3].contains(refined));
  EXPECT_EQ(after[3].size(), before[3].size() + 7);
}

INSTANTIATE_TEST_SUITE_P(Seeds, NamesTest, testing::Range<uint64_t>(1, 61));

}  // namespace
}  // namespace ndmap

// SPDX-License-Identifier: GPL-3.0-or-later
// The central property and the ids of cells on random meshes of all kinds of cells.
#include <gtest/gtest.h>

#include <array>
#include <map>
#include <set>

#include "core/names/cell_names.h"
#include "core/navigate/cell_index.h"
#include "tests/property/property_case.h"

namespace ndmap {
namespace {

using reference::MakeMeshCase;
using reference::MeshCase;
using Types = Block3::Types;
using Ids = std::array<std::set<CellId>, 4>;
using NamedDarts = std::map<DartIndex, std::array<CellId, 4>>;

class MeshPropertyTest : public testing::TestWithParam<uint64_t> {};

TEST_P(MeshPropertyTest, TheGlobalMapDependsOnlyOnWhatWasRefined) {
  const PropertyVariant variant = VariantOf(GetParam());
  const MeshCase c = MakeMeshCase(GetParam());
  EXPECT_TRUE(RunMeshCase(c, variant, StorageKind::kFlat).ok())
      << RunMeshCase(c, variant, StorageKind::kFlat);
  EXPECT_TRUE(RunMeshCase(c, variant, StorageKind::kCgal).ok())
      << RunMeshCase(c, variant, StorageKind::kCgal);
}

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
  EXPECT_EQ(names.size(), block.map().number_of_darts());
  return names;
}

void Add(const NamedDarts& names, Ids* ids) {
  for (const auto& [dart, name] : names) {
    for (int i = 0; i < 4; ++i) (*ids)[i].insert(name[i]);
  }
}

absl::StatusOr<std::unique_ptr<SimulatedMap<Block3>>> Make(const MeshCase& c, uint32_t blocks) {
  auto map = std::make_unique<SimulatedMap<Block3>>(blocks, Routing::kDirect, SimulatorOptions());
  std::vector<uint32_t> block_of = c.block_of;
  for (uint32_t& b : block_of) b %= blocks;
  if (absl::Status s = map->LoadMesh(c.mesh, block_of); !s.ok()) return s;
  if (absl::Status s = map->RefineList(c.refined, true); !s.ok()) return s;
  return map;
}

Ids IdsOf(SimulatedMap<Block3>& map) {
  Ids ids;
  for (auto& block : map.blocks()) Add(NameDarts(*block, map.mesh(block->id().value)), &ids);
  return ids;
}

template <unsigned i>
void ExpectOneIdPerCell(Block3& global, const NamedDarts& names, const Ids& ids) {
  auto& map = global.map();
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

class MeshNamesTest : public testing::TestWithParam<uint64_t> {};

TEST_P(MeshNamesTest, OneIdPerCellWhateverTheBlocks) {
  const MeshCase c = MakeMeshCase(GetParam());
  SCOPED_TRACE(c.Describe());
  auto single = Make(c, 1);
  ASSERT_TRUE(single.ok()) << single.status();
  Block3& global = *(*single)->blocks()[0];
  const NamedDarts names = NameDarts(global, (*single)->mesh(0));
  Ids ids;
  Add(names, &ids);
  ExpectOneIdPerCell<0>(global, names, ids);
  ExpectOneIdPerCell<1>(global, names, ids);
  ExpectOneIdPerCell<2>(global, names, ids);
  ExpectOneIdPerCell<3>(global, names, ids);
  std::set<CellId> all;
  for (const auto& of_dimension : ids) {
    for (const CellId& id : of_dimension) {
      EXPECT_TRUE(all.insert(id).second) << id.ToString();
      EXPECT_TRUE(id.IsWellFormed()) << id.ToString();
      EXPECT_EQ(CellId::Parse(id.ToString()).value(), id);
      if (id.is_part()) {
        EXPECT_EQ(NameOf((*single)->mesh(0), BoxOf(id)), id) << id.ToString();
      }
    }
  }
  // The blocks say the same without asking each other.
  auto map = Make(c, c.blocks);
  ASSERT_TRUE(map.ok()) << map.status();
  EXPECT_EQ(IdsOf(**map), ids);
}

TEST_P(MeshNamesTest, EveryBlockFindsItsCellsByTheirIds) {
  const MeshCase c = MakeMeshCase(GetParam());
  SCOPED_TRACE(c.Describe());
  auto map = Make(c, c.blocks);
  ASSERT_TRUE(map.ok()) << map.status();
  for (auto& block : (*map)->blocks()) {
    const MeshCells& mesh = (*map)->mesh(block->id().value);
    CellIndexBuilder builder;
    ASSERT_TRUE(builder.Step(*block, 1 << 20).value());
    const auto index = builder.Build();
    const NamedDarts names = NameDarts(*block, mesh);
    Ids ids;
    Add(names, &ids);
    for (unsigned i = 0; i < 4; ++i) {
      for (const CellId& id : ids[i]) {
        const DartIndex d = FindCell(*block, *index, mesh, id);
        ASSERT_TRUE(d.valid()) << id.ToString();
        EXPECT_EQ(names.at(d)[i], id);
      }
    }
    // Other names of the same cells, and names of nothing.
    for (uint64_t number = 0; number < c.mesh.cells(); ++number) {
      const CellId whole = CellId::Initial(number);
      for (unsigned p = 0; p < CellId::kWholePart; ++p) {
        const CellId alias = CellId::Part(whole.Child(p % 8), p);
        const DartIndex d = FindCell(*block, *index, mesh, alias);
        if (d.valid()) {
          EXPECT_EQ(names.at(d)[alias.dimension()], NameOf(mesh, BoxOf(alias)));
        }
      }
      for (unsigned i = 0; i < 4; ++i) {
        for (uint32_t rank = 0; rank < 14; ++rank) {
          const CellId alias = CellId::Rank(number, i, rank);
          const DartIndex d = FindCell(*block, *index, mesh, alias);
          if (d.valid()) {
            EXPECT_EQ(names.at(d)[i], mesh.Find(alias).id);
          }
        }
      }
    }
  }
}

TEST_P(MeshNamesTest, RefinementElsewhereChangesNoId) {
  const MeshCase c = MakeMeshCase(GetParam());
  SCOPED_TRACE(c.Describe());
  auto map = Make(c, c.blocks);
  ASSERT_TRUE(map.ok()) << map.status();
  const Ids before = IdsOf(**map);
  CellId refined;
  for (const CellId& id : c.Leaves()) {
    const bool hexahedron = c.mesh.kinds[id.initial()] == CellKind::kHexahedron;
    if (hexahedron && (!refined.valid() || id.lo() % 7 == GetParam() % 7)) refined = id;
  }
  if (!refined.valid()) return;
  auto report = (*map)->Run("refine", Parameters()
                                          .Set("oracle", "list")
                                          .Set("cells", refined.ToString())
                                          .Set("depth", int64_t{refined.level() + 1}));
  ASSERT_TRUE(report.ok()) << report.status();
  ASSERT_EQ(report->counts["refined"], 1);
  const Ids after = IdsOf(**map);
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

INSTANTIATE_TEST_SUITE_P(Seeds, MeshPropertyTest, testing::Range<uint64_t>(0, 100));
INSTANTIATE_TEST_SUITE_P(Seeds, MeshNamesTest, testing::Range<uint64_t>(0, 60));

}  // namespace
}  // namespace ndmap

// SPDX-License-Identifier: GPL-3.0-or-later
// The cells of blocks one by one, and where they lie and how large they are, on random meshes of all kinds of
// cells and on random grids, refined and removed from.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>

#include "core/attributes/cell_measure.h"
#include "core/mesh/cell_geometry.h"
#include "core/names/cell_names.h"
#include "core/navigate/cell_scan.h"
#include "tests/property/property_case.h"

namespace ndmap {
namespace {

using reference::MakeMeshCase;
using reference::MakeRandomCase;
using reference::MeshCase;
using reference::RandomCase;
using Map = SimulatedMap<Block3>;
using Ids = std::array<std::set<CellId>, 4>;

std::string ListOf(const std::vector<CellId>& cells) {
  std::string list;
  for (const CellId& id : cells) absl::StrAppend(&list, list.empty() ? "" : " ", id.ToString());
  return list;
}

absl::Status Trim(Map& map, const std::vector<CellId>& removed) {
  if (removed.empty()) return absl::OkStatus();
  return map.Run("trim", Parameters().Set("cells", ListOf(removed))).status();
}

std::unique_ptr<Map> Make(const MeshCase& c, uint32_t blocks) {
  auto map = std::make_unique<Map>(blocks, Routing::kDirect, SimulatorOptions());
  std::vector<uint32_t> block_of = c.block_of;
  for (uint32_t& b : block_of) b %= blocks;
  EXPECT_TRUE(map->LoadMesh(c.mesh, block_of).ok());
  EXPECT_TRUE(map->RefineList(c.refined, true).ok());
  EXPECT_TRUE(Trim(*map, c.removed).ok());
  return map;
}

// What CellScan says against a table of all names.
void ExpectScansAre(Map& map, const std::function<const InitialCells&(uint32_t)>& initial) {
  for (unsigned dimension = 0; dimension < 4; ++dimension) {
    std::set<CellId> expected, found, outer;
    for (auto& block : map.blocks()) {
      const InitialCells& names_of = initial(block->id().value);
      CellNames<Block3> names(block->map(), names_of);
      auto& cells = block->map().attributes<3>();
      for (auto it = cells.begin(); it != cells.end(); ++it) {
        const size_t darts = names.Look(it);
        for (size_t i = 0; i < darts; ++i) expected.insert(names.Name(i, dimension));
      }
      CellScan<Block3> scan(*block, dimension == 3 ? nullptr : &names_of, dimension);
      std::vector<CellScan<Block3>::Named> inner;
      while (!scan.Step(3, inner)) {
      }
      // Those in the inside are of this block alone, and come once.
      for (const auto& [id, dart] : inner) {
        EXPECT_TRUE(found.insert(id).second) << id.ToString();
        EXPECT_FALSE(outer.contains(id)) << id.ToString();
      }
      const auto at_faces = scan.TakeOuter();
      EXPECT_TRUE(std::is_sorted(at_faces.begin(), at_faces.end()));
      for (const auto& [id, dart] : at_faces) {
        EXPECT_FALSE(found.contains(id)) << id.ToString();
        outer.insert(id);
      }
      EXPECT_TRUE(dimension < 3 || at_faces.empty());
    }
    found.merge(outer);
    EXPECT_EQ(found, expected) << "dimension " << dimension;
  }
}

class CellsTest : public testing::TestWithParam<uint64_t> {};

TEST_P(CellsTest, AScanFindsEachCellOfAMeshOnce) {
  const MeshCase c = MakeMeshCase(GetParam());
  SCOPED_TRACE(c.Describe());
  auto map = Make(c, c.blocks);
  ExpectScansAre(*map, [&](uint32_t b) -> const InitialCells& { return map->mesh(b); });
}

TEST_P(CellsTest, AScanFindsEachCellOfAGridOnce) {
  const RandomCase c = MakeRandomCase(GetParam());
  SCOPED_TRACE(c.Describe());
  Map map(c.blocks, Routing::kBroadcast, SimulatorOptions());
  const auto corner = [&c](uint32_t i, uint32_t j, uint32_t k) { return c.Corner(i, j, k); };
  ASSERT_TRUE(map.BuildGrid(c.grid, corner, c.block_of).ok());
  ASSERT_TRUE(map.RefineList(c.refined, true).ok());
  ASSERT_TRUE(Trim(map, c.removed).ok());
  const GridCells grid(c.grid);
  ExpectScansAre(map, [&](uint32_t) -> const InitialCells& { return grid; });
}

// Centres of cells of all dimensions, and volumes, by id.
struct Measures {
  std::array<std::map<CellId, Point3>, 4> centres;
  std::map<CellId, double> volumes;
};
Measures MeasuresOf(Map& map) {
  Measures measures;
  for (auto& block : map.blocks()) {
    auto& lcc = block->map();
    CellNames<Block3> names(lcc, map.mesh(block->id().value));
    CellMeasure<Block3> measure(lcc);
    auto& cells = lcc.attributes<3>();
    for (auto it = cells.begin(); it != cells.end(); ++it) {
      measures.volumes[lcc.info_of_attribute<3>(it).id] = measure.VolumeOf(it);
      const size_t darts = names.Look(it);
      for (size_t i = 0; i < darts; ++i) {
        for (unsigned k = 0; k < 4; ++k) {
          // The same bits from every dart, of every block.
          const Point3 centre = measure.CentreOf(names.dart(i), k);
          const auto [at, made] = measures.centres[k].try_emplace(names.Name(i, k), centre);
          EXPECT_EQ(at->second, centre) << at->first.ToString();
        }
      }
    }
  }
  return measures;
}

Point3 MeanOfCorners(const VolumeMesh& mesh, absl::Span<const uint32_t> corners) {
  CornerPoints points;
  for (uint32_t c : corners) points.push_back(mesh.points[c]);
  return MeanOf(points);
}

TEST_P(CellsTest, CentresAndVolumesAreThoseOfTheMeshWhateverTheBlocks) {
  const MeshCase c = MakeMeshCase(GetParam());
  SCOPED_TRACE(c.Describe());
  auto map = Make(c, c.blocks);
  const Measures measures = MeasuresOf(*map);
  auto single = Make(c, 1);
  const Measures whole = MeasuresOf(*single);
  EXPECT_EQ(measures.volumes, whole.volumes);
  EXPECT_EQ(measures.centres, whole.centres);
  // Of cells that were not split the mesh itself tells both, also where a neighbour was.
  std::map<uint64_t, double> parts;
  for (const auto& [id, volume] : measures.volumes) parts[id.initial()] += volume;
  for (const auto& [initial, sum] : parts) {
    const CellCorners corners(c.mesh, initial);
    const double volume = CellVolume(c.mesh.kinds[initial], corners);
    const CellId id = CellId::Initial(initial);
    if (measures.volumes.contains(id)) {
      EXPECT_EQ(measures.centres[3].at(id), MeanOfCorners(c.mesh, c.mesh.Corners(initial)));
    }
    if (c.mesh.kinds[initial] != CellKind::kHexahedron) {
      EXPECT_EQ(sum, volume) << id.ToString();
    }
    const bool removed = std::any_of(c.removed.begin(), c.removed.end(),
                                     [&](const CellId& r) { return r.initial() == initial; });
    if (!removed) {
      EXPECT_NEAR(sum, volume, 1e-12 * (1 + std::abs(volume))) << id.ToString();
    }
  }
}

// Of each triangle the centre is that of its three corners, though vertices may hang on its edges.
TEST_P(CellsTest, WhatHangsOnATriangleIsNoCorner) {
  const MeshCase c = MakeMeshCase(GetParam());
  SCOPED_TRACE(c.Describe());
  auto map = Make(c, c.blocks);
  for (auto& block : map->blocks()) {
    auto& lcc = block->map();
    PolyhedronLattice<Block3> lattice(lcc);
    CellMeasure<Block3> measure(lcc);
    auto& cells = lcc.attributes<3>();
    for (auto it = cells.begin(); it != cells.end(); ++it) {
      const auto& info = lcc.info_of_attribute<3>(it);
      const CellShape& shape = ShapeOf(info.kind);
      if (info.kind == CellKind::kHexahedron) continue;
      const auto corners = c.mesh.Corners(info.id.initial());
      for (const auto& placed : lattice.Of(it)) {
        if (shape.face_corners[placed.side] != 3) continue;
        std::vector<uint32_t> triangle;
        for (int k = 0; k < 3; ++k) triangle.push_back(corners[shape.face[placed.side][k]]);
        EXPECT_EQ(measure.FaceCorners(placed.dart).size(), 3u);
        EXPECT_EQ(measure.CentreOf(placed.dart, 2), MeanOfCorners(c.mesh, triangle)) << info.id.ToString();
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, CellsTest, testing::Range<uint64_t>(0, 60));

}  // namespace
}  // namespace ndmap

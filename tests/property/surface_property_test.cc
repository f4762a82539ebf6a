// SPDX-License-Identifier: GPL-3.0-or-later
// The central property and the ids of cells on random surfaces of polygons: maps of dimension 2, loaded in
// pieces, against one plain CGAL map, with both storages.
#include <gtest/gtest.h>
#include <xxhash.h>

#include <array>
#include <map>
#include <set>

#include "absl/strings/str_join.h"
#include "core/algorithm/load/mesh_assignment.h"
#include "core/names/cell_names.h"
#include "core/navigate/cell_index.h"
#include "tests/property/property_case.h"
#include "tests/reference/compare.h"
#include "tests/reference/surface_case.h"

namespace ndmap {
namespace {

using reference::MakeSurfaceCase;
using reference::SurfaceCase;
using reference::SurfaceLcc;
// By dimension.
using Ids = std::array<std::set<CellId>, 3>;

// The canonical hash, computed from its definition.
Digest HashOf(const SurfaceLcc& map) {
  using Dart = SurfaceLcc::Dart_const_handle;
  const auto put = [&map](std::string& tuple, Dart d) {
    const uint64_t words[2] = {map.info<2>(d).lo(), map.info<2>(d).hi()};
    tuple.append(reinterpret_cast<const char*>(words), sizeof(words));
    for (Dart end : {d, Dart(map.beta<1>(d))}) {
      const double point[3] = {map.point(end).x(), map.point(end).y(), map.point(end).z()};
      tuple.append(reinterpret_cast<const char*>(point), sizeof(point));
    }
  };
  Digest sum;
  for (auto it = map.darts().begin(); it != map.darts().end(); ++it) {
    std::string tuple;
    put(tuple, it);
    put(tuple, map.beta<1>(it));
    if (map.is_free<2>(it)) {
      tuple.append(64, '\0');
    } else {
      put(tuple, map.beta<2>(it));
    }
    const XXH128_hash_t hash = XXH3_128bits(tuple.data(), tuple.size());
    sum.Add({hash.high64, hash.low64});
  }
  return sum;
}

template <unsigned i>
int64_t CellCount(SurfaceLcc& map) {
  int64_t count = 0;
  // CGAL's iterator looks at the first dart.
  if (map.is_empty()) return count;
  for (auto it = map.one_dart_per_cell<i>().begin(); it.cont(); ++it) ++count;
  return count;
}

template <class Types>
void ExpectSame(SimulatedMap<Block<Types>>& map, SurfaceLcc& expected) {
  Block<Types> global(BlockId{0});
  ASSERT_TRUE(Gather<Types>(map.blocks(), global).ok());
  ASSERT_TRUE(global.map().is_valid());
  const auto name = [&](typename Types::Lcc::Dart_const_handle d) {
    return global.map().template info<2>(d).id;
  };
  const auto expected_name = [&](SurfaceLcc::Dart_const_handle d) { return expected.info<2>(d); };
  const absl::Status same = reference::CompareMaps(expected, global.map(), expected_name, name);
  ASSERT_TRUE(same.ok()) << same;

  auto count = map.Run("count", {});
  ASSERT_TRUE(count.ok()) << count.status();
  EXPECT_EQ(count->counts["vertices"], static_cast<int64_t>(expected.number_of_attributes<0>()));
  EXPECT_EQ(count->counts["edges"], CellCount<1>(expected));
  EXPECT_EQ(count->counts["faces"], CellCount<2>(expected));
  EXPECT_EQ(count->counts["faces"],
            count->counts["triangles"] + count->counts["quadrilaterals"] + count->counts["polygons"]);
  EXPECT_EQ(count->counts["darts"], static_cast<int64_t>(expected.number_of_darts()));
  int64_t free = 0;
  for (auto it = expected.darts().begin(); it != expected.darts().end(); ++it)
    free += expected.is_free<2>(it);
  EXPECT_EQ(count->counts["boundary_edges"], free);
  auto hash = map.Run("hash", {});
  ASSERT_TRUE(hash.ok()) << hash.status();
  EXPECT_EQ(hash->digest, HashOf(expected));
  auto check = map.Run("check", {});
  ASSERT_TRUE(check.ok()) << check.status();
  EXPECT_EQ(check->counts["findings"], 0) << absl::StrJoin(check->findings, "; ");
}

template <class Types>
void RunCase(const SurfaceCase& c) {
  SCOPED_TRACE(c.Describe());
  const PropertyVariant variant = VariantOf(c.seed);
  const auto expected = reference::MakeSurfaceMap(c.mesh);
  SimulatedMap<Block<Types>> map(c.blocks, variant.routing, variant.simulator);
  const absl::Status loaded = map.LoadMesh(c.mesh, c.block_of);
  ASSERT_TRUE(loaded.ok()) << loaded;
  ExpectSame<Types>(map, *expected);
  if (c.removed.empty() || testing::Test::HasFailure()) return;
  for (const CellId& id : c.removed) reference::RemoveFace(*expected, id);
  auto trim = map.Run("trim", Parameters().Set("cells", TextOf(c.removed)));
  ASSERT_TRUE(trim.ok()) << trim.status();
  EXPECT_EQ(trim->counts["removed"], static_cast<int64_t>(c.removed.size()));
  EXPECT_EQ(trim->counts["faces"], static_cast<int64_t>(c.mesh.faces() - c.removed.size()));
  ExpectSame<Types>(map, *expected);
}

class SurfacePropertyTest : public testing::TestWithParam<uint64_t> {};

TEST_P(SurfacePropertyTest, TheGlobalMapIsTheSurfaceWhateverTheCut) {
  const SurfaceCase c = MakeSurfaceCase(GetParam());
  RunCase<MapTypes<2, StorageKind::kFlat>>(c);
  RunCase<MapTypes<2, StorageKind::kCgal>>(c);
}

// The ids as they are defined: an edge or vertex is named by the lowest face that has it, and its rank there.
class ExpectedIds {
 public:
  explicit ExpectedIds(const PolygonMesh& mesh) : mesh_(mesh) {
    for (uint64_t f = 0; f < mesh.faces(); ++f) {
      for (uint32_t i = 0; i < mesh.Corners(f).size(); ++i) {
        of_point_.try_emplace(mesh.Corners(f)[i], CellId::Rank(f, 0, i));
        of_edge_.try_emplace(Edge(f, i), CellId::Rank(f, 1, i));
      }
    }
  }
  std::array<CellId, 3> Of(uint64_t face, uint32_t corner) const {
    return {of_point_.at(mesh_.Corners(face)[corner]), of_edge_.at(Edge(face, corner)),
            CellId::Polygon(face)};
  }

 private:
  std::pair<uint32_t, uint32_t> Edge(uint64_t face, uint32_t side) const {
    const auto corners = mesh_.Corners(face);
    return std::minmax(corners[side], corners[(side + 1) % corners.size()]);
  }

  const PolygonMesh& mesh_;
  std::map<uint32_t, CellId> of_point_;
  std::map<std::pair<uint32_t, uint32_t>, CellId> of_edge_;
};

TEST_P(SurfacePropertyTest, EveryBlockKnowsTheIdsOfItsCellsAndFindsThem) {
  const SurfaceCase c = MakeSurfaceCase(GetParam());
  SCOPED_TRACE(c.Describe());
  const ExpectedIds expected(c.mesh);
  SimulatedMap<Block2> map(c.blocks, Routing::kDirect, SimulatorOptions{GetParam()});
  ASSERT_TRUE(map.LoadMesh(c.mesh, c.block_of).ok());
  ASSERT_TRUE(map.Run("trim", Parameters().Set("cells", TextOf(c.removed))).ok());
  Ids all;
  for (auto& block : map.blocks()) {
    auto& lcc = block->map();
    const PolygonCells& surface = map.polygons(block->id().value);
    CellIndexBuilder builder;
    ASSERT_TRUE(builder.Step(*block, 1 << 20).value());
    const auto index = builder.Build();
    CellNames<Block2> names(lcc, surface);
    std::map<DartIndex, std::array<CellId, 3>> of_dart;
    auto& cells = lcc.attributes<2>();
    for (auto it = cells.begin(); it != cells.end(); ++it) {
      const uint64_t face = lcc.info_of_attribute<2>(it).id.initial();
      ASSERT_EQ(names.Look(it), c.mesh.Corners(face).size());
      for (uint32_t i = 0; i < c.mesh.Corners(face).size(); ++i) {
        const std::array<CellId, 3> is = {names.Name(i, 0), names.Name(i, 1), names.Name(i, 2)};
        ASSERT_EQ(is, expected.Of(face, i));
        ASSERT_EQ(surface.VertexNumber(surface.FaceOf(face), i),
                  c.mesh.begins[is[0].initial()] + is[0].rank());
        of_dart[IndexOf(lcc, names.dart(i))] = is;
        for (int k = 0; k < 3; ++k) all[k].insert(is[k]);
      }
    }
    ASSERT_EQ(of_dart.size(), lcc.number_of_darts());
    for (const auto& [dart, ids] : of_dart) {
      for (unsigned k = 0; k < 3; ++k) {
        const DartIndex found = FindCell(*block, *index, surface, ids[k]);
        ASSERT_TRUE(found.valid()) << ids[k].ToString();
        EXPECT_EQ(of_dart.at(found)[k], ids[k]);
      }
    }
    // Other names of what is here, and names of nothing.
    for (uint64_t face = 0; face < c.mesh.faces(); ++face) {
      for (unsigned k = 0; k < 2; ++k) {
        for (uint32_t i = 0; i <= c.mesh.Corners(face).size(); ++i) {
          const DartIndex found = FindCell(*block, *index, surface, CellId::Rank(face, k, i));
          if (!found.valid()) continue;
          ASSERT_LT(i, c.mesh.Corners(face).size());
          EXPECT_EQ(of_dart.at(found)[k], expected.Of(face, i)[k]);
        }
      }
    }
  }
  std::set<CellId> once;
  for (const auto& of_dimension : all) {
    for (const CellId& id : of_dimension) EXPECT_TRUE(once.insert(id).second) << id.ToString();
  }
  // What is counted of attributes is each cell once.
  std::vector<AttributeDefinition> definitions;
  for (unsigned k = 0; k < 3; ++k) {
    definitions.push_back(
        {absl::StrCat("a", k), k, ValueType::kInt64, SplitRule::kZero, {}, "", uint64_t{k} + 1});
  }
  auto report = map.Run("attributes", Parameters().Set("definitions", EncodeDefinitions(definitions)));
  ASSERT_TRUE(report.ok()) << report.status();
  for (unsigned k = 0; k < 3; ++k) {
    EXPECT_EQ(report->counts[absl::StrCat("values_", k)], static_cast<int64_t>(all[k].size())) << k;
  }
}

TEST_P(SurfacePropertyTest, EveryPartitionCutsIt) {
  const SurfaceCase c = MakeSurfaceCase(GetParam());
  SCOPED_TRACE(c.Describe());
  const auto glued = GluePolygons(c.mesh);
  ASSERT_TRUE(glued.ok()) << glued.status();
  const Digest expected = HashOf(*reference::MakeSurfaceMap(c.mesh));
  for (const char* partition : {"metis", "hilbert", "morton"}) {
    const auto block_of = AssignMesh(*glued, c.blocks, partition);
    ASSERT_TRUE(block_of.ok()) << block_of.status();
    std::vector<int> faces_of(c.blocks, 0);
    for (uint32_t b : *block_of) ++faces_of.at(b);
    for (int faces : faces_of) EXPECT_GT(faces, 0) << partition;
    SimulatedMap<Block2> map(c.blocks, Routing::kBroadcast, SimulatorOptions{GetParam()});
    ASSERT_TRUE(map.LoadMesh(glued->mesh, *block_of).ok());
    auto hash = map.Run("hash", {});
    ASSERT_TRUE(hash.ok()) << hash.status();
    EXPECT_EQ(hash->digest, expected) << partition;
  }
  EXPECT_FALSE(AssignMesh(*glued, static_cast<uint32_t>(c.mesh.faces()) + 1, "metis").ok());
  EXPECT_FALSE(AssignMesh(*glued, 1, "slabs").ok());
}

TEST(SurfaceAlgorithmsTest, WhatIsOfVolumesIsRefusedWithASentence) {
  SimulatedMap<Block2> map(1, Routing::kDirect, {});
  const SurfaceCase c = MakeSurfaceCase(2);
  ASSERT_TRUE(map.LoadMesh(c.mesh, std::vector<uint32_t>(c.mesh.faces(), 0)).ok());
  for (const char* algorithm : {"build", "refine", "classify"}) {
    EXPECT_EQ(map.Run(algorithm, Parameters().Set("depth", int64_t{1})).status(),
              absl::FailedPreconditionError(
                  absl::StrCat(algorithm, " works on maps of dimension 3, and this one has dimension 2")));
  }
  EXPECT_EQ(map.Run("trim", {}).status(),
            absl::FailedPreconditionError("faces of a surface are not inside, cut or outside: parameter "
                                          "'cells' must list those to erase"));
  EXPECT_EQ(
      map.Run("trim", Parameters().Set("cells", "h0")).status(),
      absl::InvalidArgumentError("parameter 'cells' has h0, which no cell of a map of dimension 2 is named"));
  const AttributeDefinition volumes{"a", 3, ValueType::kInt64, SplitRule::kZero, {}, "", 1};
  EXPECT_EQ(
      map.Run("attributes", Parameters().Set("definitions", EncodeDefinitions({volumes}))).status(),
      absl::InvalidArgumentError("attribute \"a\" is of cells of dimension 3, and the map has dimension 2"));
  SimulatedMap<Block2> empty(1, Routing::kDirect, {});
  EXPECT_EQ(empty.Run("load", {}).status(),
            absl::FailedPreconditionError("block 0 has no piece of a surface to make its faces from"));
}

class Bin final : public Outbox {
 public:
  void Send(BlockId, const Message&) override {}
  void Broadcast(const Message&) override {}
};

TEST(SurfaceAlgorithmsTest, ACallIsShortAndACancelledLoadLeavesNothing) {
  const SurfaceCase c = MakeSurfaceCase(4);
  const auto glued = PolygonCells::Make(
      PolygonCutter(c.mesh, std::vector<uint32_t>(c.mesh.faces(), 0), 1).Piece(BlockId{0}), BlockId{0}, 1);
  ASSERT_TRUE(glued.ok()) << glued.status();
  Environment environment{BlockId{0}, 1, Routing::kDirect, nullptr, nullptr};
  environment.initial = *glued;
  Block2 block(BlockId{0});
  Bin bin;
  auto load = MakeAlgorithm("load", {}, environment, block);
  ASSERT_TRUE(load.ok()) << load.status();
  ASSERT_TRUE((*load)->Start(1).value());
  for (int i = 0; i < 50; ++i) EXPECT_EQ((*load)->Work(1, bin).value(), 1u);
  EXPECT_GT(block.map().number_of_darts(), 0u);
  (*load)->Cancel();
  EXPECT_FALSE((*load)->HasWork());
  EXPECT_EQ(block.map().number_of_darts(), 0u);
  EXPECT_EQ((*load)->report().counts["cancelled"], 1);
  EXPECT_EQ((*load)->report().counts["faces"], 0);
  // And again, to its end.
  load = MakeAlgorithm("load", {}, environment, block);
  ASSERT_TRUE((*load)->Start(1).value());
  while ((*load)->HasWork()) ASSERT_LE((*load)->Work(3, bin).value(), 3u);
  EXPECT_EQ((*load)->report().counts["faces"], static_cast<int64_t>(c.mesh.faces()));
  EXPECT_TRUE(block.map().is_valid());
}

// Wherever a trim is cancelled, the vertices are those of the faces that are left.
TEST(SurfaceAlgorithmsTest, ACancelledTrimLeavesAValidMap) {
  int split = 0;
  for (uint64_t seed = 0; seed < 40; ++seed) {
    const SurfaceCase c = MakeSurfaceCase(seed);
    for (size_t steps = 1; steps < c.removed.size(); steps += 1 + c.removed.size() / 8) {
      SimulatedMap<Block2> map(1, Routing::kDirect, {});
      ASSERT_TRUE(map.LoadMesh(c.mesh, std::vector<uint32_t>(c.mesh.faces(), 0)).ok());
      Block2& block = *map.blocks()[0];
      const auto vertices = block.map().number_of_attributes<0>();
      const Environment environment{BlockId{0}, 1, Routing::kDirect, nullptr, nullptr};
      auto trim = MakeAlgorithm("trim", Parameters().Set("cells", TextOf(c.removed)), environment, block);
      ASSERT_TRUE(trim.ok()) << trim.status();
      while (!(*trim)->Start(10).value()) {
      }
      Bin bin;
      ASSERT_EQ((*trim)->Work(steps, bin).value(), steps);
      (*trim)->Cancel();
      while ((*trim)->HasWork()) ASSERT_EQ((*trim)->Work(1, bin).value(), 1u);
      EXPECT_EQ((*trim)->report().counts["removed"], static_cast<int64_t>(steps));
      EXPECT_TRUE(block.map().is_valid()) << c.Describe() << " after " << steps;
      EXPECT_EQ(map.Run("check", {})->counts["findings"], 0) << c.Describe() << " after " << steps;
      split += block.map().number_of_attributes<0>() > vertices;
    }
  }
  EXPECT_GT(split, 0);
}

INSTANTIATE_TEST_SUITE_P(Seeds, SurfacePropertyTest, testing::Range<uint64_t>(0, 100));

}  // namespace
}  // namespace ndmap

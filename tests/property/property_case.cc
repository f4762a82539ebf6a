// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/property/property_case.h"

#include <xxhash.h>

#include <array>
#include <map>
#include <random>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "core/algorithm/refine/hexahedron.h"
#include "tests/reference/compare.h"
#include "tests/reference/reference_map.h"

namespace ndmap {
namespace {

using reference::RandomCase;
using reference::ReferenceMap;

// The canonical hash of the reference, computed from its definition.
Digest HashOf(const reference::ReferenceLcc& lcc) {
  using Dart = reference::ReferenceLcc::Dart_const_handle;
  auto put = [&lcc](std::string& tuple, Dart d) {
    const CellId id = reference::NameOf(lcc, d);
    const uint64_t words[2] = {id.lo(), id.hi()};
    tuple.append(reinterpret_cast<const char*>(words), sizeof(words));
    for (Dart end : {d, Dart(lcc.beta<1>(d))}) {
      const double point[3] = {lcc.point(end).x(), lcc.point(end).y(), lcc.point(end).z()};
      tuple.append(reinterpret_cast<const char*>(point), sizeof(point));
    }
  };
  Digest sum;
  for (auto it = lcc.darts().begin(); it != lcc.darts().end(); ++it) {
    std::string tuple;
    put(tuple, it);
    for (int i = 1; i <= 3; ++i) {
      if (lcc.is_free(it, static_cast<unsigned>(i))) {
        tuple.append(64, '\0');
      } else {
        put(tuple, lcc.beta(it, i));
      }
    }
    const XXH128_hash_t hash = XXH3_128bits(tuple.data(), tuple.size());
    sum.Add({hash.high64, hash.low64});
  }
  return sum;
}

template <class Types>
absl::Status CompareWithReference(SimulatedMap<Block<Types>>& map, const ReferenceMap& reference) {
  Block<Types> global(BlockId{0});
  if (absl::Status s = Gather<Types>(map.blocks(), global); !s.ok()) return s;
  if (!global.map().is_valid()) return absl::InternalError("the gathered map is not valid");
  const auto name = [&](typename Types::Lcc::Dart_const_handle d) {
    return global.map().template info_of_attribute<3>(global.map().template attribute<3>(d)).id;
  };
  const auto reference_name = [&](reference::ReferenceLcc::Dart_const_handle d) {
    return reference::NameOf(reference.lcc(), d);
  };
  if (absl::Status s = reference::CompareMaps(reference.lcc(), global.map(), reference_name, name); !s.ok()) {
    return s;
  }
  // What the blocks say together is what one map says.
  auto count = map.Run("count", {});
  if (!count.ok()) return count.status();
  const auto vertices = static_cast<int64_t>(reference.lcc().template number_of_attributes<0>());
  if (count->counts["vertices"] != vertices) {
    return absl::InternalError(
        absl::StrCat(count->counts["vertices"], " vertices counted, expected ", vertices));
  }
  auto hash = map.Run("hash", {});
  if (!hash.ok()) return hash.status();
  const Digest expected = HashOf(reference.lcc());
  if (hash->digest != expected) {
    return absl::InternalError(
        absl::StrCat("hash ", hash->digest.ToString(), ", expected ", expected.ToString()));
  }
  auto check = map.Run("check", {});
  if (!check.ok()) return check.status();
  if (check->counts["findings"] != 0) {
    return absl::InternalError(absl::StrCat("check: ", absl::StrJoin(check->findings, "; ")));
  }
  return absl::OkStatus();
}

template <class Types>
absl::Status TrimListed(SimulatedMap<Block<Types>>& map, const std::vector<CellId>& removed) {
  auto report = map.Run("trim", Parameters().Set("cells", TextOf(removed)));
  if (!report.ok()) return report.status();
  if (report->counts["removed"] != static_cast<int64_t>(removed.size())) {
    return absl::InternalError(
        absl::StrCat(report->counts["removed"], " removed, expected ", removed.size()));
  }
  return absl::OkStatus();
}

// Refines, compares, removes and compares again a map that was just made.
template <class Types, class Case>
absl::Status ChangeAndCompare(const Case& c, bool by_level, ReferenceMap& reference,
                              SimulatedMap<Block<Types>>& map) {
  for (const CellId& id : c.refined) {
    if (absl::Status s = reference.Refine(id); !s.ok()) return s;
  }
  absl::Status status = map.RefineList(c.refined, by_level);
  if (!status.ok()) return status;
  if (status = CompareWithReference<Types>(map, reference); !status.ok()) return status;
  if (c.removed.empty()) return absl::OkStatus();
  for (const CellId& id : c.removed) {
    if (absl::Status s = reference.Remove(id); !s.ok()) return s;
  }
  if (status = TrimListed<Types>(map, c.removed); !status.ok()) return status;
  status = CompareWithReference<Types>(map, reference);
  return status.ok() ? status
                     : absl::Status(status.code(), absl::StrCat("after removal: ", status.message()));
}

template <class Types>
absl::Status RunCase(const RandomCase& random_case, const PropertyVariant& variant) {
  const auto corner = [&](uint32_t i, uint32_t j, uint32_t k) { return random_case.Corner(i, j, k); };
  ReferenceMap reference =
      ReferenceMap::Build(random_case.grid[0], random_case.grid[1], random_case.grid[2], corner);
  SimulatedMap<Block<Types>> map(random_case.blocks, variant.routing, variant.simulator);
  absl::Status status = map.BuildGrid(random_case.grid, corner, random_case.block_of);
  return status.ok() ? ChangeAndCompare<Types>(random_case, variant.by_level, reference, map) : status;
}

template <class Types>
absl::Status RunMesh(const reference::MeshCase& c, const PropertyVariant& variant) {
  ReferenceMap reference = ReferenceMap::BuildMesh(c.mesh);
  SimulatedMap<Block<Types>> map(c.blocks, variant.routing, variant.simulator);
  absl::Status status = map.LoadMesh(c.mesh, c.block_of);
  if (!status.ok()) return status;
  if (status = CompareWithReference<Types>(map, reference); !status.ok()) return status;
  return ChangeAndCompare<Types>(c, variant.by_level, reference, map);
}

// Hexahedra around one edge, face x = 0 of each glued to face y = 0 of the next: what grids do not have. From
// five on, a block can be so far from the one that splits the edge that only a relayed SplitEdge reaches it.
template <class Types>
void MakeFan(typename Types::Lcc& map, uint32_t hexahedra) {
  using Dart = typename Types::Dart;
  std::vector<std::array<Dart, hexahedron::kRoles>> darts(hexahedra);
  for (uint32_t h = 0; h < hexahedra; ++h) {
    const auto cell = map.template create_attribute<3>();
    for (Dart& d : darts[h]) {
      d = map.create_dart();
      map.template set_dart_attribute<3>(d, cell);
    }
    for (unsigned role = 0; role < hexahedron::kRoles; ++role) {
      map.basic_link_beta_1(darts[h][role], darts[h][hexahedron::NextRole(role)]);
      map.template basic_link_beta_for_involution<2>(darts[h][role], darts[h][hexahedron::kAcross[role]]);
    }
    auto& info = map.template info_of_attribute<3>(cell);
    info.id = CellId::Initial(h);
    info.reference = darts[h][hexahedron::ReferenceRole(info.id)];
  }
  // Where the corners of face x = 0 are in face y = 0 of the next hexahedron.
  const std::map<unsigned, unsigned> next_corner = {{0, 0}, {2, 1}, {6, 5}, {4, 4}};
  for (uint32_t h = 0; h < hexahedra; ++h) {
    for (unsigned k = 0; k < 4; ++k) {
      const unsigned role = hexahedron::Role(4, k);
      for (unsigned other = hexahedron::Role(2, 0); other < hexahedron::Role(3, 0); ++other) {
        if (hexahedron::StartCorner(other) == next_corner.at(hexahedron::EndCorner(role)) &&
            hexahedron::EndCorner(other) == next_corner.at(hexahedron::StartCorner(role))) {
          map.template basic_link_beta_for_involution<3>(darts[h][role], darts[(h + 1) % hexahedra][other]);
        }
      }
    }
  }
  double next = 0;
  for (const auto& hex : darts) {
    for (Dart d : hex) {
      if (map.template attribute<0>(d) != Types::Lcc::null_handle) continue;
      next += 1;
      map.template set_attribute<0>(
          d, map.template create_attribute<0>(typename Types::Point(next, next * next / 7, 1 / next)));
    }
  }
}

// The same hexahedra refined in one block, and each in a block of its own: one hash.
template <class Types>
absl::Status RunFanCase(uint64_t seed, const PropertyVariant& variant) {
  std::mt19937_64 random(seed + 17);
  const auto hexahedra = static_cast<uint32_t>(3 + random() % 6);
  std::vector<CellId> refined;
  for (uint32_t h = 0; h < hexahedra; ++h) {
    if (random() % 4 != 0) continue;
    refined.push_back(CellId::Initial(h));
    if (random() % 2 == 0) refined.push_back(refined.back().Child(static_cast<unsigned>(random() % 8)));
  }
  if (refined.empty()) refined.push_back(CellId::Initial(0));
  SimulatedMap<Block<Types>> one(1, Routing::kDirect, {});
  MakeFan<Types>(one.blocks()[0]->map(), hexahedra);
  SimulatedMap<Block<Types>> cut(hexahedra, variant.routing, variant.simulator);
  auto& whole = one.blocks()[0]->map();
  auto blocks = CutMap<Types>(
      whole, hexahedra,
      [&](typename Types::Dart d) {
        const CellId id = whole.template info_of_attribute<3>(whole.template attribute<3>(d)).id;
        return BlockId{static_cast<uint32_t>(id.initial())};
      },
      variant.routing == Routing::kDirect);
  if (!blocks.ok()) return blocks.status();
  cut.blocks() = *std::move(blocks);
  std::array<Digest, 2> digests;
  for (int i = 0; i < 2; ++i) {
    auto& map = i == 0 ? one : cut;
    if (absl::Status s = map.RefineList(refined, variant.by_level); !s.ok()) return s;
    auto check = map.Run("check", {});
    if (!check.ok()) return check.status();
    if (check->counts["findings"] != 0) return absl::InternalError(absl::StrJoin(check->findings, "; "));
    auto hash = map.Run("hash", {});
    if (!hash.ok()) return hash.status();
    digests[i] = hash->digest;
  }
  if (digests[0] == digests[1]) return absl::OkStatus();
  return absl::InternalError(absl::StrCat(hexahedra, " hexahedra around an edge: hash ",
                                          digests[1].ToString(), ", expected ", digests[0].ToString()));
}

}  // namespace

std::string TextOf(const std::vector<CellId>& ids) {
  return absl::StrJoin(ids, " ",
                       [](std::string* out, const CellId& id) { absl::StrAppend(out, id.ToString()); });
}

template <class BlockT>
absl::Status SimulatedMap<BlockT>::RefineList(const std::vector<CellId>& refined, bool by_level) {
  int depth = 0;
  for (const CellId& id : refined) depth = std::max(depth, id.level() + 1);
  Parameters parameters;
  parameters.Set("oracle", "list").Set("depth", int64_t{depth});
  parameters.Set("cells", TextOf(refined));
  for (int level = by_level ? 0 : depth - 1; level < depth; ++level) {
    if (by_level) parameters.Set("level", int64_t{level});
    auto report = Run("refine", parameters);
    if (!report.ok()) return report.status();
    refined_.Merge(*report);
  }
  const int64_t total = refined_.counts["refined"];
  if (total != static_cast<int64_t>(refined.size())) {
    return absl::InternalError(absl::StrCat(total, " hexahedra refined, expected ", refined.size()));
  }
  return absl::OkStatus();
}
template class SimulatedMap<Block3>;
template class SimulatedMap<Block3OnCgalStorage>;

PropertyVariant VariantOf(uint64_t seed) {
  PropertyVariant variant;
  std::mt19937_64 random(seed * 2 + 1);
  variant.routing = random() % 2 == 0 ? Routing::kDirect : Routing::kBroadcast;
  variant.by_level = random() % 3 == 0;
  variant.simulator.seed = seed;
  variant.simulator.ordered_channels = random() % 5 == 0;
  variant.simulator.duplicates_per_mille = static_cast<int>(random() % 300);
  variant.simulator.largest_slice = 1 + static_cast<int>(random() % 32);
  return variant;
}

absl::Status RunPropertyCase(const RandomCase& random_case, const PropertyVariant& variant,
                             StorageKind storage) {
  const absl::Status status = storage == StorageKind::kFlat
                                  ? RunCase<MapTypes<3, StorageKind::kFlat>>(random_case, variant)
                                  : RunCase<MapTypes<3, StorageKind::kCgal>>(random_case, variant);
  if (status.ok()) return status;
  return absl::Status(status.code(), absl::StrCat(random_case.Describe(), ": ", status.message(),
                                                  " (replay: ndmap_property --seed ", random_case.seed, ")"));
}

absl::Status RunMeshCase(const reference::MeshCase& mesh_case, const PropertyVariant& variant,
                         StorageKind storage) {
  const absl::Status status = storage == StorageKind::kFlat
                                  ? RunMesh<MapTypes<3, StorageKind::kFlat>>(mesh_case, variant)
                                  : RunMesh<MapTypes<3, StorageKind::kCgal>>(mesh_case, variant);
  if (status.ok()) return status;
  return absl::Status(status.code(), absl::StrCat(mesh_case.Describe(), ": ", status.message(),
                                                  " (replay: ndmap_property --seed ", mesh_case.seed, ")"));
}

absl::Status RunPropertyCase(uint64_t seed, StorageKind storage) {
  const PropertyVariant variant = VariantOf(seed);
  const absl::Status fan = storage == StorageKind::kFlat
                               ? RunFanCase<MapTypes<3, StorageKind::kFlat>>(seed, variant)
                               : RunFanCase<MapTypes<3, StorageKind::kCgal>>(seed, variant);
  if (!fan.ok()) return absl::Status(fan.code(), absl::StrCat("seed ", seed, ", fan: ", fan.message()));
  if (absl::Status s = RunMeshCase(reference::MakeMeshCase(seed), variant, storage); !s.ok()) return s;
  return RunPropertyCase(reference::MakeRandomCase(seed), variant, storage);
}

}  // namespace ndmap

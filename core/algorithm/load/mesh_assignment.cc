// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/algorithm/load/mesh_assignment.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/algorithm/build/partition.h"

namespace ndmap {
namespace {

constexpr int kBits = 21;

uint64_t CellsOf(const VolumeMesh& mesh) { return mesh.cells(); }
uint64_t CellsOf(const PolygonMesh& mesh) { return mesh.faces(); }

// The centres of the cells on a lattice over the mesh's box.
template <class Mesh>
std::vector<LatticeKey> Centres(const Mesh& mesh) {
  Box3 box{mesh.points[0], mesh.points[0]};
  for (const Point3& p : mesh.points) {
    for (int c = 0; c < 3; ++c) {
      box.lo[c] = std::min(box.lo[c], p[c]);
      box.hi[c] = std::max(box.hi[c], p[c]);
    }
  }
  // One scale for all axes, as the curve's steps are of one length.
  double side = std::numeric_limits<double>::min();
  for (int c = 0; c < 3; ++c) side = std::max(side, box.hi[c] - box.lo[c]);
  std::vector<LatticeKey> keys(CellsOf(mesh));
  for (uint64_t cell = 0; cell < keys.size(); ++cell) {
    const auto corners = mesh.Corners(cell);
    for (int c = 0; c < 3; ++c) {
      double share = 0;
      for (uint32_t p : corners) share += (mesh.points[p][c] - box.lo[c]) / side;
      share = std::clamp(share / static_cast<double>(corners.size()), 0.0, 1.0);
      keys[cell][c] = static_cast<uint32_t>(share * ((1 << kBits) - 1));
    }
  }
  return keys;
}

template <class Mesh, class Key>
std::vector<uint32_t> CutAlong(const Mesh& mesh, uint32_t blocks, Key key) {
  const std::vector<LatticeKey> centres = Centres(mesh);
  std::vector<std::pair<uint64_t, uint64_t>> keyed(centres.size());
  for (uint64_t cell = 0; cell < centres.size(); ++cell) keyed[cell] = {key(centres[cell]), cell};
  std::sort(keyed.begin(), keyed.end());
  std::vector<uint64_t> order(keyed.size());
  for (size_t i = 0; i < keyed.size(); ++i) order[i] = keyed[i].second;
  return CutSequence(order, std::vector<double>(order.size(), 1.0), blocks);
}

// Calls f with the neighbours of a cell.
template <class F>
void ForNeighbours(const GluedMesh& glued, uint64_t cell, F f) {
  for (int side = 0; side < ShapeOf(glued.mesh.kinds[cell]).faces; ++side) {
    const FaceLink& link = glued.Link(cell, side);
    if (!link.boundary()) f(link.cell);
  }
}
template <class F>
void ForNeighbours(const GluedPolygons& glued, uint64_t face, F f) {
  for (uint64_t side = 0; side < glued.mesh.Corners(face).size(); ++side) {
    const SideLink& link = glued.Link(face, side);
    if (!link.boundary()) f(link.face);
  }
}

// No more sides than this has a mesh.
uint64_t SidesOf(const VolumeMesh& mesh) { return mesh.cells() * kMostCellFaces; }
uint64_t SidesOf(const PolygonMesh& mesh) { return mesh.corners.size(); }

template <class Glued>
absl::StatusOr<std::vector<uint32_t>> ByMetis(const Glued& glued, uint32_t blocks, absl::string_view sides) {
  const uint64_t cells = CellsOf(glued.mesh);
  if (SidesOf(glued.mesh) > static_cast<uint64_t>(std::numeric_limits<int32_t>::max())) {
    return absl::InvalidArgumentError(absl::StrCat("partition metis counts ", sides, " with 31 bits, and ",
                                                   cells, " cells may have more: take hilbert"));
  }
  std::vector<int32_t> starts{0}, neighbours;
  for (uint64_t cell = 0; cell < cells; ++cell) {
    ForNeighbours(glued, cell, [&](uint32_t other) { neighbours.push_back(static_cast<int32_t>(other)); });
    starts.push_back(static_cast<int32_t>(neighbours.size()));
  }
  return PartitionGraph(starts, neighbours, nullptr, nullptr, blocks);
}

template <class Glued>
absl::StatusOr<std::vector<uint32_t>> Assign(const Glued& glued, uint32_t blocks, absl::string_view partition,
                                             absl::string_view cell_name, absl::string_view side_name) {
  const auto& mesh = glued.mesh;
  if (blocks == 0 || blocks > CellsOf(mesh)) {
    return absl::InvalidArgumentError(absl::StrCat(blocks, " blocks, expected 1 to ", CellsOf(mesh),
                                                   ", the number of ", cell_name, " of the mesh"));
  }
  if (partition == "metis") return ByMetis(glued, blocks, side_name);
  if (partition == "hilbert") {
    return CutAlong(mesh, blocks, [](const LatticeKey& at) { return HilbertKey(at, kBits); });
  }
  if (partition == "morton") {
    return CutAlong(mesh, blocks, [](const LatticeKey& at) { return Interleave(at, kBits); });
  }
  return absl::InvalidArgumentError(
      absl::StrCat("partition '", partition, "' of a mesh, expected hilbert, morton or metis"));
}

}  // namespace

absl::StatusOr<std::vector<uint32_t>> AssignMesh(const GluedMesh& glued, uint32_t blocks,
                                                 absl::string_view partition) {
  return Assign(glued, blocks, partition, "cells", "faces");
}

absl::StatusOr<std::vector<uint32_t>> AssignMesh(const GluedPolygons& surface, uint32_t blocks,
                                                 absl::string_view partition) {
  return Assign(surface, blocks, partition, "faces", "edges");
}

}  // namespace ndmap

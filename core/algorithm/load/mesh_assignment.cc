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

// The centres of the cells on a lattice over the mesh's box.
std::vector<LatticeKey> Centres(const VolumeMesh& mesh) {
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
  std::vector<LatticeKey> keys(mesh.cells());
  for (uint64_t cell = 0; cell < mesh.cells(); ++cell) {
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

template <class Key>
std::vector<uint32_t> CutAlong(const VolumeMesh& mesh, uint32_t blocks, Key key) {
  const std::vector<LatticeKey> centres = Centres(mesh);
  std::vector<std::pair<uint64_t, uint64_t>> keyed(centres.size());
  for (uint64_t cell = 0; cell < centres.size(); ++cell) keyed[cell] = {key(centres[cell]), cell};
  std::sort(keyed.begin(), keyed.end());
  std::vector<uint64_t> order(keyed.size());
  for (size_t i = 0; i < keyed.size(); ++i) order[i] = keyed[i].second;
  return CutSequence(order, std::vector<double>(order.size(), 1.0), blocks);
}

absl::StatusOr<std::vector<uint32_t>> ByMetis(const GluedMesh& glued, uint32_t blocks) {
  const VolumeMesh& mesh = glued.mesh;
  if (mesh.cells() * kMostCellFaces > static_cast<uint64_t>(std::numeric_limits<int32_t>::max())) {
    return absl::InvalidArgumentError(absl::StrCat("partition metis counts faces with 31 bits, and ",
                                                   mesh.cells(), " cells may have more: take hilbert"));
  }
  std::vector<int32_t> starts{0}, neighbours;
  for (uint64_t cell = 0; cell < mesh.cells(); ++cell) {
    for (int f = 0; f < ShapeOf(mesh.kinds[cell]).faces; ++f) {
      const FaceLink& link = glued.Link(cell, f);
      if (!link.boundary()) neighbours.push_back(static_cast<int32_t>(link.cell));
    }
    starts.push_back(static_cast<int32_t>(neighbours.size()));
  }
  return PartitionGraph(starts, neighbours, nullptr, nullptr, blocks);
}

}  // namespace

absl::StatusOr<std::vector<uint32_t>> AssignMesh(const GluedMesh& glued, uint32_t blocks,
                                                 absl::string_view partition) {
  const VolumeMesh& mesh = glued.mesh;
  if (blocks == 0 || blocks > mesh.cells()) {
    return absl::InvalidArgumentError(
        absl::StrCat(blocks, " blocks, expected 1 to ", mesh.cells(), ", the number of cells of the mesh"));
  }
  if (partition == "metis") return ByMetis(glued, blocks);
  if (partition == "hilbert") {
    return CutAlong(mesh, blocks, [](const LatticeKey& at) { return HilbertKey(at, kBits); });
  }
  if (partition == "morton") {
    return CutAlong(mesh, blocks, [](const LatticeKey& at) { return Interleave(at, kBits); });
  }
  return absl::InvalidArgumentError(
      absl::StrCat("partition '", partition, "' of a mesh, expected hilbert, morton or metis"));
}

}  // namespace ndmap

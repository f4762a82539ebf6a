// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/mesh/mesh_check.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/mesh/cell_geometry.h"

namespace ndmap::internal {
namespace {

constexpr uint64_t kMostIndices = 0xfffffffe;

using SortedCorners = std::array<uint32_t, kMostCellCorners>;

SortedCorners Sorted(const VolumeMesh& mesh, uint64_t cell) {
  SortedCorners sorted;
  sorted.fill(0xffffffff);
  const auto corners = mesh.Corners(cell);
  std::copy(corners.begin(), corners.end(), sorted.begin());
  std::sort(sorted.begin(), sorted.end());  // The filling is larger than any point.
  return sorted;
}

// The same for the same corners in any order.
uint64_t CornersHash(const VolumeMesh& mesh, uint64_t cell) {
  uint64_t sum = 0;
  for (uint32_t corner : mesh.Corners(cell)) {
    uint64_t x = (corner + uint64_t{1}) * 0x9e3779b97f4a7c15;
    x = (x ^ (x >> 32)) * 0xd6e8feb86659fd93;
    sum += x ^ (x >> 32);
  }
  return sum;
}

absl::Status CheckNotTwice(const VolumeMesh& mesh) {
  std::vector<std::pair<uint64_t, uint32_t>> cells(mesh.cells());
  for (uint32_t c = 0; c < cells.size(); ++c) cells[c] = {CornersHash(mesh, c), c};
  std::sort(cells.begin(), cells.end());
  uint64_t repeated = 0;
  std::pair<uint32_t, uint32_t> example;
  for (size_t i = 0; i < cells.size(); ++i) {
    for (size_t j = i; j > 0 && cells[j - 1].first == cells[i].first; --j) {
      if (Sorted(mesh, cells[j - 1].second) != Sorted(mesh, cells[i].second)) continue;
      if (repeated++ == 0) example = {cells[j - 1].second, cells[i].second};
      break;
    }
  }
  if (repeated == 0) return absl::OkStatus();
  return Refused(mesh, absl::StrCat(Count(repeated, "cell has", "cells have"),
                                    " the same corners as another: ", CellName(mesh, example.second),
                                    " those of ", CellName(mesh, example.first), HowCounted(mesh),
                                    "; leave out the second ", repeated == 1 ? "one" : "ones"));
}

}  // namespace

std::string Count(uint64_t n, absl::string_view one, absl::string_view many) {
  return absl::StrCat(n, " ", n == 1 ? one : many);
}

std::string CellName(const VolumeMesh& mesh, uint64_t cell) {
  return absl::StrCat(ShapeOf(mesh.kinds[cell]).name, " ", mesh.source.Cell(cell));
}

std::string FaceName(const VolumeMesh& mesh, uint64_t cell, int face) {
  const int size = ShapeOf(mesh.kinds[cell]).face_corners[face];
  std::string name = "the face of points ";
  for (int i = 0; i < size; ++i) {
    absl::StrAppend(&name,
                    i == 0          ? ""
                    : i + 1 == size ? " and "
                                    : ", ",
                    mesh.source.Point(mesh.FacePoint(cell, face, i)));
  }
  return name;
}

std::string HowCounted(const MeshSource& source) {
  return source.numbering.empty() ? "" : absl::StrCat(" (", source.numbering, ")");
}

std::string CellList::Names(const VolumeMesh& mesh) const {
  std::string names;
  for (size_t i = 0; i < first_.size(); ++i) {
    const bool last = i + 1 == first_.size() && count_ == first_.size();
    absl::StrAppend(&names, i == 0 ? "" : last ? " and " : ", ", CellName(mesh, first_[i]));
  }
  if (count_ > first_.size()) absl::StrAppend(&names, " and ", count_ - first_.size(), " more");
  return absl::StrCat(names, HowCounted(mesh));
}

absl::Status Refused(const MeshSource& source, absl::string_view what) {
  return absl::InvalidArgumentError(absl::StrCat(source.file, source.file.empty() ? "" : ": ", what));
}

absl::Status CheckArrays(const VolumeMesh& mesh) {
  if (mesh.cells() == 0) return Refused(mesh, "has no tetrahedra, pyramids, prisms or hexahedra");
  if (mesh.cells() > kMostCells || mesh.points.size() > kMostIndices || mesh.corners.size() > kMostIndices) {
    return Refused(mesh, absl::StrCat("has ", mesh.cells(), " cells and ", mesh.points.size(),
                                      " points; at most ", kMostCells, " cells of ", kMostIndices,
                                      " corners and as many points can be held"));
  }
  const auto fits = [](const std::vector<uint64_t>& numbers, size_t of) {
    return numbers.empty() || numbers.size() == of;
  };
  if (mesh.begins.size() != mesh.cells() + 1 || mesh.begins[0] != 0 ||
      mesh.begins.back() != mesh.corners.size() || !fits(mesh.source.cells, mesh.cells()) ||
      !fits(mesh.source.points, mesh.points.size())) {
    return Refused(mesh, "its arrays of cells, corners and numbers do not fit together");
  }
  for (uint64_t c = 0; c < mesh.cells(); ++c) {
    if (static_cast<int>(mesh.kinds[c]) >= kCellKinds)
      return Refused(mesh, absl::StrCat("cell ", c, " is of no known kind"));
    const uint64_t begin = mesh.begins[c], end = mesh.begins[c + 1];
    if (end < begin || end > mesh.corners.size() || end - begin != ShapeOf(mesh.kinds[c]).corners) {
      return Refused(mesh, absl::StrCat(CellName(mesh, c), HowCounted(mesh), " has not the ",
                                        ShapeOf(mesh.kinds[c]).corners, " corners of its kind"));
    }
    for (uint32_t corner : mesh.Corners(c)) {
      if (corner < mesh.points.size()) continue;
      return Refused(mesh, absl::StrCat(CellName(mesh, c), HowCounted(mesh), " has a corner at index ",
                                        corner + mesh.source.first_point, ", out of range; there are ",
                                        mesh.points.size(), " points"));
    }
  }
  for (uint32_t p = 0; p < mesh.points.size(); ++p) {
    for (double x : mesh.points[p]) {
      if (!std::isfinite(x))
        return Refused(mesh, absl::StrCat("point ", mesh.source.Point(p), HowCounted(mesh),
                                          " has a coordinate that is not finite"));
    }
  }
  return absl::OkStatus();
}

absl::Status CheckCorners(const VolumeMesh& mesh) {
  CellList repeated;
  for (uint64_t c = 0; c < mesh.cells(); ++c) {
    const SortedCorners sorted = Sorted(mesh, c);
    const auto end = sorted.begin() + mesh.Corners(c).size();
    if (std::adjacent_find(sorted.begin(), end) != end) repeated.Add(c);
  }
  if (repeated.count() > 0) {
    return Refused(mesh, absl::StrCat(Count(repeated.count(), "cell comes", "cells come"),
                                      " to the same point twice: ", repeated.Names(mesh),
                                      "; write a collapsed cell as the kind that it is, a hexahedron with a "
                                      "collapsed edge as a prism"));
  }
  return CheckNotTwice(mesh);
}

absl::Status CheckSoundness(const VolumeMesh& mesh, const GlueOptions& options,
                            std::vector<std::string>* warnings) {
  CellList inverted, flat, concave;
  for (uint64_t c = 0; c < mesh.cells(); ++c) {
    switch (Soundness(mesh.kinds[c], CellCorners(mesh, c))) {
      case CellSoundness::kSound:
        break;
      case CellSoundness::kConcave:
        concave.Add(c);
        break;
      case CellSoundness::kFlat:
        flat.Add(c);
        break;
      case CellSoundness::kInverted:
        inverted.Add(c);
        break;
    }
  }
  if (inverted.count() > 0) {
    return Refused(
        mesh,
        absl::StrCat(Count(inverted.count(), "cell is", "cells are"), " turned inside out",
                     inverted.count() == mesh.cells() ? ", all there are: " : ": ", inverted.Names(mesh),
                     "; list the corners of the base so that by the right-hand rule its normal points "
                     "into the cell, and then those above it in the same turn"));
  }
  if (flat.count() > 0) {
    return Refused(mesh, absl::StrCat(Count(flat.count(), "cell has", "cells have"), " no volume: ",
                                      flat.Names(mesh), "; take ", flat.count() == 1 ? "it" : "them",
                                      " out of the mesh and join what is on both sides"));
  }
  if (concave.count() == 0) return absl::OkStatus();
  const std::string what = absl::StrCat(
      Count(concave.count(), "cell has", "cells have"),
      " a corner whose edges lie in a plane or stand the wrong way round: ", concave.Names(mesh));
  if (!options.allow_concave) {
    return Refused(mesh, absl::StrCat(what, "; smooth the mesh there, or allow concave cells"));
  }
  warnings->push_back(what);
  return absl::OkStatus();
}

}  // namespace ndmap::internal

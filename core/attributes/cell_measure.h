// SPDX-License-Identifier: GPL-3.0-or-later
// Where a cell lies and how large it is, by its corners alone: vertices that only hang on it, because a
// neighbour was split, change neither. The same bits whatever the blocks and whatever dart one begins with:
// means are added up in the order of their values, volumes in the order in which the mesh lists corners.
#pragma once

#include <algorithm>
#include <array>

#include "absl/container/inlined_vector.h"
#include "core/algorithm/refine/frame.h"
#include "core/attributes/aggregate.h"
#include "core/map/block.h"
#include "core/mesh/cell_geometry.h"
#include "core/names/polyhedron_lattice.h"

namespace ndmap {

// The points at corners. Of an n-cell by local corner (core/mesh/cell_darts.h).
using CornerPoints = absl::InlinedVector<Point3, kMostCellCorners>;

// Sorted first, so that no order of the points matters.
inline Point3 MeanOf(const CornerPoints& points) {
  Point3 mean{};
  for (size_t c = 0; c < 3; ++c) {
    absl::InlinedVector<double, kMostCellCorners> values;
    for (const Point3& p : points) values.push_back(p[c]);
    std::sort(values.begin(), values.end());
    for (double v : values) mean[c] += v;
    mean[c] /= static_cast<double>(points.size());
  }
  return mean;
}

template <class BlockT>
class CellMeasure {
 public:
  using Lcc = typename BlockT::Lcc;
  using Dart = typename BlockT::Dart;
  using Cell = typename BlockT::Types::Cell;
  using F = Frame<BlockT>;

  explicit CellMeasure(Lcc& map) : map_(map), polyhedron_(map) {}

  // O(its darts).
  CornerPoints CornersOf(Cell cell) {
    const auto& info = map_.template info_of_attribute<3>(cell);
    if (info.kind == CellKind::kHexahedron) {
      const std::array<Point3, 8> corners = F::Of(map_, cell).Corners(map_);
      return {corners.begin(), corners.end()};
    }
    CornerPoints corners(DartsOf(info.kind).corners);
    for (const auto& placed : polyhedron_.Of(cell)) {
      if (placed.vertex.part < corners.size()) corners[placed.vertex.part] = F::StartPoint(map_, placed.dart);
    }
    return corners;
  }

  // Of the face of a dart. A triangle is the only face with just three vertices of level 0; it is never
  // split. O(its darts).
  CornerPoints FaceCorners(Dart d) const {
    CornerPoints corners;
    Dart e = d;
    do {
      if (F::StartLevel(map_, e) == 0) corners.push_back(F::StartPoint(map_, e));
      e = map_.template beta<1>(e);
    } while (e != d);
    if (corners.size() == 3) return corners;
    corners.clear();
    const int level = F::FaceLevel(map_, d);
    do {
      if (F::StartLevel(map_, e) <= level) corners.push_back(F::StartPoint(map_, e));
      e = map_.template beta<1>(e);
    } while (e != d);
    return corners;
  }

  // The mean of the corners of the dart's cell of a dimension; of a vertex its point.
  Point3 CentreOf(Dart d, unsigned dimension) {
    if (dimension == 0) return F::StartPoint(map_, d);
    if (dimension == 1)
      return MeanOf({F::StartPoint(map_, d), F::StartPoint(map_, map_.template beta<1>(d))});
    return MeanOf(dimension == 2 ? FaceCorners(d) : CornersOf(map_.template attribute<3>(d)));
  }

  // What lies between the faces, with sign: those of three corners are plane, those of four bilinear. So the
  // children of a hexahedron add up to it, and no room is between neighbours.
  double VolumeOf(Cell cell) {
    const CornerPoints corners = CornersOf(cell);
    const CellKind kind = map_.template info_of_attribute<3>(cell).kind;
    if (kind != CellKind::kHexahedron) return CellVolume(kind, corners);
    std::array<Point3, 8> eight{};
    std::copy(corners.begin(), corners.end(), eight.begin());
    return HexahedronVolume(eight);
  }

 private:
  Lcc& map_;
  PolyhedronLattice<BlockT> polyhedron_;
};

}  // namespace ndmap

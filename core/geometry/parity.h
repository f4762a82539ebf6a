// SPDX-License-Identifier: GPL-3.0-or-later
// Inside or outside by parity: a point is inside when a ray from it crosses the surface an odd number of
// times. Every closed component toggles, so a shell within a shell bounds a cavity, whatever the triangles'
// orientation.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/geometry/surface.h"

namespace ndmap {

// Parity for one point that does not lie on the surface; the answer for a point on it is unspecified, but the
// same on every machine. Exact: the ray to +x is moved by (0, e, e^2) for an infinitely small e, so that it
// never meets an edge or a corner, however they are aligned. O(triangles), mostly a comparison or two for
// each.
bool InsideByParity(const TriangleSurface& surface, const Point3& point);

// The same answers for many points: triangles in the cells of a grid over y and z, made in O(triangles), with
// about 4 to 40 bytes a triangle. Read by any number of threads.
class ParityIndex {
 public:
  explicit ParityIndex(std::shared_ptr<const TriangleSurface> surface);

  // O(triangles over the point's yz cell).
  bool Inside(const Point3& point) const;
  // Counting only the triangles for which counts(triangle).
  template <class F>
  bool Inside(const Point3& point, F counts) const;

 private:
  // The grid cell along y (axis 0) or z (axis 1); never falls when the coordinate rises, so a point within a
  // triangle's extent is in a cell within the triangle's cells.
  uint32_t CellAlong(int axis, double coordinate) const;
  struct CellRange {
    std::array<uint32_t, 2> low, high;  // Both included.
  };
  CellRange CellsOf(uint32_t triangle) const;
  // Calls f(cell, triangle) for every cell that a triangle's yz box touches.
  template <class F>
  void ForEachEntry(F f) const;
  uint64_t CountEntries() const;
  // The entries of the point's cell: from *first to *end.
  void EntriesAt(const Point3& point, uint64_t* first, uint64_t* end) const;
  bool Crosses(uint32_t triangle, const Point3& point) const;

  std::shared_ptr<const TriangleSurface> surface_;
  Box3 box_;
  uint32_t cells_ = 1;           // Along each axis.
  std::vector<uint64_t> first_;  // The entries of cell i are entries_[first_[i]] to entries_[first_[i + 1]].
  std::vector<uint32_t> entries_;
};

template <class F>
bool ParityIndex::Inside(const Point3& point, F counts) const {
  uint64_t first, end;
  EntriesAt(point, &first, &end);
  bool inside = false;
  for (uint64_t i = first; i < end; ++i) inside ^= counts(entries_[i]) && Crosses(entries_[i], point);
  return inside;
}

}  // namespace ndmap

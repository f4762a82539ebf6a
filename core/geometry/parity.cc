// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/geometry/parity.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace ndmap {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;

// On which side of the line a → b, seen in the yz plane, the moved ray runs. With q moved by (e, e^2) the
// orientation of (a, b, q) changes by -e * (b.z - a.z) + e^2 * (b.y - a.y). ZERO only if a and b project to
// one point; changes sign when a and b are exchanged, so the two triangles at an edge agree on it.
CGAL::Sign RaySide(const Point3& a, const Point3& b, const Point3& q) {
  const CGAL::Sign side = CGAL::orientation(Kernel::Point_2(a[1], a[2]), Kernel::Point_2(b[1], b[2]),
                                            Kernel::Point_2(q[1], q[2]));
  if (side != CGAL::ZERO) return side;
  const CGAL::Sign by_z = CGAL::compare(a[2], b[2]);
  return by_z != CGAL::ZERO ? by_z : CGAL::compare(b[1], a[1]);
}

bool RayCrosses(const Point3& a, const Point3& b, const Point3& c, const Point3& p) {
  for (int axis : {1, 2}) {
    if ((a[axis] < p[axis] && b[axis] < p[axis] && c[axis] < p[axis]) ||
        (a[axis] > p[axis] && b[axis] > p[axis] && c[axis] > p[axis])) {
      return false;
    }
  }
  if (a[0] < p[0] && b[0] < p[0] && c[0] < p[0]) return false;
  const CGAL::Sign side = RaySide(a, b, p);
  if (side == CGAL::ZERO || RaySide(b, c, p) != side || RaySide(c, a, p) != side) return false;
  // The line crosses, in a point of the closed triangle when e tends to 0; on the ray if that point is at
  // larger x. The normal's x component has the sign `side`.
  if (a[0] > p[0] && b[0] > p[0] && c[0] > p[0]) return true;
  const auto point = [](const Point3& x) { return Kernel::Point_3(x[0], x[1], x[2]); };
  return CGAL::orientation(point(a), point(b), point(c), point(p)) == -side;
}

bool RayCrosses(const TriangleSurface& surface, uint32_t triangle, const Point3& p) {
  const auto& [a, b, c] = surface.triangles[triangle];
  return RayCrosses(surface.points[a], surface.points[b], surface.points[c], p);
}

}  // namespace

bool InsideByParity(const TriangleSurface& surface, const Point3& point) {
  bool inside = false;
  for (uint32_t t = 0; t < surface.triangles.size(); ++t) inside ^= RayCrosses(surface, t, point);
  return inside;
}

uint32_t ParityIndex::CellAlong(int axis, double coordinate) const {
  const double lo = box_.lo[axis + 1], extent = box_.hi[axis + 1] - lo;
  if (!(coordinate > lo)) return 0;
  const double cell = (coordinate - lo) / extent * cells_;
  return cell < cells_ ? static_cast<uint32_t>(cell) : cells_ - 1;  // Not-a-number goes last, too.
}

ParityIndex::CellRange ParityIndex::CellsOf(uint32_t triangle) const {
  const auto& corners = surface_->triangles[triangle];
  CellRange range;
  for (int axis : {0, 1}) {
    const auto [least, most] =
        std::minmax({surface_->points[corners[0]][axis + 1], surface_->points[corners[1]][axis + 1],
                     surface_->points[corners[2]][axis + 1]});
    range.low[axis] = CellAlong(axis, least);
    range.high[axis] = CellAlong(axis, most);
  }
  return range;
}

template <class F>
void ParityIndex::ForEachEntry(F f) const {
  for (uint32_t t = 0; t < surface_->triangles.size(); ++t) {
    const CellRange range = CellsOf(t);
    for (size_t i = range.low[0]; i <= range.high[0]; ++i) {
      for (size_t j = range.low[1]; j <= range.high[1]; ++j) f(i * cells_ + j, t);
    }
  }
}

uint64_t ParityIndex::CountEntries() const {
  uint64_t entries = 0;
  for (uint32_t t = 0; t < surface_->triangles.size(); ++t) {
    const CellRange range = CellsOf(t);
    entries += uint64_t{range.high[0] - range.low[0] + 1} * (range.high[1] - range.low[1] + 1);
  }
  return entries;
}

ParityIndex::ParityIndex(std::shared_ptr<const TriangleSurface> surface)
    : surface_(std::move(surface)), box_(BoundingBox(*surface_)) {
  // About a cell a triangle; fewer if large triangles would be entered in very many.
  const size_t triangles = surface_->triangles.size();
  cells_ = static_cast<uint32_t>(std::clamp(std::sqrt(static_cast<double>(triangles)), 1.0, 4096.0));
  while (cells_ > 1 && CountEntries() > 8 * triangles) cells_ /= 2;
  first_.assign(size_t{cells_} * cells_ + 1, 0);
  ForEachEntry([this](size_t cell, uint32_t) { ++first_[cell + 1]; });
  for (size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
  entries_.resize(first_.back());
  std::vector<uint64_t> next(first_.begin(), first_.end() - 1);
  ForEachEntry([&](size_t cell, uint32_t triangle) { entries_[next[cell]++] = triangle; });
}

void ParityIndex::EntriesAt(const Point3& point, uint64_t* first, uint64_t* end) const {
  *first = *end = 0;
  for (int c = 0; c < 3; ++c) {
    if (!(point[c] >= box_.lo[c] && point[c] <= box_.hi[c])) return;
  }
  const size_t cell = size_t{CellAlong(0, point[1])} * cells_ + CellAlong(1, point[2]);
  *first = first_[cell];
  *end = first_[cell + 1];
}

bool ParityIndex::Crosses(uint32_t triangle, const Point3& point) const {
  return RayCrosses(*surface_, triangle, point);
}

bool ParityIndex::Inside(const Point3& point) const {
  return Inside(point, [](uint32_t) { return true; });
}

}  // namespace ndmap

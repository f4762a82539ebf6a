// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/geometry/surface_index.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/geometry/triangle_filter.h"

namespace ndmap {
namespace {

// Its do_intersect of a Bbox_3 with a triangle or a segment is exact: doubles with an error bound first, then
// intervals, then exact numbers. Asked only where TriangleFilter is unsure.
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;

Kernel::Point_3 ToCgal(const Point3& p) { return {p[0], p[1], p[2]}; }

bool ExactlyMeets(const Box3& box, const Point3& a, const Point3& b, const Point3& c, bool degenerate) {
  const CGAL::Bbox_3 bbox(box.lo[0], box.lo[1], box.lo[2], box.hi[0], box.hi[1], box.hi[2]);
  if (!degenerate) return CGAL::do_intersect(bbox, Kernel::Triangle_3(ToCgal(a), ToCgal(b), ToCgal(c)));
  // CGAL takes a triangle without area for more than it is. It consists of its longest side, which is that of
  // its extreme corners by coordinates.
  const auto ends = std::minmax({a, b, c});
  if (ends.first == ends.second) return CGAL::do_overlap(bbox, ToCgal(a).bbox());
  return CGAL::do_intersect(bbox, Kernel::Segment_3(ToCgal(ends.first), ToCgal(ends.second)));
}

// The nearest floats below and above.
float Below(double x) {
  const float f = static_cast<float>(x);
  return f <= x ? f : std::nextafter(f, -std::numeric_limits<float>::infinity());
}
float Above(double x) { return -Below(-x); }

bool IsFlat(const Box3& box) {
  return box.lo[0] == box.hi[0] || box.lo[1] == box.hi[1] || box.lo[2] == box.hi[2];
}

Box3 BoxAround(absl::Span<const Box3> boxes, const bool* skip) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Box3 around{{kInfinity, kInfinity, kInfinity}, {-kInfinity, -kInfinity, -kInfinity}};
  for (size_t i = 0; i < boxes.size(); ++i) {
    for (int x = 0; x < 3 && !skip[i]; ++x) {
      around.lo[x] = std::min(around.lo[x], boxes[i].lo[x]);
      around.hi[x] = std::max(around.hi[x], boxes[i].hi[x]);
    }
  }
  return around;
}

}  // namespace

SurfaceIndex::SurfaceIndex(std::shared_ptr<const TriangleSurface> surface, const std::optional<Box3>& region)
    : surface_(std::move(surface)) {
  for (uint32_t t = 0; t < surface_->triangles.size(); ++t) {
    const TriangleFilter filter(Corner(t, 0), Corner(t, 1), Corner(t, 2));
    if (region && !filter.NearTo(*region)) continue;
    const bool degenerate = CGAL::collinear(ToCgal(Corner(t, 0)), ToCgal(Corner(t, 1)), ToCgal(Corner(t, 2)));
    entries_.push_back(degenerate ? t | kDegenerate : t);
  }
  entries_.shrink_to_fit();
  if (!entries_.empty()) Build(0, static_cast<uint32_t>(entries_.size()));
  nodes_.shrink_to_fit();
}

void SurfaceIndex::Build(uint32_t begin, uint32_t end) {
  const size_t at = nodes_.size();
  Point3 lo = Corner(entries_[begin], 0), hi = lo;
  Point3 least = lo, most = lo;  // Of first corners.
  for (uint32_t i = begin; i < end; ++i) {
    for (int k = 0; k < 3; ++k) {
      const Point3& p = Corner(entries_[i], k);
      for (int x = 0; x < 3; ++x) {
        lo[x] = std::min(lo[x], p[x]);
        hi[x] = std::max(hi[x], p[x]);
        if (k > 0) continue;
        least[x] = std::min(least[x], p[x]);
        most[x] = std::max(most[x], p[x]);
      }
    }
  }
  nodes_.push_back({{Below(lo[0]), Below(lo[1]), Below(lo[2])},
                    {Above(hi[0]), Above(hi[1]), Above(hi[2])},
                    begin,
                    end,
                    0});
  if (end - begin <= kLeaf) return;
  int axis = 0;
  for (int x = 1; x < 3; ++x) {
    if (most[x] - least[x] > most[axis] - least[axis]) axis = x;
  }
  const uint32_t middle = begin + (end - begin) / 2;
  std::nth_element(entries_.begin() + begin, entries_.begin() + middle, entries_.begin() + end,
                   [this, axis](uint32_t a, uint32_t b) { return Corner(a, 0)[axis] < Corner(b, 0)[axis]; });
  Build(begin, middle);
  nodes_[at].second = static_cast<uint32_t>(nodes_.size());
  Build(middle, end);
}

template <class F>
void SurfaceIndex::Visit(const Box3& near, F f) const {
  if (nodes_.empty()) return;
  // Halves are halves by number, so there are at most 31 levels.
  std::array<uint32_t, 32> waiting;
  size_t count = 0;
  waiting[count++] = 0;
  while (count > 0) {
    const uint32_t at = waiting[--count];
    const Node& node = nodes_[at];
    if (node.lo[0] > near.hi[0] || node.hi[0] < near.lo[0] || node.lo[1] > near.hi[1] ||
        node.hi[1] < near.lo[1] || node.lo[2] > near.hi[2] || node.hi[2] < near.lo[2]) {
      continue;
    }
    if (node.second != 0) {
      waiting[count++] = node.second;
      waiting[count++] = at + 1;
      continue;
    }
    for (uint32_t i = node.begin; i < node.end; ++i) {
      if (f(entries_[i])) return;
    }
  }
}

void SurfaceIndex::MeetMany(absl::Span<const Box3> boxes, bool* met) const {
  size_t left = boxes.size();
  Box3 near = BoxAround(boxes, met);
  Visit(near, [&](uint32_t entry) {
    const Point3 &a = Corner(entry, 0), &b = Corner(entry, 1), &c = Corner(entry, 2);
    const TriangleFilter filter(a, b, c);
    if (!filter.NearTo(near)) return false;
    const size_t before = left;
    const bool degenerate = (entry & kDegenerate) != 0;
    for (size_t i = 0; i < boxes.size(); ++i) {
      if (met[i] || !filter.NearTo(boxes[i])) continue;
      const Meeting meeting = degenerate || IsFlat(boxes[i]) ? Meeting::kUnsure : filter.With(boxes[i]);
      if (meeting == Meeting::kApart) continue;
      if (meeting == Meeting::kUnsure && !ExactlyMeets(boxes[i], a, b, c, degenerate)) continue;
      met[i] = true;
      --left;
    }
    // What is left may be far from many triangles.
    if (left != before) near = BoxAround(boxes, met);
    return left == 0;
  });
}

bool SurfaceIndex::Meets(const Box3& closed_box) const {
  bool met = false;
  MeetMany(absl::MakeConstSpan(&closed_box, 1), &met);
  return met;
}

std::array<bool, 8> SurfaceIndex::MeetEach(const std::array<Box3, 8>& closed_boxes) const {
  std::array<bool, 8> met{};
  MeetMany(closed_boxes, met.data());
  return met;
}

}  // namespace ndmap

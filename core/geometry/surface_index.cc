// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/geometry/surface_index.h"

#include <CGAL/AABB_segment_primitive.h>
#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

namespace ndmap {
namespace {

// Its do_intersect of a Bbox_3 with a triangle or a segment is filtered: doubles with an error bound first,
// then intervals, then exact numbers. The tests compare it with exact arithmetic alone.
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;

Kernel::Point_3 ToCgal(const Point3& p) { return {p[0], p[1], p[2]}; }

}  // namespace

namespace internal {

// A triangle by its number alone; the tree's traits know the surface.
class TrianglePrimitive {
 public:
  using Id = uint32_t;
  using Point = Kernel::Point_3;
  using Datum = Kernel::Triangle_3;
  using Datum_reference = Datum;
  using Point_reference = Point;
  using Shared_data = const TriangleSurface*;

  TrianglePrimitive() = default;
  TrianglePrimitive(const uint32_t* id, Shared_data) : id_(*id) {}
  static Shared_data construct_shared_data(Shared_data surface) { return surface; }
  Datum datum(Shared_data surface) const {
    const auto& [a, b, c] = surface->triangles[id_];
    return {ToCgal(surface->points[a]), ToCgal(surface->points[b]), ToCgal(surface->points[c])};
  }
  Point reference_point(Shared_data surface) const {
    return ToCgal(surface->points[surface->triangles[id_][0]]);
  }
  Id id() const { return id_; }

 private:
  uint32_t id_ = 0;
};

}  // namespace internal

namespace {

using Segments = std::vector<Kernel::Segment_3>;
using TriangleTree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, internal::TrianglePrimitive>>;
using SegmentTree = CGAL::AABB_tree<
    CGAL::AABB_traits<Kernel, CGAL::AABB_segment_primitive<Kernel, Segments::const_iterator>>>;

// What a triangle with collinear corners consists of.
Kernel::Segment_3 LongestSide(const Kernel::Triangle_3& t) {
  const auto ends = std::minmax({t[0], t[1], t[2]});  // By coordinates: along a line the extreme ones.
  return {ends.first, ends.second};
}

bool BoxesMeet(const Box3& region, const CGAL::Bbox_3& box) {
  for (int c = 0; c < 3; ++c) {
    if (box.min(c) > region.hi[c] || box.max(c) < region.lo[c]) return false;
  }
  return true;
}

}  // namespace

struct SurfaceIndex::Tree {
  std::shared_ptr<const TriangleSurface> surface;
  TriangleTree triangles;
  // CGAL's test of a box with a triangle takes a triangle without area for more than it is.
  Segments segments;
  SegmentTree degenerate;
};

SurfaceIndex::SurfaceIndex(std::shared_ptr<const TriangleSurface> surface,
                           const std::optional<Box3>& region) {
  auto tree = std::make_unique<Tree>();
  tree->surface = std::move(surface);
  std::vector<uint32_t> chosen;
  for (uint32_t t = 0; t < tree->surface->triangles.size(); ++t) {
    const auto triangle = internal::TrianglePrimitive(&t, nullptr).datum(tree->surface.get());
    if (region && !BoxesMeet(*region, triangle.bbox())) continue;
    if (triangle.is_degenerate()) {
      tree->segments.push_back(LongestSide(triangle));
    } else {
      chosen.push_back(t);
    }
  }
  // Built now: CGAL would otherwise build at the first question.
  const uint32_t* first = chosen.data();
  tree->triangles.insert(first, first + chosen.size(), tree->surface.get());
  tree->triangles.build();
  tree->degenerate.insert(tree->segments.begin(), tree->segments.end());
  tree->degenerate.build();
  tree_ = std::move(tree);
}

SurfaceIndex::~SurfaceIndex() = default;

bool SurfaceIndex::Meets(const Box3& closed_box) const {
  const CGAL::Bbox_3 box(closed_box.lo[0], closed_box.lo[1], closed_box.lo[2], closed_box.hi[0],
                         closed_box.hi[1], closed_box.hi[2]);
  return (!tree_->triangles.empty() && tree_->triangles.do_intersect(box)) ||
         (!tree_->degenerate.empty() && tree_->degenerate.do_intersect(box));
}

size_t SurfaceIndex::size() const { return tree_->triangles.size() + tree_->degenerate.size(); }

}  // namespace ndmap

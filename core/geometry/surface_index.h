// SPDX-License-Identifier: GPL-3.0-or-later
// The question of refinement: does this box meet the surface?
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "absl/types/span.h"
#include "core/geometry/surface.h"

namespace ndmap {

// The triangles of a surface, or of the part of it near a region, in a tree of boxes. Built once, in
// O(triangles * log triangles), with about 30 bytes a triangle; then any number of threads may ask.
class SurfaceIndex {
 public:
  // Indexes the triangles whose closed bounding box meets the closed region; all of them without a region.
  // Triangle corners must be in range and finite (ValidateClosedSurface), and triangles fewer than 2^31.
  explicit SurfaceIndex(std::shared_ptr<const TriangleSurface> surface,
                        const std::optional<Box3>& region = std::nullopt);
  SurfaceIndex(const SurfaceIndex&) = delete;
  SurfaceIndex& operator=(const SurfaceIndex&) = delete;

  // Whether the closed axis-aligned box, lo <= hi in each coordinate (flat boxes and single points too), has
  // a point in common with a closed indexed triangle. Exact: touching counts, rounding never does.
  bool Meets(const Box3& closed_box) const;
  // The same for each of eight boxes, which is cheaper than eight questions where they lie close together.
  std::array<bool, 8> MeetEach(const std::array<Box3, 8>& closed_boxes) const;

  // How many triangles are indexed.
  size_t size() const { return entries_.size(); }

 private:
  // A part of the entries and a box around its triangles. An inner node has its first half in the next node
  // and its second half in node `second`; `second` of a leaf is 0.
  struct Node {
    std::array<float, 3> lo, hi;
    uint32_t begin, end, second;
  };
  static constexpr uint32_t kLeaf = 4;
  // In an entry, beside the triangle's number: its corners are on a line.
  static constexpr uint32_t kDegenerate = uint32_t{1} << 31;

  const Point3& Corner(uint32_t entry, int k) const {
    return surface_->points[surface_->triangles[entry & ~kDegenerate][k]];
  }
  void Build(uint32_t begin, uint32_t end);
  // Calls f(entry) for the entries in leaves whose boxes meet `near`, which f may make smaller, until f says
  // true.
  template <class F>
  void Visit(const Box3& near, F f) const;
  // Which of the boxes meet; *met is set there.
  void MeetMany(absl::Span<const Box3> boxes, bool* met) const;

  std::shared_ptr<const TriangleSurface> surface_;
  std::vector<uint32_t> entries_;
  std::vector<Node> nodes_;
};

}  // namespace ndmap

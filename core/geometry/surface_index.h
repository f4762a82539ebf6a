// SPDX-License-Identifier: GPL-3.0-or-later
// The question of refinement: does this box meet the surface?
#pragma once

#include <cstddef>
#include <memory>
#include <optional>

#include "core/geometry/surface.h"

namespace ndmap {

// The triangles of a surface, or of the part of it near a region, in a tree of boxes. Built once, in
// O(triangles * log triangles), with 4 bytes a triangle beside the tree; then any number of threads may ask.
class SurfaceIndex {
 public:
  // Indexes the triangles whose closed bounding box meets the closed region; all of them without a region.
  // Triangle corners must be in range and finite (ValidateClosedSurface).
  explicit SurfaceIndex(std::shared_ptr<const TriangleSurface> surface,
                        const std::optional<Box3>& region = std::nullopt);
  ~SurfaceIndex();
  SurfaceIndex(const SurfaceIndex&) = delete;
  SurfaceIndex& operator=(const SurfaceIndex&) = delete;

  // Whether the closed axis-aligned box, lo <= hi in each coordinate (flat boxes and single points too), has
  // a point in common with a closed indexed triangle. Exact: touching counts, rounding never does.
  bool Meets(const Box3& closed_box) const;

  // How many triangles are indexed.
  size_t size() const;

 private:
  struct Tree;
  std::unique_ptr<const Tree> tree_;
};

}  // namespace ndmap

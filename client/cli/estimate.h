// SPDX-License-Identifier: GPL-3.0-or-later
// What a run will cost, before it is begun.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "core/geometry/grid_shape.h"
#include "core/geometry/surface.h"
#include "core/map/ids.h"

namespace ndmap::cli {

// Hexahedra of the refined mesh, by sampling.
struct Estimate {
  struct Level {
    double cells = 0;    // Hexahedra of this level that are made.
    double refined = 0;  // Of them, split further.
    double cut = 0;      // Of those that stay, by state.
    double inside = 0;
    double outside = 0;
  };
  std::vector<Level> levels;  // 0 ... depth

  double made() const;  // Hexahedra before trimming: what is left of all levels.
  double cut() const;
  double inside() const;
  double outside() const;
};

// Follows a random sample of the hexahedra that meet the surface down the levels: of `sample` hexahedra of a
// level all eight children are tested, with the tests that refinement uses. Exact while a level has no more
// than `sample`; the error grows with each level beyond, and is some percent with the default. The same on
// every run. O(cells of the grid
// + depth * sample * log triangles).
Estimate EstimateRefinement(const std::shared_ptr<const TriangleSurface>& surface, const GridShape& grid,
                            int depth, size_t sample = 4000);

// What hexahedra cost, measured with release builds on the project's test surfaces: see the .cc file.
struct Cost {
  double memory_bytes = 0;  // All block servers, at the peak.
  double cpu_seconds = 0;   // All processes.
  double disk_bytes = 0;    // The export, VTK_HEXAHEDRON.
};
// `held`: the most hexahedra that there are at one time.
Cost CostOf(double made, double held, double kept, uint64_t triangles, uint32_t servers);

// The smallest depth at which the longest edge of a hexahedron is at most `size`; above CellId::kMaxLevel if
// none is.
int DepthForSize(const GridShape& grid, double size);

}  // namespace ndmap::cli

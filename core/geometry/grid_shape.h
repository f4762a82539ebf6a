// SPDX-License-Identifier: GPL-3.0-or-later
// The initial grid of hexahedra over a surface: how many cells, and where its corners are, bit for bit.
#pragma once

#include <array>
#include <cstdint>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/geometry/surface.h"

namespace ndmap {

// How much --grid and auto enlarge the bounding box about its centre unless told otherwise, and how much
// longer than a cube's share of the longest side --cubes makes its cubes: no hexahedron's side lies in an
// extreme face.
inline constexpr double kDefaultGridPadding = 0.001;

// An axis-aligned grid from lo to hi.
struct GridShape {
  std::array<uint32_t, 3> cells{1, 1, 1};
  Point3 lo{};
  Point3 hi{};

  // Corner (i, j, k), 0 <= i <= cells[0] and so on. Every process evaluates this one formula per coordinate,
  // lo + (hi - lo) * i / cells, so that all of them and every test get the same bits.
  Point3 Corner(uint32_t i, uint32_t j, uint32_t k) const;

  // cells[0] * cells[1] * cells[2]; fits in 32 bits for every grid made by the functions below.
  uint64_t CellCount() const;
};

// The box enlarged about its centre by the factor 1 + padding, cut into counts cells. Per axis, with
// centre = (lo + hi) / 2 and half = (hi - lo) / 2: lo' = centre - half * (1 + padding), hi' = centre + half *
// (1 + padding). INVALID_ARGUMENT for a box that is flat or not finite, a count of 0, 2^32 cells or more, a
// padding below 0.
absl::StatusOr<GridShape> GridFromCounts(const Box3& box, std::array<uint32_t, 3> counts,
                                         double padding = kDefaultGridPadding);

// Cubes of side = 1.001 * longest side / n. Per axis count = max(1, ceil((hi - lo) / side)), and the grid is
// centred: lo' = centre - side * count / 2, hi' = centre + side * count / 2. Errors as above.
absl::StatusOr<GridShape> GridFromCubes(const Box3& box, uint32_t n);

// About that many near-cubic cells (a box much thinner in one axis has one layer there), as GridFromCounts.
absl::StatusOr<GridShape> GridAuto(const Box3& box, uint32_t about = 1000);

// The finest level whose points all have 64-bit numbers in files: those of the lattice that the corners of
// that level's hexahedra would form. 17 for 10x11x9.
int FinestNumberedLevel(const GridShape& grid);

// OK if hexahedra of level `depth` can be told apart: their points have numbers in files, and their corners,
// rounded, differ. Otherwise OUT_OF_RANGE that names the deepest level of this grid.
absl::Status CheckDepth(const GridShape& grid, int depth);

}  // namespace ndmap

// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/geometry/grid_shape.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"

namespace ndmap {
namespace {

constexpr const char* kAxis[3] = {"x", "y", "z"};
// Ids of cells hold so many.
constexpr int kMostLevels = 29;

double Largest(const GridShape& grid, int axis) {
  return std::max(std::fabs(grid.lo[axis]), std::fabs(grid.hi[axis]));
}
// A side of a few units in the last place of the coordinates.
double LeastSide(const GridShape& grid, int axis) { return Largest(grid, axis) * 0x1p-50; }

absl::Status CheckBox(const Box3& box) {
  for (int c = 0; c < 3; ++c) {
    const double extent = box.hi[c] - box.lo[c];
    if (!std::isfinite(box.lo[c]) || !std::isfinite(box.hi[c]) || !std::isfinite(extent * 4)) {
      return absl::InvalidArgumentError(
          absl::StrCat("bounding box is not finite along ", kAxis[c], ": ", box.lo[c], " to ", box.hi[c]));
    }
    if (!(extent > 0)) {
      return absl::InvalidArgumentError(absl::StrCat("bounding box is flat: no extent along ", kAxis[c],
                                                     " at ", box.lo[c],
                                                     "; a grid needs a surface that encloses a volume"));
    }
  }
  return absl::OkStatus();
}

// The corners must differ, or hexahedra would have no volume: an extent of a few units in the last place.
absl::StatusOr<GridShape> Checked(const GridShape& grid) {
  uint64_t cells = 1;
  for (int c = 0; c < 3; ++c) {
    if (grid.cells[c] == 0)
      return absl::InvalidArgumentError(absl::StrCat("grid has 0 cells along ", kAxis[c]));
    cells *= grid.cells[c];  // Both factors are below 2^32.
    if (cells > 0xffffffffu) {
      return absl::InvalidArgumentError(absl::StrCat("grid ", grid.cells[0], "x", grid.cells[1], "x",
                                                     grid.cells[2], " has 2^32 cells or more"));
    }
  }
  for (int c = 0; c < 3; ++c) {
    const double step = (grid.hi[c] - grid.lo[c]) / grid.cells[c];
    const double largest = Largest(grid, c);
    // Squares, areas and sums of eight stay finite.
    if (largest > 1e150) {
      return absl::InvalidArgumentError(absl::StrCat("coordinates near ", largest, " along ", kAxis[c],
                                                     " are beyond 1e150: scale the surface"));
    }
    if (!std::isfinite(grid.lo[c]) || !std::isfinite(grid.hi[c]) || !(step > LeastSide(grid, c))) {
      return absl::InvalidArgumentError(absl::StrCat(
          "grid cells along ", kAxis[c], " are too small for coordinates near ", largest, ": side ", step));
    }
  }
  return grid;
}

}  // namespace

Point3 GridShape::Corner(uint32_t i, uint32_t j, uint32_t k) const {
  const std::array<uint32_t, 3> index = {i, j, k};
  Point3 corner;
  for (int c = 0; c < 3; ++c) corner[c] = lo[c] + (hi[c] - lo[c]) * index[c] / cells[c];
  return corner;
}

uint64_t GridShape::CellCount() const { return uint64_t{cells[0]} * cells[1] * cells[2]; }

absl::StatusOr<GridShape> GridFromCounts(const Box3& box, std::array<uint32_t, 3> counts, double padding) {
  if (absl::Status s = CheckBox(box); !s.ok()) return s;
  if (!(padding >= 0) || !std::isfinite(padding)) {
    return absl::InvalidArgumentError(absl::StrCat("padding ", padding, " is not a number of 0 or more"));
  }
  GridShape grid;
  grid.cells = counts;
  for (int c = 0; c < 3; ++c) {
    const double centre = (box.lo[c] + box.hi[c]) / 2;
    const double half = (box.hi[c] - box.lo[c]) / 2;
    grid.lo[c] = centre - half * (1 + padding);
    grid.hi[c] = centre + half * (1 + padding);
  }
  return Checked(grid);
}

absl::StatusOr<GridShape> GridFromCubes(const Box3& box, uint32_t n) {
  if (absl::Status s = CheckBox(box); !s.ok()) return s;
  if (n == 0) return absl::InvalidArgumentError("0 cubes along the longest side; 1 or more expected");
  double longest = 0;
  for (int c = 0; c < 3; ++c) longest = std::max(longest, box.hi[c] - box.lo[c]);
  const double side = (1 + kDefaultGridPadding) * longest / n;
  GridShape grid;
  for (int c = 0; c < 3; ++c) {
    const double centre = (box.lo[c] + box.hi[c]) / 2;
    const double count = std::max(1.0, std::ceil((box.hi[c] - box.lo[c]) / side));  // At most n.
    grid.cells[c] = static_cast<uint32_t>(count);
    grid.lo[c] = centre - side * count / 2;
    grid.hi[c] = centre + side * count / 2;
  }
  return Checked(grid);
}

absl::StatusOr<GridShape> GridAuto(const Box3& box, uint32_t about) {
  if (absl::Status s = CheckBox(box); !s.ok()) return s;
  if (about == 0) return absl::InvalidArgumentError("a grid of about 0 cells; 1 or more expected");
  const auto counts_at = [&box](double side) {
    std::array<uint32_t, 3> counts;
    for (int c = 0; c < 3; ++c) {
      counts[c] = static_cast<uint32_t>(std::max(1.0, std::round((box.hi[c] - box.lo[c]) / side)));
    }
    return counts;
  };
  const auto product = [](const std::array<uint32_t, 3>& n) { return double{1} * n[0] * n[1] * n[2]; };
  // The number of cells never grows with the side: bisect between a side that gives at least that many and
  // one that gives a single cell, with plain arithmetic only, so that every machine finds the same counts.
  double longest = 0;
  for (int c = 0; c < 3; ++c) longest = std::max(longest, box.hi[c] - box.lo[c]);
  double fine = longest / about, coarse = longest;
  for (int step = 0; step < 64; ++step) {
    const double middle = (fine + coarse) / 2;
    (product(counts_at(middle)) >= about ? fine : coarse) = middle;
  }
  const std::array<uint32_t, 3> more = counts_at(fine), fewer = counts_at(coarse);
  return GridFromCounts(box, product(more) - about < about - product(fewer) ? more : fewer);
}

int FinestNumberedLevel(const GridShape& grid) {
  int level = 0;
  for (; level < kMostLevels; ++level) {
    double points = 1;
    for (uint32_t n : grid.cells) points *= std::ldexp(static_cast<double>(n), level + 1) + 1;
    if (points >= 0x1p62) break;
  }
  return level;
}

absl::Status CheckDepth(const GridShape& grid, int depth) {
  const int numbered = FinestNumberedLevel(grid);
  int distinct = numbered;
  for (int c = 0; c < 3; ++c) {
    const double step = (grid.hi[c] - grid.lo[c]) / grid.cells[c];
    while (distinct > 0 && !(std::ldexp(step, -distinct) > LeastSide(grid, c))) --distinct;
  }
  if (depth <= distinct) return absl::OkStatus();
  return absl::OutOfRangeError(absl::StrCat(
      "depth ", depth, " is too deep: on a grid of ", grid.cells[0], "x", grid.cells[1], "x", grid.cells[2],
      distinct == numbered ? " numbers in files reach level " : " coordinates tell corners apart to level ",
      distinct));
}

}  // namespace ndmap

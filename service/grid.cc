// SPDX-License-Identifier: GPL-3.0-or-later
#include "service/grid.h"

#include <cmath>

#include "absl/strings/str_cat.h"

namespace ndmap::service {
namespace {

// An assignment takes memory and time by the cell; more hexahedra come by refinement.
constexpr uint64_t kMaxInitialCells = uint64_t{1} << 26;

}  // namespace

absl::StatusOr<GridShape> GridFromWire(const v1::Grid& grid) {
  if (grid.cells_size() != 3 || grid.lo_size() != 3 || grid.hi_size() != 3) {
    return absl::InvalidArgumentError("a grid has three numbers each of cells, lo and hi");
  }
  GridShape shape;
  uint64_t count = 1;
  for (int i = 0; i < 3; ++i) {
    shape.cells[i] = grid.cells(i);
    shape.lo[i] = grid.lo(i);
    shape.hi[i] = grid.hi(i);
    if (!std::isfinite(shape.lo[i]) || !std::isfinite(shape.hi[i]) || shape.lo[i] >= shape.hi[i]) {
      return absl::InvalidArgumentError(
          absl::StrCat("the grid runs from ", shape.lo[i], " to ", shape.hi[i], " in axis ", i));
    }
    if (grid.cells(i) == 0 || grid.cells(i) > kMaxInitialCells / count) {
      return absl::InvalidArgumentError(absl::StrCat("a grid of ", grid.cells(0), "x", grid.cells(1), "x",
                                                     grid.cells(2), " cells; 1 to ", kMaxInitialCells,
                                                     " are allowed"));
    }
    count *= grid.cells(i);
  }
  return shape;
}

}  // namespace ndmap::service

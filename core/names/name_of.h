// SPDX-License-Identifier: GPL-3.0-or-later
// From a place in the lattice of an initial hexahedron to the id of the cell there, and back (docs/ids.md).
#pragma once

#include <array>

#include "absl/status/statusor.h"
#include "core/map/ids.h"
#include "core/names/initial_cells.h"

namespace ndmap {

// A box of the lattice: a cell's lowest corner, and how long it is along each axis: 0, or one common power of
// two. A vertex has no extent, an edge one axis, a face two, a hexahedron three.
struct LatticeBox {
  LatticePlace low;
  std::array<uint32_t, 3> extent{};

  friend bool operator==(const LatticeBox&, const LatticeBox&) = default;
};

// The id of the cell with this box. O(levels).
CellId NameOf(const InitialCells& initial, const LatticeBox& box);

// The box of a cell known by its path (n-cells and parts), in the frame of its id's initial hexahedron.
// O(levels).
LatticeBox BoxOf(const CellId& id);

}  // namespace ndmap

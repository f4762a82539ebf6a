// SPDX-License-Identifier: GPL-3.0-or-later
// From a place in the lattice of an initial hexahedron to the id of the cell there, and back (docs/ids.md).
#pragma once

#include <array>

#include "absl/status/statusor.h"
#include "core/map/ids.h"
#include "core/names/initial_cells.h"

namespace ndmap {

// The id of the cell with this box. O(levels).
CellId NameOf(const InitialCells& initial, const LatticeBox& box);

// The same of a box that is in the frame of its owner already.
CellId NameInOwner(const LatticeBox& owner);

// The box of a cell known by its path (n-cells and parts), in the frame of its id's initial hexahedron.
// O(levels).
LatticeBox BoxOf(const CellId& id);

}  // namespace ndmap

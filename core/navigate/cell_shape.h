// SPDX-License-Identifier: GPL-3.0-or-later
// Where a cell of a mesh is in space, exactly, so that every point of the mesh is in a cell and in several
// only if it is on their common boundary. The boundary of a cell is that of its faces, and a face, which need
// not be flat, is the fan of triangles from the one of its vertices that has the lowest id: the same
// triangles for the cells on both sides.
#pragma once

#include "core/geometry/surface.h"
#include "core/map/block.h"
#include "core/names/cell_names.h"

namespace ndmap {

// The boundary of the cell that `names` looked at last, which has this many darts: a closed surface.
// O(darts).
TriangleSurface BoundaryOf(Block3& block, const CellNames<Block3>& names, size_t darts);

// Whether the closed cell and the closed box (or point: lo == hi) have a point in common. Exact.
// O(darts log darts).
bool CellMeets(Block3& block, CellNames<Block3>& names, Block3::Types::Cell cell, const Box3& box);

}  // namespace ndmap

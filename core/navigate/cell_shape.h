// SPDX-License-Identifier: GPL-3.0-or-later
// Where a cell of a mesh is in space, exactly, so that every point of the mesh is in a cell and in several
// only if it is on their common boundary. The boundary of a cell is that of its faces, and a face, which need
// not be flat, is the fan of triangles from the one of its vertices that has the lowest id: the same
// triangles for the cells on both sides. A face of a map of dimension 2 is that fan.
#pragma once

#include "core/geometry/surface.h"
#include "core/map/block.h"
#include "core/names/cell_names.h"

namespace ndmap {

// The faces of the n-cell that `names` looked at last, which has this many darts: of a volume, a closed
// surface. O(darts).
template <class BlockT>
TriangleSurface FacesOf(BlockT& block, const CellNames<BlockT>& names, size_t darts);

// Whether the closed n-cell and the closed box (or point: lo == hi) have a point in common. Exact.
// O(darts log darts).
template <class BlockT>
bool CellMeets(BlockT& block, CellNames<BlockT>& names, typename BlockT::Types::Cell cell, const Box3& box);

}  // namespace ndmap

// SPDX-License-Identifier: GPL-3.0-or-later
// Numbers of points and cells in files, in maps made from meshes (docs/decisions/0006), and back to the ids
// of cells.
//
// A point's number is that of its place in the initial cell that its id names: the corners of the hexahedra
// of the finest level L for which all numbers have 64 bits, then the corners of a cell that is no hexahedron.
// A cell's number is that of its first finest part along the octree of its initial cell. Both follow from the
// id and from the number of initial cells, so pieces agree without asking each other.
#pragma once

#include <cstdint>
#include <optional>

#include "core/map/ids.h"

namespace ndmap {

class MeshNumbers {
 public:
  // `cells`: initial cells of the whole map, 1 to CellId::kMaxInitial + 1.
  explicit MeshNumbers(uint64_t cells);

  // The finest level of hexahedra that the numbers reach: 9 or more.
  int finest_level() const { return finest_; }

  // Nothing if the vertex, or the cell, is finer than the numbers reach, or the id is none of this mesh.
  // O(levels).
  std::optional<int64_t> OfVertex(const CellId& vertex) const;
  std::optional<int64_t> OfCell(const CellId& cell) const;

  // Back. Nothing when no vertex has the number; no cell the number and level. O(levels).
  std::optional<CellId> Vertex(int64_t number) const;
  std::optional<CellId> Cell(int64_t number, int level) const;

 private:
  // Corners of cells that are no hexahedra.
  static constexpr int64_t kRanks = 8;

  const uint64_t cells_;
  int finest_ = 0;
  // Places along an axis, in a hexahedron, in an initial cell of any kind.
  int64_t along_ = 2, lattice_ = 8, places_ = 16;
};

}  // namespace ndmap

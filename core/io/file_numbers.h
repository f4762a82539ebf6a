// SPDX-License-Identifier: GPL-3.0-or-later
// Numbers of points and hexahedra in files (docs/decisions/0006), and back to the ids of cells.
//
// The grid's corners at the finest level L for which all have 64-bit numbers form a lattice; a point's number
// is its number in it, a hexahedron's that of its first finest part along its octree. Both depend on the grid
// alone, so pieces agree without asking each other.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "core/geometry/grid_shape.h"
#include "core/map/ids.h"
#include "core/names/initial_cells.h"

namespace ndmap {

class FileNumbers {
 public:
  // A point of the lattice, by its three coordinates.
  using Lattice = std::array<int64_t, 3>;

  explicit FileNumbers(const GridShape& grid);

  // The finest level that the numbers reach (FinestNumberedLevel).
  int finest_level() const { return finest_; }

  // The lowest corner of a hexahedron of level finest_level() at most.
  Lattice LowCorner(const CellId& hexahedron) const;
  int64_t OfHexahedron(const CellId& hexahedron) const;
  int64_t OfPoint(const Lattice& at) const;
  // The vertex there. O(levels).
  CellId VertexAt(const Lattice& at) const;

  // Back. Nothing when no cell of this grid has the number (and level).
  std::optional<CellId> Vertex(int64_t number) const;
  std::optional<CellId> Hexahedron(int64_t number, int level) const;

 private:
  const std::array<uint32_t, 3> cells_;
  const int finest_;
  const GridCells initial_;
  // Points along the first two axes.
  int64_t nx_ = 0, ny_ = 0;
};

}  // namespace ndmap

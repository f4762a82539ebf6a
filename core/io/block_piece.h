// SPDX-License-Identifier: GPL-3.0-or-later
// Reads a block into a VTU piece, some hexahedra at a time, so that whoever hosts the block can do other
// things between.
//
// Numbers in files: the grid's corners at the finest level L for which all have 64-bit numbers form a
// lattice; a point's id is its number in it, a cell's id the number of its first finest cell along its
// octree. Both depend on the grid alone, so pieces agree without asking each other.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/types/span.h"
#include "core/algorithm/refine/frame.h"
#include "core/attributes/table.h"
#include "core/geometry/grid_shape.h"
#include "core/io/piece_fields.h"
#include "core/io/vtu_writer.h"
#include "core/map/block.h"
#include "core/names/initial_cells.h"

namespace ndmap {

enum class VtuCells {
  kHexahedra,  // VTK_HEXAHEDRON: eight corners; points of finer neighbours hang on edges and faces
  kPolyhedra,  // VTK_POLYHEDRON: every face and point of the map, so that neighbours share whole faces
};

class BlockPiece {
 public:
  BlockPiece(const GridShape& grid, VtuCells cells);

  // The finest level that the numbers of this grid reach (FinestNumberedLevel).
  int finest_level() const { return finest_; }

  // Reads up to `budget` hexahedra; true when all are read. ABORTED when the block changed since the first
  // call, OUT_OF_RANGE when a hexahedron is finer than the numbers reach. Given the block's attributes (then
  // at every call), those of vertices and hexahedra become fields; ABORTED as PieceFields says.
  absl::StatusOr<bool> Step(Block3& block, size_t budget, const AttributeStore* attributes = nullptr);

  // What was read; after Step() was true.
  const VtuPiece& piece() const { return piece_; }

 private:
  using Lcc = Block3::Lcc;
  using Dart = Block3::Dart;
  using Cell = Block3::Types::Cell;
  using Lattice = std::array<int64_t, 3>;

  absl::Status AddCell(Block3& block, Cell cell);
  absl::Status AddFaces(Block3& block, const Frame<Block3>& frame, const std::array<Lattice, 8>& corners,
                        const VtuCell& what);
  // The faces of a polyhedron, as AddPolyhedron() takes them.
  struct Faces {
    std::vector<int64_t> sizes, points;
  };
  // Adds the face of level `level` in which d leaves corner 0, or the parts into which it is split. Places on
  // the lattice follow from the corners and the vertices' levels alone: coordinates are rounded, and far from
  // the origin different points may differ by little more than that. O(darts of the face * levels).
  absl::Status AddFace(Lcc& map, Dart d, int level, const std::array<Lattice, 4>& corners, Faces& faces);
  // The vertices between two corners, where `darts` begin.
  absl::Status AddHanging(Lcc& map, const Lattice& from, const Lattice& to, absl::Span<const Dart> darts,
                          std::vector<int64_t>& points);
  // OUT_OF_RANGE if the middle is finer than the lattice.
  absl::Status Between(const Lattice& a, const Lattice& b, Lattice& middle) const;
  int64_t AddPoint(const Point3& point, const Lattice& at);
  // The id of the vertex there. O(levels).
  CellId VertexAt(const Lattice& at) const;

  const GridShape grid_;
  const GridCells initial_;
  const VtuCells cells_;
  int finest_ = 0;
  std::vector<Cell> todo_;
  bool begun_ = false;
  uint64_t version_ = 0;
  VtuPiece piece_;
  absl::flat_hash_map<int64_t, int64_t> point_of_id_;
  PieceFields on_points_{0};
  PieceFields on_cells_{3};
};

}  // namespace ndmap

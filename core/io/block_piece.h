// SPDX-License-Identifier: GPL-3.0-or-later
// Reads a block into a VTU piece, some hexahedra at a time, so that whoever hosts the block can do other
// things between.
// Points and cells have the numbers of file_numbers.h.
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
#include "core/io/file_numbers.h"
#include "core/io/piece_fields.h"
#include "core/io/vtu_writer.h"
#include "core/map/block.h"

namespace ndmap {

enum class VtuCells {
  kHexahedra,  // VTK_HEXAHEDRON: eight corners; points of finer neighbours hang on edges and faces
  kPolyhedra,  // VTK_POLYHEDRON: every face and point of the map, so that neighbours share whole faces
};

class BlockPiece {
 public:
  // `attributes`: which become fields, when Step() is given any.
  BlockPiece(const GridShape& grid, VtuCells cells, const ChosenAttributes& attributes = std::nullopt);

  // Reads up to `budget` hexahedra; true when all are read. ABORTED when the block changed since the first
  // call, OUT_OF_RANGE when a hexahedron is finer than the numbers reach. Given the block's attributes (then
  // at every call), the chosen ones of vertices and hexahedra become fields; ABORTED as PieceFields says.
  absl::StatusOr<bool> Step(Block3& block, size_t budget, const AttributeStore* attributes = nullptr);

  // What was read; after Step() was true.
  const VtuPiece& piece() const { return piece_; }

 private:
  using Lcc = Block3::Lcc;
  using Dart = Block3::Dart;
  using Cell = Block3::Types::Cell;
  using Lattice = FileNumbers::Lattice;

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

  const FileNumbers numbers_;
  const VtuCells cells_;
  std::vector<Cell> todo_;
  bool begun_ = false;
  uint64_t version_ = 0;
  VtuPiece piece_;
  absl::flat_hash_map<int64_t, int64_t> point_of_id_;
  PieceFields on_points_;
  PieceFields on_cells_;
};

}  // namespace ndmap

// SPDX-License-Identifier: GPL-3.0-or-later
// Reads a block of a map that was made from a mesh into a VTU piece, some cells at a time, so that whoever
// hosts the block can do other things between. Points and cells have the numbers of mesh_numbers.h, which
// follow from their ids.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/attributes/table.h"
#include "core/io/block_piece.h"
#include "core/io/mesh_numbers.h"
#include "core/io/piece_fields.h"
#include "core/io/vtu_writer.h"
#include "core/map/block.h"
#include "core/names/cell_names.h"

namespace ndmap {

// VtuCells::kHexahedra: a cell as its kind, with its corners alone; kPolyhedra: every cell as VTK_POLYHEDRON
// with every face and point of the map.
class NamedPiece {
 public:
  // `cells`: initial cells of the whole map. `attributes`: which become fields, when Step() is given any.
  NamedPiece(std::shared_ptr<const InitialCells> initial, uint64_t cells, VtuCells as,
             const ChosenAttributes& attributes = std::nullopt);

  // Reads up to `budget` cells; true when all are read. Errors and attributes as BlockPiece::Step has them.
  absl::StatusOr<bool> Step(Block3& block, size_t budget, const AttributeStore* attributes = nullptr);

  // What was read; after Step() was true.
  const VtuPiece& piece() const { return piece_; }

 private:
  using Cell = Block3::Types::Cell;

  absl::Status AddCell(Block3& block, Cell cell);
  // Of the cell that names_ looked at last, which has this many darts.
  absl::Status AddCorners(Block3& block, size_t darts, const VtuCell& what);
  absl::Status AddFaces(Block3& block, size_t darts, const VtuCell& what);
  // The point where dart `i` of the cell begins. OUT_OF_RANGE if it is finer than the numbers reach.
  absl::StatusOr<int64_t> AddPoint(Block3& block, size_t i);

  const std::shared_ptr<const InitialCells> initial_;
  const MeshNumbers numbers_;
  const VtuCells as_;
  std::unique_ptr<CellNames<Block3>> names_;
  std::vector<Cell> todo_;
  bool begun_ = false;
  uint64_t version_ = 0;
  CellKind kind_ = CellKind::kHexahedron;
  VtuPiece piece_;
  absl::flat_hash_map<int64_t, int64_t> point_of_id_;
  PieceFields on_points_;
  PieceFields on_cells_;
};

}  // namespace ndmap

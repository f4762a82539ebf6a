// SPDX-License-Identifier: GPL-3.0-or-later
// What pieces of meshes have in common, whatever their cells are: which cells a block's piece has, how they
// are copied into it, and what must hold of a piece that comes from outside. Used by mesh_piece.h and
// polygon_piece.h.
#pragma once

#include <cstdint>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "absl/types/span.h"
#include "core/geometry/surface.h"
#include "core/map/ids.h"

namespace ndmap::internal {

// Cells over shared points: those of cell c are corners[begins[c]] to corners[begins[c + 1] - 1].
struct CornerLists {
  uint64_t points = 0;
  absl::Span<const uint32_t> corners;
  absl::Span<const uint64_t> begins;

  uint64_t cells() const { return begins.size() - 1; }
  absl::Span<const uint32_t> Of(uint64_t cell) const {
    return corners.subspan(begins[cell], begins[cell + 1] - begins[cell]);
  }
};

// Finds the cells of pieces. What it was made from stays where it is.
class PieceCells {
 public:
  // The block of each cell, all below `block_count`. O(mesh): 8 bytes a point, 4 a corner and 8 a cell.
  PieceCells(const CornerLists& mesh, absl::Span<const uint32_t> block_of, uint32_t block_count);

  // The cells of the block and all others that have a point of one of them, ascending. O(they, and those at
  // their points).
  std::vector<uint32_t> Of(BlockId block) const;

 private:
  absl::Span<const uint32_t> CellsAt(uint32_t point) const;

  const CornerLists mesh_;
  // The cells at point p: at_point_[first_at_[p]] to at_point_[first_at_[p + 1]], ascending; of blocks alike.
  std::vector<uint64_t> first_at_;
  std::vector<uint32_t> at_point_;
  std::vector<uint64_t> first_in_;
  std::vector<uint32_t> in_block_;
};

// Copies corners, points, numbers and blocks of these cells of a mesh into an empty piece. O(they).
template <class Mesh, class Piece>
void CopyCells(const Mesh& mesh, absl::Span<const uint32_t> block_of, absl::Span<const uint32_t> cells,
               Piece* piece) {
  absl::flat_hash_map<uint32_t, uint32_t> point_of;
  for (uint32_t cell : cells) {
    piece->numbers.push_back(cell);
    piece->blocks.push_back(block_of[cell]);
    for (uint32_t point : mesh.Corners(cell)) {
      const auto [it, added] = point_of.try_emplace(point, static_cast<uint32_t>(piece->mesh.points.size()));
      if (added) piece->mesh.points.push_back(mesh.points[point]);
      piece->mesh.corners.push_back(it->second);
    }
    piece->mesh.begins.push_back(piece->mesh.corners.size());
  }
}

// A piece as it came, of cells that are called `name` ("cell", "face").
struct RawPiece {
  absl::string_view name;
  absl::Span<const Point3> points;
  absl::Span<const uint32_t> corners;
  absl::Span<const uint64_t> begins;
  absl::Span<const uint64_t> numbers;
  absl::Span<const uint32_t> blocks;
};

// Why a cell cannot be.
absl::Status BadCell(const RawPiece& piece, uint64_t cell, absl::string_view what);

// Whether the arrays have the sizes that they must have together, so that their entries may be looked at.
absl::Status CheckSizes(const RawPiece& piece);

// After CheckSizes(): indices in range, no point twice in a cell, numbers that ascend and fit in ids, blocks
// that are there, finite points, and at least one cell of `self`. O(size log corners).
absl::Status CheckCells(const RawPiece& piece, BlockId self, uint32_t block_count);

}  // namespace ndmap::internal

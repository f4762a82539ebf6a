// SPDX-License-Identifier: GPL-3.0-or-later
// What one block is told of a surface of polygons: its own faces and those that touch them, with their
// numbers in the whole surface and the blocks that have them. As mesh_piece.h for volumes: from it a block
// makes its part of the map, its labels and its names without asking anyone (core/algorithm/load,
// core/names/polygon_cells.h).
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "absl/types/span.h"
#include "core/map/ids.h"
#include "core/mesh/piece_cells.h"
#include "core/mesh/polygon_mesh.h"

namespace ndmap {

struct PolygonPiece {
  // The faces of the block and all others that have a point of one of them, by ascending number; `points` are
  // theirs.
  PolygonMesh mesh;
  // By face: its number in the whole surface, how many corners the faces before it have there, and its block.
  std::vector<uint64_t> numbers;
  std::vector<uint64_t> corners_before;
  std::vector<uint32_t> blocks;

  bool IsOwn(uint64_t face, BlockId self) const { return blocks[face] == self.value; }
};

// OK if the arrays fit together, whatever they hold otherwise: as of a MeshPiece, three corners at least,
// fewer than ids can count, and corner numbers that do not overlap and fit in labels. INVALID_ARGUMENT says
// what does not. O(size log corners).
absl::Status ValidatePiece(const PolygonPiece& piece, BlockId self, uint32_t block_count);

// Cuts a surface into pieces, one at a time. Surface and blocks stay where they are meanwhile.
class PolygonCutter {
 public:
  // The block of each face, all below `block_count`. O(surface): 8 bytes a point, 4 a corner and 8 a face.
  PolygonCutter(const PolygonMesh& mesh, absl::Span<const uint32_t> block_of, uint32_t block_count);

  // O(the piece, and the faces at its points).
  PolygonPiece Piece(BlockId block) const;

 private:
  const PolygonMesh& mesh_;
  const absl::Span<const uint32_t> block_of_;
  const internal::PieceCells cells_;
};

}  // namespace ndmap

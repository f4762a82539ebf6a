// SPDX-License-Identifier: GPL-3.0-or-later
// What one block is told of a mesh: its own cells and those that touch them, with their numbers in the whole
// mesh and the blocks that have them. From that a block makes its part of the map, its labels and its names
// without asking anyone (core/algorithm/load, core/names/mesh_cells.h), and nobody but who cuts the mesh ever
// has all of it.
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "absl/types/span.h"
#include "core/map/ids.h"
#include "core/mesh/piece_cells.h"
#include "core/mesh/volume_mesh.h"

namespace ndmap {

struct MeshPiece {
  // The cells of the block and all others that have a point of one of them, by ascending number; `points` are
  // theirs.
  VolumeMesh mesh;
  // By cell: its number in the whole mesh, and its block.
  std::vector<uint64_t> numbers;
  std::vector<uint32_t> blocks;

  bool IsOwn(uint64_t cell, BlockId self) const { return blocks[cell] == self.value; }
};

// OK if the arrays fit together, whatever they hold otherwise: indices in range, numbers that ascend and fit
// in ids, finite points, and at least one cell of `self`. INVALID_ARGUMENT says what does not. O(size).
absl::Status ValidatePiece(const MeshPiece& piece, BlockId self, uint32_t block_count);

// Cuts a mesh into pieces, one at a time. Mesh and blocks stay where they are meanwhile.
class MeshCutter {
 public:
  // The block of each cell, all below `block_count`. O(mesh): 8 bytes a point, 4 a corner and 8 a cell.
  MeshCutter(const VolumeMesh& mesh, absl::Span<const uint32_t> block_of, uint32_t block_count);

  // O(the piece, and the cells at its points).
  MeshPiece Piece(BlockId block) const;

 private:
  const VolumeMesh& mesh_;
  const absl::Span<const uint32_t> block_of_;
  const internal::PieceCells cells_;
};

}  // namespace ndmap

// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/mesh/mesh_piece.h"

namespace ndmap {

absl::Status ValidatePiece(const MeshPiece& piece, BlockId self, uint32_t block_count) {
  const VolumeMesh& mesh = piece.mesh;
  const internal::RawPiece raw{"cell", mesh.points, mesh.corners, mesh.begins, piece.numbers, piece.blocks};
  if (absl::Status status = internal::CheckSizes(raw); !status.ok()) return status;
  if (mesh.kinds.size() != piece.numbers.size()) {
    return absl::InvalidArgumentError(
        "a piece of a mesh whose arrays do not fit together: a kind for each cell");
  }
  for (uint64_t c = 0; c < mesh.cells(); ++c) {
    if (static_cast<unsigned>(mesh.kinds[c]) >= kCellKinds) return BadCell(raw, c, "is of no kind");
    if (mesh.begins[c + 1] - mesh.begins[c] != ShapeOf(mesh.kinds[c]).corners) {
      return BadCell(raw, c, "has not as many points as its kind has corners");
    }
  }
  return internal::CheckCells(raw, self, block_count);
}

MeshCutter::MeshCutter(const VolumeMesh& mesh, absl::Span<const uint32_t> block_of, uint32_t block_count)
    : mesh_(mesh),
      block_of_(block_of),
      cells_({mesh.points.size(), mesh.corners, mesh.begins}, block_of, block_count) {}

MeshPiece MeshCutter::Piece(BlockId block) const {
  const std::vector<uint32_t> cells = cells_.Of(block);
  MeshPiece piece;
  internal::CopyCells(mesh_, block_of_, cells, &piece);
  for (uint32_t cell : cells) piece.mesh.kinds.push_back(mesh_.kinds[cell]);
  return piece;
}

}  // namespace ndmap

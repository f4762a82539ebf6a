// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/mesh/polygon_piece.h"

namespace ndmap {
namespace {

// Labels count corners with 44 bits (core/algorithm/refine/label.h).
constexpr uint64_t kMostCorners = uint64_t{1} << 44;

}  // namespace

absl::Status ValidatePiece(const PolygonPiece& piece, BlockId self, uint32_t block_count) {
  const PolygonMesh& mesh = piece.mesh;
  const internal::RawPiece raw{"face", mesh.points, mesh.corners, mesh.begins, piece.numbers, piece.blocks};
  if (absl::Status status = internal::CheckSizes(raw); !status.ok()) return status;
  if (piece.corners_before.size() != piece.numbers.size()) {
    return absl::InvalidArgumentError(
        "a piece of a mesh whose arrays do not fit together: a corner number for each face");
  }
  uint64_t end = 0;
  for (uint64_t f = 0; f < mesh.faces(); ++f) {
    const uint64_t corners = mesh.begins[f + 1] - mesh.begins[f];
    if (corners < 3) return BadCell(raw, f, "has fewer than three corners");
    if (corners > CellId::kMaxRank) return BadCell(raw, f, "has more corners than ids can count");
    if (piece.corners_before[f] < end || piece.corners_before[f] > kMostCorners - corners) {
      return BadCell(raw, f, "has corner numbers that overlap or do not fit in a label");
    }
    end = piece.corners_before[f] + corners;
  }
  return internal::CheckCells(raw, self, block_count);
}

PolygonCutter::PolygonCutter(const PolygonMesh& mesh, absl::Span<const uint32_t> block_of,
                             uint32_t block_count)
    : mesh_(mesh),
      block_of_(block_of),
      cells_({mesh.points.size(), mesh.corners, mesh.begins}, block_of, block_count) {}

PolygonPiece PolygonCutter::Piece(BlockId block) const {
  const std::vector<uint32_t> faces = cells_.Of(block);
  PolygonPiece piece;
  internal::CopyCells(mesh_, block_of_, faces, &piece);
  for (uint32_t face : faces) piece.corners_before.push_back(mesh_.begins[face]);
  return piece;
}

}  // namespace ndmap

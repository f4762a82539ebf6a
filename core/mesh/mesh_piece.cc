// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/mesh/mesh_piece.h"

#include <algorithm>
#include <cmath>

#include "absl/container/flat_hash_map.h"
#include "absl/strings/str_cat.h"

namespace ndmap {

absl::Status ValidatePiece(const MeshPiece& piece, BlockId self, uint32_t block_count) {
  const VolumeMesh& mesh = piece.mesh;
  const uint64_t cells = mesh.cells();
  if (cells == 0 || piece.numbers.size() != cells || piece.blocks.size() != cells ||
      mesh.begins.size() != cells + 1 || mesh.begins.front() != 0 ||
      mesh.begins.back() != mesh.corners.size() || cells >= kNoCell || mesh.points.size() >= kNoCell) {
    return absl::InvalidArgumentError(
        absl::StrCat("a piece of a mesh whose arrays do not fit together: ", cells, " cells, ",
                     piece.numbers.size(), " numbers, ", piece.blocks.size(), " blocks"));
  }
  bool own = false;
  for (uint64_t c = 0; c < cells; ++c) {
    const auto bad = [&](const char* what) {
      return absl::InvalidArgumentError(absl::StrCat("cell ", c, " of a piece of a mesh ", what));
    };
    if (static_cast<unsigned>(mesh.kinds[c]) >= kCellKinds) return bad("is of no kind");
    if (mesh.begins[c + 1] - mesh.begins[c] != ShapeOf(mesh.kinds[c]).corners) {
      return bad("has not as many points as its kind has corners");
    }
    const absl::Span<const uint32_t> corners = mesh.Corners(c);
    for (size_t i = 0; i < corners.size(); ++i) {
      if (corners[i] >= mesh.points.size()) return bad("has a point that is not there");
      if (std::find(corners.begin(), corners.begin() + i, corners[i]) != corners.begin() + i) {
        return bad("has a point twice");
      }
    }
    if (piece.numbers[c] > CellId::kMaxInitial) return bad("has a number that does not fit in an id");
    if (c > 0 && piece.numbers[c] <= piece.numbers[c - 1]) return bad("is out of order");
    if (piece.blocks[c] >= block_count) return bad("is in a block that is not there");
    own = own || piece.blocks[c] == self.value;
  }
  if (!own) return absl::InvalidArgumentError("a piece of a mesh without a cell of its block");
  for (const Point3& p : mesh.points) {
    if (!std::isfinite(p[0]) || !std::isfinite(p[1]) || !std::isfinite(p[2])) {
      return absl::InvalidArgumentError("a point of a mesh that is not finite");
    }
  }
  return absl::OkStatus();
}

MeshCutter::MeshCutter(const VolumeMesh& mesh, absl::Span<const uint32_t> block_of, uint32_t block_count)
    : mesh_(mesh), block_of_(block_of), first_at_(mesh.points.size() + 1, 0), first_in_(block_count + 1, 0) {
  for (uint32_t point : mesh.corners) ++first_at_[point + 1];
  for (uint32_t block : block_of) ++first_in_[block + 1];
  for (size_t i = 1; i < first_at_.size(); ++i) first_at_[i] += first_at_[i - 1];
  for (size_t i = 1; i < first_in_.size(); ++i) first_in_[i] += first_in_[i - 1];
  at_point_.resize(mesh.corners.size());
  in_block_.resize(block_of.size());
  std::vector<uint64_t> next_at(first_at_.begin(), first_at_.end() - 1);
  std::vector<uint64_t> next_in(first_in_.begin(), first_in_.end() - 1);
  for (uint64_t c = 0; c < mesh.cells(); ++c) {
    in_block_[next_in[block_of[c]]++] = static_cast<uint32_t>(c);
    for (uint32_t point : mesh.Corners(c)) at_point_[next_at[point]++] = static_cast<uint32_t>(c);
  }
}

absl::Span<const uint32_t> MeshCutter::CellsAt(uint32_t point) const {
  return absl::MakeConstSpan(at_point_).subspan(first_at_[point], first_at_[point + 1] - first_at_[point]);
}

MeshPiece MeshCutter::Piece(BlockId block) const {
  std::vector<uint32_t> cells;
  for (uint64_t i = first_in_[block.value]; i < first_in_[block.value + 1]; ++i) {
    for (uint32_t point : mesh_.Corners(in_block_[i])) {
      const auto at = CellsAt(point);
      cells.insert(cells.end(), at.begin(), at.end());
    }
    // Most come several times; they must not take several times the memory.
    if (cells.size() > 1 << 20 && cells.size() == cells.capacity()) {
      std::sort(cells.begin(), cells.end());
      cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
    }
  }
  std::sort(cells.begin(), cells.end());
  cells.erase(std::unique(cells.begin(), cells.end()), cells.end());

  MeshPiece piece;
  absl::flat_hash_map<uint32_t, uint32_t> point_of;
  for (uint32_t cell : cells) {
    piece.numbers.push_back(cell);
    piece.blocks.push_back(block_of_[cell]);
    piece.mesh.kinds.push_back(mesh_.kinds[cell]);
    for (uint32_t point : mesh_.Corners(cell)) {
      const auto [it, added] = point_of.try_emplace(point, static_cast<uint32_t>(piece.mesh.points.size()));
      if (added) piece.mesh.points.push_back(mesh_.points[point]);
      piece.mesh.corners.push_back(it->second);
    }
    piece.mesh.begins.push_back(piece.mesh.corners.size());
  }
  return piece;
}

}  // namespace ndmap

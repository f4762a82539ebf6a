// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/mesh/piece_cells.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "core/mesh/volume_mesh.h"

namespace ndmap::internal {

PieceCells::PieceCells(const CornerLists& mesh, absl::Span<const uint32_t> block_of, uint32_t block_count)
    : mesh_(mesh), first_at_(mesh.points + 1, 0), first_in_(block_count + 1, 0) {
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
    for (uint32_t point : mesh.Of(c)) at_point_[next_at[point]++] = static_cast<uint32_t>(c);
  }
}

absl::Span<const uint32_t> PieceCells::CellsAt(uint32_t point) const {
  return absl::MakeConstSpan(at_point_).subspan(first_at_[point], first_at_[point + 1] - first_at_[point]);
}

std::vector<uint32_t> PieceCells::Of(BlockId block) const {
  std::vector<uint32_t> cells;
  for (uint64_t i = first_in_[block.value]; i < first_in_[block.value + 1]; ++i) {
    for (uint32_t point : mesh_.Of(in_block_[i])) {
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
  return cells;
}

absl::Status BadCell(const RawPiece& piece, uint64_t cell, absl::string_view what) {
  return absl::InvalidArgumentError(absl::StrCat(piece.name, " ", cell, " of a piece of a mesh ", what));
}

absl::Status CheckSizes(const RawPiece& piece) {
  const uint64_t cells = piece.numbers.size();
  if (cells == 0 || piece.blocks.size() != cells || piece.begins.size() != cells + 1 ||
      piece.begins.front() != 0 || piece.begins.back() != piece.corners.size() || cells >= kNoCell ||
      piece.points.size() >= kNoCell || !std::is_sorted(piece.begins.begin(), piece.begins.end())) {
    return absl::InvalidArgumentError(
        absl::StrCat("a piece of a mesh whose arrays do not fit together: ", piece.begins.size(), " ends of ",
                     piece.name, "s, ", cells, " numbers, ", piece.blocks.size(), " blocks"));
  }
  return absl::OkStatus();
}

absl::Status CheckCells(const RawPiece& piece, BlockId self, uint32_t block_count) {
  bool own = false;
  std::vector<uint32_t> sorted;
  for (uint64_t c = 0; c < piece.numbers.size(); ++c) {
    const auto corners = piece.corners.subspan(piece.begins[c], piece.begins[c + 1] - piece.begins[c]);
    sorted.assign(corners.begin(), corners.end());
    std::sort(sorted.begin(), sorted.end());
    if (!sorted.empty() && sorted.back() >= piece.points.size()) {
      return BadCell(piece, c, "has a point that is not there");
    }
    if (std::adjacent_find(sorted.begin(), sorted.end()) != sorted.end()) {
      return BadCell(piece, c, "has a point twice");
    }
    if (piece.numbers[c] > CellId::kMaxInitial) {
      return BadCell(piece, c, "has a number that does not fit in an id");
    }
    if (c > 0 && piece.numbers[c] <= piece.numbers[c - 1]) return BadCell(piece, c, "is out of order");
    if (piece.blocks[c] >= block_count) return BadCell(piece, c, "is in a block that is not there");
    own = own || piece.blocks[c] == self.value;
  }
  if (!own) {
    return absl::InvalidArgumentError(
        absl::StrCat("a piece of a mesh without a ", piece.name, " of its block"));
  }
  for (const Point3& p : piece.points) {
    if (!std::isfinite(p[0]) || !std::isfinite(p[1]) || !std::isfinite(p[2])) {
      return absl::InvalidArgumentError("a point of a mesh that is not finite");
    }
  }
  return absl::OkStatus();
}

}  // namespace ndmap::internal

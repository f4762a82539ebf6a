// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/io/file_numbers.h"

#include "core/names/name_of.h"

namespace ndmap {

FileNumbers::FileNumbers(const GridShape& grid)
    : cells_(grid.cells), finest_(FinestNumberedLevel(grid)), initial_(grid.cells) {
  nx_ = (int64_t{cells_[0]} << finest_) + 1;
  ny_ = (int64_t{cells_[1]} << finest_) + 1;
}

FileNumbers::Lattice FileNumbers::LowCorner(const CellId& hexahedron) const {
  const uint64_t number = hexahedron.initial();
  Lattice at = {static_cast<int64_t>(number % cells_[0]),
                static_cast<int64_t>(number / cells_[0] % cells_[1]),
                static_cast<int64_t>(number / cells_[0] / cells_[1])};
  const int level = hexahedron.level();
  for (int i = 1; i <= level; ++i) {
    const unsigned digit = hexahedron.digit(i);
    for (int c = 0; c < 3; ++c) at[c] = 2 * at[c] + (digit >> c & 1);
  }
  for (int64_t& x : at) x <<= finest_ - level;
  return at;
}

int64_t FileNumbers::OfHexahedron(const CellId& hexahedron) const {
  int64_t number = static_cast<int64_t>(hexahedron.initial());
  const int level = hexahedron.level();
  for (int i = 1; i <= level; ++i) number = 8 * number + hexahedron.digit(i);
  return number << 3 * (finest_ - level);
}

int64_t FileNumbers::OfPoint(const Lattice& at) const { return at[0] + nx_ * (at[1] + ny_ * at[2]); }

CellId FileNumbers::VertexAt(const Lattice& at) const {
  LatticeBox box;
  uint64_t stride = 1;
  for (int c = 0; c < 3; ++c) {
    int64_t cell = at[c] >> finest_;
    int64_t rest = at[c] - (cell << finest_);
    if (cell == cells_[c]) {  // The grid's last corner is the high end of the last cell.
      --cell;
      rest = int64_t{1} << finest_;
    }
    box.low.initial += stride * static_cast<uint64_t>(cell);
    box.low.at[c] = static_cast<uint32_t>(rest << (LatticePlace::kFinestLevel - finest_));
    stride *= cells_[c];
  }
  return NameOf(initial_, box);
}

std::optional<CellId> FileNumbers::Vertex(int64_t number) const {
  if (number < 0) return std::nullopt;
  const Lattice at = {number % nx_, number / nx_ % ny_, number / nx_ / ny_};
  if (at[2] > int64_t{cells_[2]} << finest_) return std::nullopt;
  return VertexAt(at);
}

std::optional<CellId> FileNumbers::Hexahedron(int64_t number, int level) const {
  if (number < 0 || level < 0 || level > finest_) return std::nullopt;
  const int below = 3 * (finest_ - level);
  const int64_t path = number >> below;
  if (path << below != number) return std::nullopt;
  const auto initial = static_cast<uint64_t>(path >> 3 * level);
  if (initial >= uint64_t{cells_[0]} * cells_[1] * cells_[2]) return std::nullopt;
  CellId id = CellId::Initial(initial);
  for (int i = level - 1; i >= 0; --i) id = id.Child(static_cast<unsigned>(path >> 3 * i & 7));
  return id;
}

}  // namespace ndmap

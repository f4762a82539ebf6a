// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/io/mesh_numbers.h"

#include <cmath>

#include "core/names/name_of.h"

namespace ndmap {

MeshNumbers::MeshNumbers(uint64_t cells) : cells_(cells) {
  const auto along = [](int level) { return (int64_t{1} << level) + 1; };
  while (finest_ < CellId::kMaxLevel) {
    const double places = std::pow(static_cast<double>(along(finest_ + 1)), 3) + kRanks;
    if (places * static_cast<double>(cells) >= 0x1p62) break;
    ++finest_;
  }
  along_ = along(finest_);
  lattice_ = along_ * along_ * along_;
  places_ = lattice_ + kRanks;
}

std::optional<int64_t> MeshNumbers::OfVertex(const CellId& vertex) const {
  if (vertex.initial() >= cells_) return std::nullopt;
  const auto first = static_cast<int64_t>(vertex.initial()) * places_;
  if (vertex.is_rank()) {
    if (vertex.dimension() != 0 || vertex.rank() >= kRanks) return std::nullopt;
    return first + lattice_ + vertex.rank();
  }
  if (!vertex.is_part() || vertex.dimension() != 0) return std::nullopt;
  const LatticePlace place = BoxOf(vertex).low;
  const int below = LatticePlace::kFinestLevel - finest_;
  std::array<int64_t, 3> at;
  for (int c = 0; c < 3; ++c) {
    at[c] = place.at[c] >> below;
    if (static_cast<uint32_t>(at[c]) << below != place.at[c]) return std::nullopt;
  }
  return first + at[0] + along_ * (at[1] + along_ * at[2]);
}

std::optional<int64_t> MeshNumbers::OfCell(const CellId& cell) const {
  if (!cell.is_cell() || cell.initial() >= cells_ || cell.level() > finest_) return std::nullopt;
  auto number = static_cast<int64_t>(cell.initial());
  for (int i = 1; i <= cell.level(); ++i) number = 8 * number + cell.digit(i);
  return number << 3 * (finest_ - cell.level());
}

std::optional<CellId> MeshNumbers::Vertex(int64_t number) const {
  if (number < 0 || static_cast<uint64_t>(number / places_) >= cells_) return std::nullopt;
  const auto initial = static_cast<uint64_t>(number / places_);
  const int64_t place = number % places_;
  if (place >= lattice_) return CellId::Rank(initial, 0, static_cast<uint32_t>(place - lattice_));
  LatticeBox box;
  box.low.initial = initial;
  const int below = LatticePlace::kFinestLevel - finest_;
  const std::array<int64_t, 3> at = {place % along_, place / along_ % along_, place / along_ / along_};
  for (int c = 0; c < 3; ++c) box.low.at[c] = static_cast<uint32_t>(at[c] << below);
  return NameInOwner(box);
}

std::optional<CellId> MeshNumbers::Cell(int64_t number, int level) const {
  if (number < 0 || level < 0 || level > finest_) return std::nullopt;
  const int below = 3 * (finest_ - level);
  const int64_t path = number >> below;
  if (path << below != number) return std::nullopt;
  const auto initial = static_cast<uint64_t>(path >> 3 * level);
  if (initial >= cells_) return std::nullopt;
  CellId id = CellId::Initial(initial);
  for (int i = level - 1; i >= 0; --i) id = id.Child(static_cast<unsigned>(path >> 3 * i & 7));
  return id;
}

}  // namespace ndmap

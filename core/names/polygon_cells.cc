// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/names/polygon_cells.h"

#include <algorithm>
#include <utility>

#include "absl/container/flat_hash_map.h"
#include "absl/strings/str_cat.h"

namespace ndmap {

absl::StatusOr<std::shared_ptr<const PolygonCells>> PolygonCells::Make(PolygonPiece piece, BlockId self,
                                                                       uint32_t block_count) {
  if (absl::Status status = ValidatePiece(piece, self, block_count); !status.ok()) return status;
  std::shared_ptr<PolygonCells> cells(new PolygonCells(std::move(piece), self));
  if (absl::Status status = cells->Link(); !status.ok()) return status;
  cells->EnterCorners();
  return cells;
}

absl::Status PolygonCells::Link() {
  // Sides by the points that they run between.
  absl::flat_hash_map<std::pair<uint32_t, uint32_t>, SideLink> side_of;
  const auto faces = static_cast<uint32_t>(surface().faces());
  const auto ends = [this](uint32_t face, uint32_t side) {
    const auto corners = surface().Corners(face);
    return std::pair(corners[side], corners[side + 1 < corners.size() ? side + 1 : 0]);
  };
  for (uint32_t f = 0; f < faces; ++f) {
    for (uint32_t i = 0; i < CornerCount(f); ++i) {
      const auto [it, added] = side_of.try_emplace(ends(f, i), SideLink{f, i});
      if (added || (!IsOwn(f) && !IsOwn(it->second.face))) continue;
      return absl::InvalidArgumentError(absl::StrCat("faces ", piece_.numbers[it->second.face], " and ",
                                                     piece_.numbers[f],
                                                     " of the mesh run an edge in the same direction"));
    }
  }
  links_.resize(surface().corners.size());
  for (uint32_t f = 0; f < faces; ++f) {
    if (!IsOwn(f)) continue;
    ++own_faces_;
    for (uint32_t i = 0; i < CornerCount(f); ++i) {
      const auto [from, to] = ends(f, i);
      const auto beyond = side_of.find({to, from});
      if (beyond != side_of.end()) links_[surface().begins[f] + i] = beyond->second;
    }
  }
  return absl::OkStatus();
}

void PolygonCells::EnterCorners() {
  const auto faces = static_cast<uint32_t>(surface().faces());
  owner_.resize(surface().points.size());
  first_at_.assign(surface().points.size() + 1, 0);
  const auto for_corners = [&](auto f) {
    for (uint32_t face = 0; face < faces; ++face) {
      for (uint32_t i = 0; i < CornerCount(face); ++i) f(surface().Corners(face)[i], SideLink{face, i});
    }
  };
  for_corners([this](uint32_t point, const SideLink& corner) {
    if (owner_[point].face == kNoCell) owner_[point] = corner;
    if (IsOwn(corner.face)) ++first_at_[point + 1];
  });
  for (size_t i = 1; i < first_at_.size(); ++i) first_at_[i] += first_at_[i - 1];
  own_at_.resize(first_at_.back());
  std::vector<uint64_t> next(first_at_.begin(), first_at_.end() - 1);
  for_corners([&](uint32_t point, const SideLink& corner) {
    if (IsOwn(corner.face)) own_at_[next[point]++] = corner;
  });
}

uint32_t PolygonCells::FaceOf(uint64_t number) const {
  const auto it = std::lower_bound(piece_.numbers.begin(), piece_.numbers.end(), number);
  if (it == piece_.numbers.end() || *it != number) return kNoCell;
  return static_cast<uint32_t>(it - piece_.numbers.begin());
}

CellId PolygonCells::VertexName(uint32_t face, uint32_t corner) const {
  const SideLink& owner = owner_[surface().Corners(face)[corner]];
  return CellId::Rank(piece_.numbers[owner.face], 0, owner.side);
}

uint64_t PolygonCells::VertexNumber(uint32_t face, uint32_t corner) const {
  const SideLink& owner = owner_[surface().Corners(face)[corner]];
  return piece_.corners_before[owner.face] + owner.side;
}

CellId PolygonCells::EdgeName(uint32_t face, uint32_t side) const {
  const SideLink& beyond = Beyond(face, side);
  if (beyond.boundary() || face < beyond.face) return CellId::Rank(piece_.numbers[face], 1, side);
  return CellId::Rank(piece_.numbers[beyond.face], 1, beyond.side);
}

PolygonCells::Place PolygonCells::Find(const CellId& id) const {
  const uint32_t face = FaceOf(id.initial());
  if (face == kNoCell || !id.is_rank() || id.dimension() > 1 || id.rank() >= CornerCount(face)) return {};
  Place place;
  const uint32_t from = surface().Corners(face)[id.rank()];
  const auto own =
      absl::MakeConstSpan(own_at_).subspan(first_at_[from], first_at_[from + 1] - first_at_[from]);
  if (id.dimension() == 0) {
    place.at.assign(own.begin(), own.end());
    if (!own.empty()) place.id = VertexName(own[0].face, own[0].side);
    return place;
  }
  // The own faces that have the side or what lies beyond it have a corner where it begins.
  for (const SideLink& corner : own) {
    const uint32_t count = CornerCount(corner.face);
    const SideLink before{corner.face, (corner.side + count - 1) % count};
    const SideLink wanted{face, id.rank()};
    if (corner == wanted) place.at.push_back(corner);
    if (Beyond(before.face, before.side) == wanted) place.at.push_back(before);
  }
  if (!place.at.empty()) place.id = EdgeName(place.at[0].face, place.at[0].side);
  return place;
}

}  // namespace ndmap

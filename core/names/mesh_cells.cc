// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/names/mesh_cells.h"

#include <algorithm>
#include <utility>

#include "absl/container/flat_hash_map.h"
#include "absl/strings/str_cat.h"
#include "core/names/name_of.h"

namespace ndmap {
namespace {

constexpr uint32_t kSide = LatticePlace::kSide;
// The part of a hexahedron with this digit (0 low, 1 high, 2 along) for each axis; there are 26.
unsigned PartOfDigits(const std::array<unsigned, 3>& digit) {
  const CellDarts& hexahedron = DartsOf(CellKind::kHexahedron);
  const auto [x, y, z] = digit;
  const int along = (x == 2) + (y == 2) + (z == 2);
  if (along == 0) return x + 2 * y + 4 * z;
  if (along == 1) return hexahedron.edge_part(x == 2 ? y + 2 * z : y == 2 ? 4 + x + 2 * z : 8 + x + 2 * y);
  return hexahedron.face_part(z != 2 ? z : y != 2 ? 2 + y : 4 + x);
}

}  // namespace

absl::StatusOr<std::shared_ptr<const MeshCells>> MeshCells::Make(MeshPiece piece, BlockId self,
                                                                 uint32_t block_count) {
  if (absl::Status status = ValidatePiece(piece, self, block_count); !status.ok()) return status;
  std::shared_ptr<MeshCells> cells(new MeshCells(std::move(piece), self));
  cells->MakePlaces();
  if (absl::Status status = cells->EnterSides(); !status.ok()) return status;
  return cells;
}

void MeshCells::MakePlaces() {
  const uint64_t count = piece_.mesh.cells();
  first_part_.resize(count + 1, 0);
  for (uint32_t c = 0; c < count; ++c) {
    first_part_[c + 1] = first_part_[c] + Shape(c).parts();
    own_cells_ += IsOwn(c) ? 1 : 0;
  }
  place_of_.assign(first_part_.back(), kNoPlace);
  EnterParts(0, [this](uint32_t cell, const CellDarts&, unsigned corner) { return Point(cell, corner); });
  EnterParts(1, [this](uint32_t cell, const CellDarts& shape, unsigned edge) {
    const uint32_t a = Point(cell, shape.edge[edge][0]), b = Point(cell, shape.edge[edge][1]);
    return uint64_t{std::min(a, b)} << 32 | std::max(a, b);
  });
  first_face_ = static_cast<uint32_t>(places_.size());
  EnterParts(2, [this](uint32_t cell, const CellDarts& shape, unsigned face) {
    std::array<uint32_t, kMostFaceCorners> points = {kNoPoint, kNoPoint, kNoPoint, kNoPoint};
    for (unsigned k = 0; k < shape.face_darts(face); ++k) {
      points[k] = Point(cell, shape.start[shape.begin[face] + k]);
    }
    std::sort(points.begin(), points.end());
    return points;
  });

  first_at_.assign(places_.size() + 1, 0);
  const auto for_own = [&](auto f) {
    for (uint32_t c = 0; c < count; ++c) {
      for (uint64_t p = first_part_[c]; IsOwn(c) && p < first_part_[c + 1]; ++p) f(c, place_of_[p]);
    }
  };
  for_own([this](uint32_t, uint32_t place) { ++first_at_[place + 1]; });
  for (size_t i = 1; i < first_at_.size(); ++i) first_at_[i] += first_at_[i - 1];
  own_at_.resize(first_at_.back());
  std::vector<uint64_t> next(first_at_.begin(), first_at_.end() - 1);
  for_own([&](uint32_t cell, uint32_t place) { own_at_[next[place]++] = cell; });
}

template <class Key>
void MeshCells::EnterParts(unsigned dimension, Key key) {
  using Name = decltype(key(0u, Shape(0), 0u));
  absl::flat_hash_map<Name, uint32_t> place_of;
  const auto for_parts = [&](uint32_t cell, auto f) {
    const CellDarts& shape = Shape(cell);
    for (unsigned p = 0; p < shape.parts(); ++p) {
      if (shape.dimension_of_part(p) == dimension) f(p, key(cell, shape, shape.number_of_part(p)));
    }
  };
  const auto count = static_cast<uint32_t>(piece_.mesh.cells());
  for (uint32_t c = 0; c < count; ++c) {
    if (!IsOwn(c)) continue;
    for_parts(c, [&](unsigned, const Name& name) {
      if (place_of.try_emplace(name, static_cast<uint32_t>(places_.size())).second) places_.emplace_back();
    });
  }
  for (uint32_t c = 0; c < count; ++c) {
    for_parts(c, [&](unsigned part, const Name& name) {
      const auto found = place_of.find(name);
      if (found == place_of.end()) return;
      place_of_[first_part_[c] + part] = found->second;
      Shared& shared = places_[found->second];
      const bool hexahedron = kind(c) == CellKind::kHexahedron;
      if (shared.owner == kNoCell || (hexahedron && kind(shared.owner) != CellKind::kHexahedron)) {
        shared = {c, static_cast<uint8_t>(part)};
      }
    });
  }
}

absl::Status MeshCells::EnterSides() {
  sides_.resize(places_.size() - first_face_);
  const auto count = static_cast<uint32_t>(piece_.mesh.cells());
  for (uint32_t c = 0; c < count; ++c) {
    const CellDarts& shape = Shape(c);
    for (unsigned f = 0; f < shape.faces; ++f) {
      const uint32_t place = PlaceOf(c, shape.face_part(f));
      if (place == kNoPlace) continue;
      std::array<Side, 2>& sides = sides_[place - first_face_];
      if (sides[1].cell != kNoCell) {
        return absl::InvalidArgumentError(absl::StrCat(
            "cells ", piece_.numbers[sides[0].cell], ", ", piece_.numbers[sides[1].cell], " and ",
            piece_.numbers[c], " of the mesh have one face together, expected at most two"));
      }
      (sides[0].cell == kNoCell ? sides[0] : sides[1]) = {c, static_cast<uint8_t>(f)};
    }
  }
  for (uint32_t c = 0; c < count; ++c) {
    for (unsigned f = 0; IsOwn(c) && f < Shape(c).faces; ++f) {
      if (absl::Status status = CheckSide(c, f); !status.ok()) return status;
    }
  }
  return absl::OkStatus();
}

absl::Status MeshCells::CheckSide(uint32_t cell, unsigned face) const {
  const Side beyond = Beyond(cell, face);
  if (beyond.cell == kNoCell) return absl::OkStatus();
  const CellDarts& shape = Shape(cell);
  for (unsigned d = shape.begin[face]; d < shape.begin[face + 1]; ++d) {
    if (DartBeyond(cell, d, beyond) != CellDarts::kMostDarts) continue;
    return absl::InvalidArgumentError(absl::StrCat("cells ", piece_.numbers[cell], " and ",
                                                   piece_.numbers[beyond.cell],
                                                   " of the mesh do not list their face in opposite "
                                                   "directions"));
  }
  return absl::OkStatus();
}

uint32_t MeshCells::CellOf(uint64_t number) const {
  const auto it = std::lower_bound(piece_.numbers.begin(), piece_.numbers.end(), number);
  if (it == piece_.numbers.end() || *it != number) return kNoCell;
  return static_cast<uint32_t>(it - piece_.numbers.begin());
}

MeshCells::Side MeshCells::Beyond(uint32_t cell, unsigned face) const {
  const std::array<Side, 2>& sides = sides_[PlaceOf(cell, Shape(cell).face_part(face)) - first_face_];
  return sides[0].cell == cell ? sides[1] : sides[0];
}

unsigned MeshCells::DartBeyond(uint32_t cell, unsigned dart, const Side& beyond) const {
  const CellDarts& shape = Shape(cell);
  const CellDarts& other = Shape(beyond.cell);
  const uint32_t start = Point(cell, shape.start[dart]), end = Point(cell, shape.end(dart));
  for (unsigned d = other.begin[beyond.face]; d < other.begin[beyond.face + 1]; ++d) {
    if (Point(beyond.cell, other.start[d]) == end && Point(beyond.cell, other.end(d)) == start) return d;
  }
  return CellDarts::kMostDarts;
}

MeshCells::Located MeshCells::Locate(uint32_t hexahedron, const LatticeBox& box) const {
  std::array<unsigned, 3> digit;
  std::array<unsigned, 2> along{};
  unsigned count = 0, corner = 0;
  for (unsigned c = 0; c < 3; ++c) {
    const bool across = box.extent[c] == 0;
    digit[c] = across && box.low.at[c] == 0 ? 0 : across && box.low.at[c] == kSide ? 1 : 2;
    if (digit[c] == 1) corner |= 1u << c;
    if (digit[c] == 2 && count < 2) along[count] = c;
    if (digit[c] == 2) ++count;
  }
  Located located;
  located.inside = count == 3;
  if (located.inside) return located;
  located.box.part = static_cast<uint8_t>(PartOfDigits(digit));
  located.marks = {Point(hexahedron, corner), kNoPoint, kNoPoint};
  for (unsigned i = 0; i < count; ++i) {
    located.box.low[i] = box.low.at[along[i]];
    located.box.extent[i] = box.extent[along[i]];
    located.marks[i + 1] = Point(hexahedron, corner | 1u << along[i]);
  }
  return located;
}

MeshCells::Marks MeshCells::MarksOf(uint32_t cell, unsigned part) const {
  const CellDarts& shape = Shape(cell);
  const unsigned number = shape.number_of_part(part);
  switch (shape.dimension_of_part(part)) {
    case 0:
      return {Point(cell, number), kNoPoint, kNoPoint};
    case 1:
      return {Point(cell, shape.edge[number][0]), Point(cell, shape.edge[number][1]), kNoPoint};
    default: {
      const unsigned first = shape.begin[number], last = shape.begin[number + 1] - 1u;
      return {Point(cell, shape.start[first]), Point(cell, shape.end(first)), Point(cell, shape.start[last])};
    }
  }
}

LatticeBox MeshCells::InFrame(uint32_t hexahedron, const PartBox& box, const Marks& marks) const {
  const auto corner_at = [&](uint32_t point) {
    unsigned c = 0;
    while (c < 7 && Point(hexahedron, c) != point) ++c;
    return c;
  };
  const unsigned first = corner_at(marks[0]);
  LatticeBox result;
  result.low.initial = piece_.numbers[hexahedron];
  for (unsigned c = 0; c < 3; ++c) result.low.at[c] = (first >> c & 1) != 0 ? kSide : 0;
  for (unsigned i = 0; i < 2 && marks[i + 1] != kNoPoint; ++i) {
    const unsigned step = first ^ corner_at(marks[i + 1]);
    const unsigned axis = step == 1 ? 0 : step == 2 ? 1 : 2;
    result.low.at[axis] = (first & step) != 0 ? kSide - box.low[i] - box.extent[i] : box.low[i];
    result.extent[axis] = box.extent[i];
  }
  return result;
}

LatticeBox MeshCells::ToOwner(const LatticeBox& box) const {
  const uint32_t cell = CellOf(box.low.initial);
  if (cell == kNoCell || kind(cell) != CellKind::kHexahedron) return box;
  const Located located = Locate(cell, box);
  if (located.inside) return box;
  const uint32_t place = PlaceOf(cell, located.box.part);
  return place == kNoPlace ? box : InFrame(places_[place].owner, located.box, located.marks);
}

std::vector<LatticeBox> MeshCells::Around(const LatticeBox& box) const {
  const uint32_t cell = CellOf(box.low.initial);
  if (cell == kNoCell || kind(cell) != CellKind::kHexahedron) return {};
  const Located located = Locate(cell, box);
  if (located.inside) return {box};
  std::vector<LatticeBox> boxes;
  const uint32_t place = PlaceOf(cell, located.box.part);
  if (place == kNoPlace) return boxes;
  for (uint32_t other : OwnAt(place)) {
    if (kind(other) == CellKind::kHexahedron) boxes.push_back(InFrame(other, located.box, located.marks));
  }
  return boxes;
}

CellId MeshCells::Name(uint32_t cell, const PartBox& box) const {
  const Shared& shared = places_[PlaceOf(cell, box.part)];
  if (kind(shared.owner) == CellKind::kHexahedron) {
    return NameInOwner(InFrame(shared.owner, box, MarksOf(cell, box.part)));
  }
  const CellDarts& owner = Shape(shared.owner);
  return CellId::Rank(piece_.numbers[shared.owner], owner.dimension_of_part(shared.part),
                      owner.number_of_part(shared.part));
}

MeshCells::Place MeshCells::Find(const CellId& id) const {
  const uint32_t cell = CellOf(id.initial());
  if (cell == kNoCell || id.is_cell() || id.is_part() != (kind(cell) == CellKind::kHexahedron)) return {};
  uint32_t place = kNoPlace;
  Place found;
  if (id.is_part()) {
    const LatticeBox box = BoxOf(id);
    const Located located = Locate(cell, box);
    if (located.inside) return IsOwn(cell) ? Place{id, {cell}} : Place{};
    place = PlaceOf(cell, located.box.part);
    found.id = NameOf(*this, box);
  } else {
    const CellDarts& shape = Shape(cell);
    const unsigned dimension = id.dimension();
    const unsigned count = dimension == 0 ? shape.corners : dimension == 1 ? shape.edges : shape.faces;
    if (dimension > 2 || id.rank() >= count) return {};
    const unsigned part = dimension == 0   ? id.rank()
                          : dimension == 1 ? shape.edge_part(id.rank())
                                           : shape.face_part(id.rank());
    place = PlaceOf(cell, part);
    if (place == kNoPlace) return {};
    PartBox whole{static_cast<uint8_t>(part), {}, {}};
    for (unsigned i = 0; i < dimension; ++i) whole.extent[i] = kSide;
    found.id = Name(cell, whole);
  }
  if (place == kNoPlace) return {};
  found.cells.assign(OwnAt(place).begin(), OwnAt(place).end());
  return found;
}

}  // namespace ndmap

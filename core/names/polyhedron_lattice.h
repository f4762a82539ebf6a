// SPDX-License-Identifier: GPL-3.0-or-later
// Where every dart of an initial cell that is no hexahedron lies on its faces and edges, exactly and from the
// map alone, as hexahedron_lattice.h has it for hexahedra. Such a cell is never split, but hexahedra beside
// it split its edges and its faces with four corners.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "absl/container/flat_hash_set.h"
#include "core/algorithm/refine/frame.h"
#include "core/map/block.h"
#include "core/map/handle_hash.h"
#include "core/mesh/cell_darts.h"
#include "core/names/mesh_cells.h"

namespace ndmap {

template <class BlockT>
class PolyhedronLattice {
 public:
  using Lcc = typename BlockT::Lcc;
  using Dart = typename BlockT::Dart;
  using Cell = typename BlockT::Types::Cell;
  struct Placed {
    Dart dart;
    // The face of the cell that the dart lies on.
    unsigned side = 0;
    PartBox vertex, edge, face;
  };

  explicit PolyhedronLattice(Lcc& map) : map_(map) {}

  // All darts of the cell, face after face of the map. The reference stays good until the next call.
  // O(its darts).
  const std::vector<Placed>& Of(Cell cell) {
    const auto& info = map_.template info_of_attribute<3>(cell);
    shape_ = &DartsOf(info.kind);
    placed_.clear();
    seen_.clear();
    todo_.clear();
    todo_.push_back({info.reference, 0, 0, {0, 0}});
    while (!todo_.empty()) {
      const Standing next = todo_.back();
      todo_.pop_back();
      if (seen_.contains(next.dart)) continue;
      if (shape_->face_darts(next.face) == 4) {
        GoRoundQuad(next);
      } else {
        GoRoundTriangle(next);
      }
    }
    return placed_;
  }

 private:
  static constexpr uint32_t kSide = LatticePlace::kSide;
  // A dart that runs parallel to dart number `along` of a face. In a face with four corners it stands at this
  // place, in one with three at at[0] along that dart.
  struct Standing {
    Dart dart;
    unsigned face;
    unsigned along;
    std::array<uint32_t, 2> at;
  };

  uint32_t LengthOf(Dart d) const {
    return kSide >> std::max(Frame<BlockT>::StartLevel(map_, d), Frame<BlockT>::EndLevel(map_, d));
  }

  // A place `t` along a dart of the cell, for something of this length: its edge, or the corner where it is.
  PartBox OnDart(unsigned d, uint32_t t, uint32_t length) const {
    PartBox box;
    if (length == 0 && (t == 0 || t == kSide)) {
      box.part = static_cast<uint8_t>(t == 0 ? shape_->start[d] : shape_->end(d));
      return box;
    }
    box.part = static_cast<uint8_t>(shape_->edge_part(shape_->edge_of[d]));
    box.low[0] = shape_->along[d] ? t : kSide - t - length;
    box.extent[0] = length;
    return box;
  }

  // Goes on over the edge of the cell that the dart of the map lies on.
  void Leave(Dart dart, unsigned d, uint32_t t, uint32_t length) {
    const unsigned across = shape_->across[d];
    const unsigned face = shape_->face[across], along = across - shape_->begin[face];
    const uint32_t begin = kSide - t - length;
    Standing beyond{map_.template beta<2>(dart), face, along, {begin, 0}};
    if (shape_->face_darts(face) == 4) beyond.at = CornerPlace(along, begin);
    todo_.push_back(beyond);
  }

  // In a face with four corners: the place t along its dart number k.
  static std::array<uint32_t, 2> CornerPlace(unsigned k, uint32_t t) {
    switch (k) {
      case 0:
        return {t, 0};
      case 1:
        return {kSide, t};
      case 2:
        return {kSide - t, kSide};
      default:
        return {0, kSide - t};
    }
  }
  // Whether a dart parallel to number k lies on it, and how far along.
  static bool OnSide(unsigned k, const std::array<uint32_t, 2>& at, uint32_t* t) {
    switch (k) {
      case 0:
        *t = at[0];
        return at[1] == 0;
      case 1:
        *t = at[1];
        return at[0] == kSide;
      case 2:
        *t = kSide - at[0];
        return at[1] == kSide;
      default:
        *t = kSide - at[1];
        return at[0] == 0;
    }
  }

  void GoRoundTriangle(Standing s) {
    PartBox face{static_cast<uint8_t>(shape_->face_part(s.face)), {0, 0}, {kSide, kSide}};
    const Dart begin = s.dart;
    do {
      seen_.insert(s.dart);
      const uint32_t length = LengthOf(s.dart);
      const unsigned d = shape_->begin[s.face] + s.along;
      placed_.push_back({s.dart, s.face, OnDart(d, s.at[0], 0), OnDart(d, s.at[0], length), face});
      Leave(s.dart, d, s.at[0], length);
      s.at[0] += length;
      if (s.at[0] >= kSide) {
        s.at[0] = 0;
        s.along = (s.along + 1) % 3;
      }
      s.dart = map_.template beta<1>(s.dart);
    } while (s.dart != begin);
  }

  PartBox InFace(unsigned face, const std::array<uint32_t, 2>& low,
                 const std::array<uint32_t, 2>& extent) const {
    return {static_cast<uint8_t>(shape_->face_part(face)), low, extent};
  }

  // The place of a vertex in a face with four corners.
  PartBox VertexAt(unsigned face, const std::array<uint32_t, 2>& at) const {
    for (unsigned k = 0; k < 4; ++k) {
      uint32_t t = 0;
      if (OnSide(k, at, &t)) return OnDart(shape_->begin[face] + k, t, 0);
    }
    return InFace(face, at, {0, 0});
  }

  void GoRoundQuad(Standing s) {
    const int face_level = Frame<BlockT>::FaceLevel(map_, s.dart);
    const size_t first = placed_.size();
    const Dart begin = s.dart;
    std::array<uint32_t, 2> low = s.at, high = s.at;
    do {
      seen_.insert(s.dart);
      const uint32_t length = LengthOf(s.dart);
      const unsigned axis = s.along % 2;
      const bool upwards = s.along < 2;
      Placed placed{s.dart, s.face, VertexAt(s.face, s.at), {}, {}};
      std::array<uint32_t, 2> end = s.at, extent{};
      end[axis] = upwards ? end[axis] + length : end[axis] - length;
      extent[axis] = length;
      uint32_t t = 0;
      if (OnSide(s.along, s.at, &t)) {
        const unsigned d = shape_->begin[s.face] + s.along;
        placed.edge = OnDart(d, t, length);
        Leave(s.dart, d, t, length);
      } else {
        placed.edge = InFace(s.face, {std::min(s.at[0], end[0]), std::min(s.at[1], end[1])}, extent);
        todo_.push_back({map_.template beta<2>(s.dart), s.face, (s.along + 2) % 4, end});
      }
      placed_.push_back(placed);
      s.at = end;
      for (int c = 0; c < 2; ++c) {
        low[c] = std::min(low[c], end[c]);
        high[c] = std::max(high[c], end[c]);
      }
      s.dart = map_.template beta<1>(s.dart);
      if (Frame<BlockT>::StartLevel(map_, s.dart) <= face_level) s.along = (s.along + 1) % 4;
    } while (s.dart != begin);
    const PartBox face = InFace(s.face, low, {high[0] - low[0], high[1] - low[1]});
    for (size_t i = first; i < placed_.size(); ++i) placed_[i].face = face;
  }

  Lcc& map_;
  const CellDarts* shape_ = nullptr;
  std::vector<Placed> placed_;
  std::vector<Standing> todo_;
  absl::flat_hash_set<Dart, HandleHash<Dart>> seen_;
};

}  // namespace ndmap

// SPDX-License-Identifier: GPL-3.0-or-later
// Where every dart of a hexahedron lies in the lattice of its initial hexahedron, exactly and from the map
// alone: no coordinate of a point is read, so distorted hexahedra are as good as cubes. An edge of the map
// between vertices of levels a and b has length 2^-max(a, b); a face turns at its four vertices of lowest
// level and runs straight on at all others.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "absl/container/flat_hash_set.h"
#include "core/algorithm/refine/frame.h"
#include "core/algorithm/refine/hexahedron.h"
#include "core/map/block.h"
#include "core/map/handle_hash.h"
#include "core/names/name_of.h"

namespace ndmap {

// One dart of a hexahedron, with the boxes of its vertex, edge and face.
template <class Dart>
struct PlacedDart {
  Dart dart;
  // The face of the hexahedron (0 ... 5) that the dart lies on.
  unsigned side = 0;
  LatticeBox vertex, edge, face;
};

template <class BlockT>
class HexahedronLattice {
 public:
  using Lcc = typename BlockT::Lcc;
  using Dart = typename BlockT::Dart;
  using Cell = typename BlockT::Types::Cell;
  using Placed = PlacedDart<Dart>;

  explicit HexahedronLattice(Lcc& map) : map_(map) {}

  // All darts of the cell, face after face of the map. The reference stays good until the next call.
  // O(its darts).
  const std::vector<Placed>& Of(Cell cell) {
    const auto& info = map_.template info_of_attribute<3>(cell);
    whole_ = BoxOf(info.id);
    placed_.clear();
    seen_.clear();
    todo_.clear();
    const unsigned role = hexahedron::ReferenceRole(info.id);
    std::array<uint32_t, 3> at = whole_.low.at;
    for (int c = 0; c < 3; ++c) {
      if (hexahedron::StartCorner(role) >> c & 1) at[c] += whole_.extent[c];
    }
    todo_.push_back({info.reference, at, role});
    while (!todo_.empty()) {
      const Standing next = todo_.back();
      todo_.pop_back();
      if (!seen_.contains(next.dart)) GoRound(next);
    }
    return placed_;
  }

 private:
  // A dart that runs parallel to a role of the hexahedron (so on its side and in its direction) from a place.
  struct Standing {
    Dart dart;
    std::array<uint32_t, 3> at;
    unsigned role;
  };

  static int Axis(unsigned role) {
    const unsigned bit = hexahedron::StartCorner(role) ^ hexahedron::EndCorner(role);
    return bit == 1 ? 0 : bit == 2 ? 1 : 2;
  }
  static bool Upwards(unsigned role) { return hexahedron::EndCorner(role) > hexahedron::StartCorner(role); }

  void GoRound(Standing s) {
    const int face_level = Frame<BlockT>::FaceLevel(map_, s.dart);
    const size_t first = placed_.size();
    const Dart begin = s.dart;
    do {
      seen_.insert(s.dart);
      const int axis = Axis(s.role);
      const Dart next = map_.template beta<1>(s.dart);
      const int level =
          std::max(Frame<BlockT>::StartLevel(map_, s.dart), Frame<BlockT>::StartLevel(map_, next));
      const uint32_t length = LatticePlace::kSide >> level;
      Placed placed{s.dart, hexahedron::FaceOf(s.role), {}, {}, {}};
      placed.vertex.low = {whole_.low.initial, s.at};
      placed.edge.low = placed.vertex.low;
      if (!Upwards(s.role)) placed.edge.low.at[axis] -= length;
      placed.edge.extent[axis] = length;
      s.at[axis] = Upwards(s.role) ? s.at[axis] + length : s.at[axis] - length;
      todo_.push_back({map_.template beta<2>(s.dart), s.at, RoleBeyond(s)});
      placed_.push_back(placed);
      s.dart = next;
      if (Frame<BlockT>::StartLevel(map_, next) <= face_level) s.role = hexahedron::NextRole(s.role);
    } while (s.dart != begin);
    SetFace(first);
  }

  // The role of beta_2 of a dart that ends at s.at: on the side beside, if the dart lies on an edge of the
  // hexahedron, else on the same side the other way.
  unsigned RoleBeyond(const Standing& s) const {
    const int normal = 2 - static_cast<int>(hexahedron::FaceOf(s.role) / 2);
    const int across = 3 - normal - Axis(s.role);
    const bool high = (hexahedron::StartCorner(s.role) >> across & 1) != 0;
    const uint32_t edge = whole_.low.at[across] + (high ? whole_.extent[across] : 0);
    return s.at[across] == edge ? hexahedron::kAcross[s.role]
                                : hexahedron::NextRole(hexahedron::NextRole(s.role));
  }

  // The face's box is that of its vertices.
  void SetFace(size_t first) {
    LatticeBox face = placed_[first].vertex;
    std::array<uint32_t, 3> high = face.low.at;
    for (size_t i = first; i < placed_.size(); ++i) {
      for (int c = 0; c < 3; ++c) {
        face.low.at[c] = std::min(face.low.at[c], placed_[i].vertex.low.at[c]);
        high[c] = std::max(high[c], placed_[i].vertex.low.at[c]);
      }
    }
    for (int c = 0; c < 3; ++c) face.extent[c] = high[c] - face.low.at[c];
    for (size_t i = first; i < placed_.size(); ++i) placed_[i].face = face;
  }

  Lcc& map_;
  LatticeBox whole_;
  std::vector<Placed> placed_;
  std::vector<Standing> todo_;
  absl::flat_hash_set<Dart, HandleHash<Dart>> seen_;
};

}  // namespace ndmap

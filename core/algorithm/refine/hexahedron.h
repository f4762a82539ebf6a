// SPDX-License-Identifier: GPL-3.0-or-later
// The names of a hexahedron's parts, and how to find them in a map where neighbours may have split its edges
// and faces to any depth.
//
// Corner c = x + 2 y + 4 z has local coordinates (x, y, z). Face f: 0 z=0, 1 z=1, 2 y=0, 3 y=1, 4 x=0, 5 x=1,
// corners in the orientation of make_hexahedron in CGAL (clockwise seen from outside). *Role* 4 f + k is the
// dart that leaves corner k of face f along beta_1: the 24 darts of an unsplit hexahedron, and of a split one
// those of them that leave its corners. A cell's `reference` dart has ReferenceRole(id): the lowest role at
// corner 0 of an initial cell, and for child c at corner c, which is a corner of parent and child alike.
#pragma once

#include <array>
#include <cstdint>

#include "core/map/ids.h"

namespace ndmap::hexahedron {

inline constexpr unsigned kFaces = 6;
inline constexpr unsigned kRoles = 24;
inline constexpr std::array<std::array<uint8_t, 4>, kFaces> kFaceCorners = {
    {{0, 1, 3, 2}, {4, 6, 7, 5}, {0, 4, 5, 1}, {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 5, 7, 3}}};

constexpr unsigned Role(unsigned face, unsigned k) { return 4 * face + (k & 3); }
constexpr unsigned FaceOf(unsigned role) { return role / 4; }
// The next and the previous role along beta_1 in the same face.
constexpr unsigned NextRole(unsigned role) { return (role & ~3u) | ((role + 1) & 3); }
constexpr unsigned PreviousRole(unsigned role) { return (role & ~3u) | ((role + 3) & 3); }
constexpr unsigned StartCorner(unsigned role) { return kFaceCorners[role / 4][role % 4]; }
constexpr unsigned EndCorner(unsigned role) { return StartCorner(NextRole(role)); }

namespace internal {

// The role from corner `start` to corner `end` in a face that passes `accept`; kRoles if there is none.
template <class Accept>
constexpr unsigned FindRole(unsigned start, unsigned end, Accept accept) {
  for (unsigned role = 0; role < kRoles; ++role) {
    if (StartCorner(role) == start && EndCorner(role) == end && accept(FaceOf(role))) return role;
  }
  return kRoles;
}

constexpr std::array<uint8_t, kRoles> MakeAcross() {
  std::array<uint8_t, kRoles> table{};
  for (unsigned role = 0; role < kRoles; ++role) {
    table[role] =
        FindRole(EndCorner(role), StartCorner(role), [role](unsigned f) { return f != FaceOf(role); });
  }
  return table;
}

constexpr std::array<uint8_t, kRoles> MakeOpposite() {
  std::array<uint8_t, kRoles> table{};
  for (unsigned role = 0; role < kRoles; ++role) {
    const unsigned face = FaceOf(role);
    const unsigned bit = face < 2 ? 4 : face < 4 ? 2 : 1;
    table[role] = FindRole(EndCorner(role) ^ bit, StartCorner(role) ^ bit,
                           [face](unsigned f) { return f == (face ^ 1); });
  }
  return table;
}

constexpr std::array<uint8_t, 8> MakeCornerRole() {
  std::array<uint8_t, 8> table{};
  for (unsigned c = 0; c < 8; ++c) {
    unsigned role = 0;
    while (StartCorner(role) != c) ++role;
    table[c] = role;
  }
  return table;
}

}  // namespace internal

// The role of the same edge, run the other way, in the face beside it: beta_2.
inline constexpr std::array<uint8_t, kRoles> kAcross = internal::MakeAcross();
// The role of beta_3 in the neighbouring hexahedron of a grid, whose axes are parallel.
inline constexpr std::array<uint8_t, kRoles> kOpposite = internal::MakeOpposite();
// The lowest role that starts at a corner.
inline constexpr std::array<uint8_t, 8> kCornerRole = internal::MakeCornerRole();

inline unsigned ReferenceRole(const CellId& id) { return kCornerRole[id.level() == 0 ? 0 : id.last_digit()]; }

}  // namespace ndmap::hexahedron

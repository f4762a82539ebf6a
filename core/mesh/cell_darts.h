// SPDX-License-Identifier: GPL-3.0-or-later
// The darts, edges and faces of one cell of each kind, numbered: what a map is made from. A cell's darts are
// numbered face after face; those of a hexahedron by their roles (core/algorithm/refine/hexahedron.h). All
// faces run clockwise seen from outside, as CGAL's make_hexahedron has them, which is against the tables of
// core/mesh/volume_mesh.h.
//
// Corners are *local*: of a hexahedron x + 2 y + 4 z, of the other kinds as the mesh lists them.
#pragma once

#include <array>
#include <cstdint>

#include "core/algorithm/refine/hexahedron.h"
#include "core/mesh/volume_mesh.h"

namespace ndmap {

struct CellDarts {
  static constexpr unsigned kMostDarts = 24;
  static constexpr unsigned kMostEdges = 12;

  unsigned corners = 0, edges = 0, faces = 0, darts = 0;
  // By dart: its face, the corner where it starts, the dart after it in its face, beta 2.
  std::array<uint8_t, kMostDarts> face{}, start{}, next{}, across{};
  // By face: its first dart, and one more.
  std::array<uint8_t, kMostCellFaces + 1> begin{};
  // By edge: its two corners, the lower first; in this order, but those of a hexahedron as ids number them
  // (docs/ids.md).
  std::array<std::array<uint8_t, 2>, kMostEdges> edge{};
  // By dart: its edge, and whether it runs along it from its first corner.
  std::array<uint8_t, kMostDarts> edge_of{};
  std::array<bool, kMostDarts> along{};
  // By local corner: its place in the mesh's list.
  std::array<uint8_t, kMostCellCorners> listed{};

  constexpr unsigned end(unsigned dart) const { return start[next[dart]]; }
  constexpr unsigned face_darts(unsigned f) const { return begin[f + 1] - begin[f]; }
  // Vertices, edges and faces in one row: corner c, corners + edge, corners + edges + face.
  constexpr unsigned parts() const { return corners + edges + faces; }
  constexpr unsigned edge_part(unsigned e) const { return corners + e; }
  constexpr unsigned face_part(unsigned f) const { return corners + edges + f; }
  constexpr unsigned dimension_of_part(unsigned p) const {
    return p < corners ? 0 : p < corners + edges ? 1 : 2;
  }
  constexpr unsigned number_of_part(unsigned p) const {
    return p < corners ? p : p < corners + edges ? p - corners : p - corners - edges;
  }
};

namespace internal {

constexpr void LinkAcross(CellDarts& cell) {
  for (unsigned d = 0; d < cell.darts; ++d) {
    for (unsigned e = 0; e < cell.darts; ++e) {
      if (cell.face[e] != cell.face[d] && cell.start[e] == cell.end(d) && cell.end(e) == cell.start[d]) {
        cell.across[d] = static_cast<uint8_t>(e);
      }
    }
  }
}

constexpr void NumberEdges(CellDarts& cell) {
  for (unsigned d = 0; d < cell.darts; ++d) {
    for (unsigned e = 0; e < cell.edges; ++e) {
      const bool along = cell.edge[e][0] == cell.start[d] && cell.edge[e][1] == cell.end(d);
      const bool against = cell.edge[e][1] == cell.start[d] && cell.edge[e][0] == cell.end(d);
      if (!along && !against) continue;
      cell.edge_of[d] = static_cast<uint8_t>(e);
      cell.along[d] = along;
    }
  }
}

constexpr void AddFace(CellDarts& cell, const std::array<uint8_t, kMostFaceCorners>& corners,
                       unsigned count) {
  const unsigned first = cell.darts;
  for (unsigned k = 0; k < count; ++k) {
    cell.face[first + k] = static_cast<uint8_t>(cell.faces);
    cell.start[first + k] = corners[k];
    cell.next[first + k] = static_cast<uint8_t>(first + (k + 1) % count);
  }
  cell.darts += count;
  cell.begin[++cell.faces] = static_cast<uint8_t>(cell.darts);
}

// In the order of their first corner, then of their second.
constexpr void ListEdges(CellDarts& cell) {
  for (unsigned a = 0; a < cell.corners; ++a) {
    for (unsigned b = a + 1; b < cell.corners; ++b) {
      for (unsigned d = 0; d < cell.darts; ++d) {
        if (cell.start[d] != a || cell.end(d) != b) continue;
        cell.edge[cell.edges++] = {static_cast<uint8_t>(a), static_cast<uint8_t>(b)};
      }
    }
  }
}

constexpr CellDarts MakeCellDarts(CellKind kind) {
  const CellShape& shape = ShapeOf(kind);
  CellDarts cell;
  cell.corners = shape.corners;
  for (unsigned c = 0; c < cell.corners; ++c) cell.listed[c] = static_cast<uint8_t>(c);
  if (kind == CellKind::kHexahedron) {
    cell.listed = {0, 1, 3, 2, 4, 5, 7, 6};
    for (unsigned f = 0; f < hexahedron::kFaces; ++f) AddFace(cell, hexahedron::kFaceCorners[f], 4);
    for (unsigned axis = 0; axis < 3; ++axis) {
      const unsigned low = axis == 0 ? 2 : 1, high = axis == 2 ? 2 : 4;
      for (unsigned k = 0; k < 4; ++k) {
        const unsigned corner = (k & 1) * low + (k >> 1) * high;
        cell.edge[cell.edges++] = {static_cast<uint8_t>(corner), static_cast<uint8_t>(corner | 1u << axis)};
      }
    }
  } else {
    for (unsigned f = 0; f < shape.faces; ++f) {
      const unsigned count = shape.face_corners[f];
      std::array<uint8_t, kMostFaceCorners> clockwise{};
      for (unsigned k = 0; k < count; ++k) clockwise[k] = shape.face[f][(count - k) % count];
      AddFace(cell, clockwise, count);
    }
    ListEdges(cell);
  }
  LinkAcross(cell);
  NumberEdges(cell);
  return cell;
}

inline constexpr std::array<CellDarts, kCellKinds> kCellDarts = {
    MakeCellDarts(CellKind::kTetrahedron), MakeCellDarts(CellKind::kPyramid), MakeCellDarts(CellKind::kPrism),
    MakeCellDarts(CellKind::kHexahedron)};

}  // namespace internal

constexpr const CellDarts& DartsOf(CellKind kind) { return internal::kCellDarts[static_cast<size_t>(kind)]; }

}  // namespace ndmap

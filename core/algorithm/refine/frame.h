// SPDX-License-Identifier: GPL-3.0-or-later
// Walking along the edges and around the faces of a hexahedron whose boundary neighbours may have split to
// any depth. A hexahedron of level l has as corners exactly its vertices of level <= l; everything else on it
// is deeper.
#pragma once

#include <algorithm>
#include <array>
#include <limits>

#include "core/algorithm/refine/hexahedron.h"
#include "core/geometry/surface.h"
#include "core/map/block.h"
#include "core/map/partial_scan.h"

namespace ndmap {

template <class BlockT>
class Frame {
 public:
  using Lcc = typename BlockT::Lcc;
  using Dart = typename BlockT::Dart;

  // The level of the vertex where d starts. O(1).
  static int StartLevel(Lcc& map, Dart d) {
    return map.template info_of_attribute<0>(map.template attribute<0>(d)).level;
  }
  static int EndLevel(Lcc& map, Dart d) { return StartLevel(map, map.template beta<1>(d)); }
  static Point3 StartPoint(Lcc& map, Dart d) {
    const auto& p = map.point(d);
    return {p.x(), p.y(), p.z()};
  }

  // The level of the face as it is now, split or not: its corners are the four vertices of lowest level, and
  // the fourth-lowest is the level. O(darts of the face).
  static int FaceLevel(Lcc& map, Dart d) {
    std::array<int, 4> lowest;
    int count = 0;
    Dart e = d;
    do {
      int level = StartLevel(map, e);
      for (int i = 0; i < count; ++i) {
        if (level < lowest[i]) std::swap(level, lowest[i]);
      }
      if (count < 4) lowest[count++] = level;
      e = map.template beta<1>(e);
    } while (e != d);
    return lowest[count - 1];
  }

  // Whether the face of level l that d is in is one face still: it has four vertices of level <= l. O(its
  // darts).
  static bool FaceIsWhole(Lcc& map, Dart d, int l) {
    int corners = 0;
    Dart e = d;
    do {
      if (StartLevel(map, e) <= l) ++corners;
      e = map.template beta<1>(e);
    } while (e != d);
    return corners == 4;
  }

  // The darts of a line, one after the other: straight on where a dart ends, within the face if the vertex
  // only hangs on it, otherwise across the edge that ends on the line. Asks for the level of each face on the
  // way once. O(darts of the faces along it) in all.
  class Line {
   public:
    Line(Lcc& map, Dart d) : map_(map), dart_(d) {}
    Dart dart() const { return dart_; }
    void Advance() {
      const Dart next = map_.template beta<1>(dart_);
      const bool quad = map_.template beta<1, 1, 1>(next) == dart_;
      if (!quad && face_level_ < 0) face_level_ = FaceLevel(map_, dart_);
      if (quad || StartLevel(map_, next) <= face_level_) {
        dart_ = map_.template beta<2, 1>(next);
        face_level_ = -1;
      } else {
        dart_ = next;
      }
    }

   private:
    Lcc& map_;
    Dart dart_;
    int face_level_ = -1;
  };

  // The last dart of the edge of level l that d, leaving a vertex of level <= l, begins. O(darts of the faces
  // along it).
  static Dart EdgeEnd(Lcc& map, Dart d, int l) {
    Line line(map, d);
    while (EndLevel(map, line.dart()) > l) line.Advance();
    return line.dart();
  }

  // As EdgeEnd, but stops at the edge's midpoint, the one vertex of level l + 1 on it, if it is split.
  static Dart EdgeMiddle(Lcc& map, Dart d, int l) { return EdgeEnd(map, d, l + 1); }

  // first[role]: the dart that leaves a corner; last[role]: the last dart of the same edge in the same face.
  std::array<Dart, hexahedron::kRoles> first;
  std::array<Dart, hexahedron::kRoles> last;
  int level = 0;
  // No edge and no face is split, so that first and last are the same.
  bool whole = false;

  // All roles of the cell whose dart with `role` is `reference`. O(darts on its edges).
  static Frame Of(Lcc& map, Dart reference, unsigned role, int level) {
    Frame frame;
    frame.level = level;
    frame.whole = frame.FillWhole(map, reference, role);
    if (frame.whole) {
      frame.last = frame.first;
    } else {
      frame.Fill(map, reference, role);
    }
    return frame;
  }
  static Frame Of(Lcc& map, typename BlockT::Types::Cell cell) {
    const auto& info = map.template info_of_attribute<3>(cell);
    return Of(map, info.reference, hexahedron::ReferenceRole(info.id), info.id.level());
  }

  // Corner points by corner number.
  std::array<Point3, 8> Corners(Lcc& map) const {
    std::array<Point3, 8> corners;
    for (unsigned c = 0; c < 8; ++c) corners[c] = StartPoint(map, first[hexahedron::kCornerRole[c]]);
    return corners;
  }

 private:
  // The four roles of a face, the first of which is given; whether beta_1 leads around it in four steps.
  bool FillQuad(Lcc& map, unsigned role, Dart d) {
    for (int k = 0; k < 4; ++k) {
      first[role] = d;
      role = hexahedron::NextRole(role);
      d = map.template beta<1>(d);
    }
    return d == first[role];
  }

  // Fills `first` of a hexahedron no edge and no face of which is split; false if one is. Five faces are
  // looked at: four darts between corners are a whole face with whole edges, and a face with whole edges is
  // whole.
  bool FillWhole(Lcc& map, Dart reference, unsigned role) {
    if (!FillQuad(map, role, reference)) return false;
    unsigned opposite = 0;
    for (int k = 0; k < 4; ++k, role = hexahedron::NextRole(role)) {
      if (StartLevel(map, first[role]) > level) return false;
      const unsigned across = hexahedron::kAcross[role];
      if (!FillQuad(map, across, map.template beta<2>(first[role]))) return false;
      opposite = hexahedron::NextRole(hexahedron::NextRole(across));
      if (StartLevel(map, first[opposite]) > level) return false;
    }
    return FillQuad(map, hexahedron::kAcross[opposite], map.template beta<2>(first[opposite]));
  }

  void Fill(Lcc& map, Dart reference, unsigned role) {
    std::array<bool, hexahedron::kRoles> walked{};
    std::array<bool, hexahedron::kRoles> queued{};
    std::array<uint8_t, hexahedron::kRoles> queue;
    size_t waiting = 0;
    const auto add = [&](unsigned r, Dart d) {
      first[r] = d;
      queue[waiting++] = static_cast<uint8_t>(r);
      queued[r] = true;
    };
    add(role, reference);
    while (waiting > 0) {
      const unsigned r = queue[--waiting];
      const unsigned across = hexahedron::kAcross[r];
      if (!walked[r]) {
        last[r] = EdgeEnd(map, first[r], level);
        last[across] = map.template beta<2>(first[r]);
        const Dart back = map.template beta<2>(last[r]);
        if (queued[across]) {
          first[across] = back;
        } else {
          add(across, back);
        }
        walked[r] = walked[across] = true;
      }
      const unsigned next = hexahedron::NextRole(r);
      if (!queued[next]) add(next, map.template beta<1>(last[r]));
    }
  }
};

// Whether every dart of the n-cell of d has its vertex: an initial cell may not, while the algorithm that
// makes it runs. O(its darts).
template <class BlockT>
bool HasVertices(typename BlockT::Lcc& map, typename BlockT::Dart d) {
  for (auto it = map.template darts_of_cell<BlockT::n>(d).begin(); it.cont(); ++it) {
    if (map.template attribute<0>(it) == BlockT::Lcc::null_handle) return false;
  }
  return true;
}

// The bounding box of a block's vertices, a part of them at a time.
template <class BlockT>
class VertexBounds {
 public:
  using Lcc = typename BlockT::Lcc;

  explicit VertexBounds(BlockT& block) : map_(block.map()), vertices_(block.map().template attributes<0>()) {}

  // Looks at `budget` vertices at most; true when all were looked at.
  bool Next(size_t budget) {
    return vertices_.Next(&budget, [this](typename BlockT::Types::Vertex v) {
      const auto& p = map_.point_of_vertex_attribute(v);
      const Point3 q{p.x(), p.y(), p.z()};
      if (!any_) box_ = {q, q};
      any_ = true;
      for (int c = 0; c < 3; ++c) {
        box_.lo[c] = std::min(box_.lo[c], q[c]);
        box_.hi[c] = std::max(box_.hi[c], q[c]);
      }
    });
  }
  // A block without vertices: some box.
  const Box3& box() const { return box_; }

 private:
  Lcc& map_;
  PartialScan<typename Lcc::template Attribute_range<0>::type> vertices_;
  bool any_ = false;
  Box3 box_;
};

// The same in one go. O(vertices).
template <class BlockT>
Box3 VertexBox(BlockT& block) {
  VertexBounds<BlockT> bounds(block);
  bounds.Next(std::numeric_limits<size_t>::max());
  return bounds.box();
}

// The closed axis-aligned box of the corners.
inline Box3 CornerBox(const std::array<Point3, 8>& corners) {
  Box3 box{corners[0], corners[0]};
  for (const Point3& p : corners) {
    for (int c = 0; c < 3; ++c) {
      box.lo[c] = std::min(box.lo[c], p[c]);
      box.hi[c] = std::max(box.hi[c], p[c]);
    }
  }
  return box;
}

// The closed axis-aligned box of an n-cell: of its corners, which its other points never leave. O(its darts
// on edges) for a hexahedron, O(its darts) for others.
template <class BlockT>
Box3 CellBox(typename BlockT::Lcc& map, typename BlockT::Types::Cell cell) {
  using F = Frame<BlockT>;
  constexpr unsigned n = BlockT::n;
  const auto& info = map.template info_of_attribute<n>(cell);
  if constexpr (n == 3) {
    if (info.kind == CellKind::kHexahedron) return CornerBox(F::Of(map, cell).Corners(map));
  }
  const Point3 first = F::StartPoint(map, info.reference);
  Box3 box{first, first};
  for (auto it = map.template darts_of_cell<n>(info.reference).begin(); it.cont(); ++it) {
    const Point3 p = F::StartPoint(map, it);
    for (int c = 0; c < 3; ++c) {
      box.lo[c] = std::min(box.lo[c], p[c]);
      box.hi[c] = std::max(box.hi[c], p[c]);
    }
  }
  return box;
}

}  // namespace ndmap

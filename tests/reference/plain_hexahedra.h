// SPDX-License-Identifier: GPL-3.0-or-later
// 1:8 refinement of hexahedra on one plain CGAL linear cell complex, written only with CGAL's own high-level
// operations (insert_cell_0_in_cell_1, insert_cell_1_in_cell_2, insert_cell_2_in_cell_3): what a user without
// ndmap would write. It is the independent reference that the distributed refinement is compared with and the
// peer it is measured against, so it shares no code with core/algorithm/refine.
//
// The edges and faces of a hexahedron may already be split to any depth by its neighbours. Vertices know the
// level at which they were made: the corners of a level-l hexahedron are its vertices of level <= l, and the
// corners of any face are the four vertices of the lowest levels on its cycle.
//
// Corners are numbered x + 2y + 4z, x, y, z in {0, 1} along the axes of the initial grid. A dart of a
// hexahedron that leaves corner c along axis a is named (c, a); its face is spanned by a and one other axis.
// The orientation is that of CGAL's make_hexahedron: the face z = 0 runs 0 -> 1 -> 3 -> 2. So face and next
// dart follow from (c, a) alone, which is all the geometry that this code knows.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <limits>
#include <vector>

namespace ndmap::reference {

// Lcc: a 3-dimensional linear cell complex in space whose vertex attributes have an info() with an integer
// member `level`. A hexahedron is passed as its reference dart (0, x): from corner 0 to corner 1 in the face
// z = 0. Works on a map in which every volume is a hexahedron as described above; O(darts of the hexahedron)
// plus what CGAL's operations cost.
template <class Lcc>
class PlainHexahedra {
 public:
  using Dart = typename Lcc::Dart_handle;
  using Point = typename Lcc::Point;

  explicit PlainHexahedra(Lcc& lcc) : lcc_(lcc) {}

  // A new hexahedron with these corners, all of level 0; its reference dart.
  Dart Make(const std::array<Point, 8>& p) {
    // CGAL counts the bottom counterclockwise, and the top from above its corner 3.
    const Dart made = lcc_.make_hexahedron(p[0], p[1], p[3], p[2], p[6], p[4], p[5], p[7]);
    return lcc_.beta(made, 0, 2);  // `made` runs from corner 0 to corner 4; before it comes 1 -> 0 in y = 0.
  }

  // Sews two hexahedra of level 0: `second` is the next one after `first` along this axis. Vertices merge.
  void SewAlong(Dart first, Dart second, unsigned axis) {
    const unsigned other = (axis + 2) % 3;
    const Dart d = Reach({first, 0, 0}, 1u << axis, other, 0).dart;
    const Dart e = Reach({second, 0, 0}, 1u << other, other, 0).dart;
    lcc_.template sew<3>(d, e);
  }

  // The points of the corners of a hexahedron of this level.
  std::array<Point, 8> Corners(Dart reference, int level) const {
    std::array<Point, 8> points;
    const CornerTable corners = FindCorners(reference, level);
    for (unsigned c = 0; c < 8; ++c) points[c] = lcc_.point(corners[c][0].dart);
    return points;
  }

  // Splits a hexahedron of this level into eight; the reference darts of its children. Child c is the one
  // that keeps corner c, and is numbered like its parent.
  std::array<Dart, 8> Split(Dart reference, int level) {
    const CornerTable corners = FindCorners(reference, level);
    std::array<Point, 8> points;
    for (unsigned c = 0; c < 8; ++c) points[c] = lcc_.point(corners[c][0].dart);
    for (unsigned c : {0, 3, 5, 6}) {  // Every edge ends at one of these corners.
      for (unsigned a = 0; a < 3; ++a) SplitEdge(corners[c][a].dart, level);
    }
    for (unsigned a = 0; a < 3; ++a) {  // All six faces meet at two opposite corners.
      SplitFace(corners[0][a].dart, level);
      SplitFace(corners[7][a].dart, level);
    }
    SplitInside(corners, points, level + 1);
    std::array<Dart, 8> children;
    for (unsigned c = 0; c < 8; ++c) children[c] = Reach(corners[c][0], 0, 0, level + 1).dart;
    return children;
  }

 private:
  struct Corner {
    Dart dart;
    unsigned corner;
    unsigned axis;
  };
  using CornerTable = std::array<std::array<Corner, 3>, 8>;

  // In the face of dart (c, a): the axis along which that face leaves the next corner, c ^ 1 << a.
  static unsigned FaceAxis(unsigned c, unsigned a) { return (a + (std::popcount(c) % 2 == 0 ? 1 : 2)) % 3; }

  int Level(Dart d) const { return lcc_.template info<0>(d).level; }

  // The level of the face of a dart: that of its four corners, the fourth-smallest on its cycle.
  int FaceLevel(Dart d) const {
    std::array<int, 4> lowest;
    lowest.fill(std::numeric_limits<int>::max());
    Dart e = d;
    do {
      const int level = Level(e);
      if (level < lowest[3]) {
        int i = 3;
        for (; i > 0 && lowest[i - 1] > level; --i) lowest[i] = lowest[i - 1];
        lowest[i] = level;
      }
      e = lcc_.template beta<1>(e);
    } while (e != d);
    return lowest[3];
  }

  // Visits the darts of one side of a level-`level` face, from the dart at its corner to the next corner,
  // however deep side and face have been split; returns the last. At the corner of a smaller face an edge
  // leads inwards: step across it.
  template <class Visit>
  Dart FollowSide(Dart d, int level, const Visit& visit) const {
    for (;;) {
      visit(d);
      const Dart next = lcc_.template beta<1>(d);
      const int met = Level(next);
      if (met <= level) return d;
      d = met <= FaceLevel(d) ? lcc_.beta(next, 2, 1) : next;
    }
  }

  // The dart of the same face (of this level) that leaves its next corner.
  Dart NextCorner(Dart d, int level) const {
    return lcc_.template beta<1>(FollowSide(d, level, [](Dart) {}));
  }

  Corner Next(const Corner& at, int level) const {
    return {NextCorner(at.dart, level), at.corner ^ 1u << at.axis, FaceAxis(at.corner, at.axis)};
  }

  // The dart at the same corner in the face beyond the edge: it leaves along the third axis.
  Corner Turn(const Corner& at) const {
    return {lcc_.beta(at.dart, 2, 1), at.corner, 3 - at.axis - FaceAxis(at.corner, at.axis)};
  }

  // The dart (corner, axis) of the hexahedron of this level that `from` belongs to.
  Corner Reach(Corner from, unsigned corner, unsigned axis, int level) const {
    while (from.corner != corner) {
      from = ((from.corner ^ corner) >> from.axis & 1) != 0 ? Next(from, level) : Turn(from);
    }
    while (from.axis != axis) from = Turn(from);
    return from;
  }

  CornerTable FindCorners(Dart reference, int level) const {
    CornerTable table;
    Corner at{reference, 0, 0};
    for (unsigned step = 0; step < 8; ++step) {
      at = Reach(at, step ^ step >> 1, 0, level);  // A Gray code: one edge a step.
      for (unsigned turn = 0; turn < 3; ++turn) {
        table[at.corner][at.axis] = at;
        at = Turn(at);
      }
    }
    return table;
  }

  static Point Midpoint(const Point& a, const Point& b) {
    return Point((a.x() + b.x()) / 2, (a.y() + b.y()) / 2, (a.z() + b.z()) / 2);
  }

  // Independent of which corner is number 0, and the middle of a box to the bit: along each coordinate the
  // middles of the four diagonals in ascending order, then the mean of the means of two.
  static Point Centre(const std::array<Point, 8>& corners) {
    std::array<std::array<double, 4>, 3> middles;
    for (int i = 0; i < 4; ++i) {
      const Point middle = Midpoint(corners[i], corners[7 - i]);
      for (int c = 0; c < 3; ++c) middles[c][i] = middle[c];
    }
    std::array<double, 3> mean;
    for (int c = 0; c < 3; ++c) {
      std::sort(middles[c].begin(), middles[c].end());
      mean[c] = ((middles[c][0] + middles[c][1]) / 2 + (middles[c][2] + middles[c][3]) / 2) / 2;
    }
    return Point(mean[0], mean[1], mean[2]);
  }

  Dart InsertVertex(Dart edge, const Point& point, int level) {
    const Dart made = lcc_.insert_point_in_cell_1(edge, point);
    lcc_.template info<0>(made).level = level;
    return made;
  }

  // d leaves a corner; the level-`level` edge there gets its midpoint unless it has it.
  void SplitEdge(Dart d, int level) {
    const Dart end = lcc_.template beta<1>(d);
    if (Level(end) <= level) InsertVertex(d, Midpoint(lcc_.point(d), lcc_.point(end)), level + 1);
  }

  // The darts of the face of d that leave its vertices of level <= `level`, from d on: at most eight.
  std::array<Dart, 8> DartsAt(Dart d, int level) const {
    std::array<Dart, 8> darts;
    size_t found = 0;
    Dart e = d;
    do {
      if (Level(e) <= level) darts[found++] = e;
      e = lcc_.template beta<1>(e);
    } while (e != d && found < darts.size());
    return darts;
  }

  // d leaves a corner of a level-`level` face whose edges are split; the face is split in four unless it is.
  void SplitFace(Dart d, int level) {
    if (FaceLevel(d) > level) return;
    const std::array<Dart, 8> at = DartsAt(d, level + 1);  // Corner, midpoint, corner, ...
    const Point centre = Midpoint(Midpoint(lcc_.point(at[0]), lcc_.point(at[4])),
                                  Midpoint(lcc_.point(at[2]), lcc_.point(at[6])));
    SplitQuad({at[1], at[3], at[5], at[7]}, centre, level + 1);
  }

  // One edge across between the midpoints 0 and 2, the centre on it, an edge from each of the other two.
  // (A dangling edge would do as well, but CGAL 5.5 gives it wrong vertex attributes beyond β3.)
  void SplitQuad(const std::array<Dart, 4>& mid, const Point& centre, int level) {
    const Dart across = lcc_.insert_cell_1_in_cell_2(mid[0], mid[2]);  // From 2 to 0, on the side of 1.
    const Dart onward = InsertVertex(across, centre, level);           // From the centre to 0.
    const Dart back = lcc_.template beta<2>(across);  // From the centre to 2, on the side of 3.
    lcc_.insert_cell_1_in_cell_2(mid[1], onward);
    lcc_.insert_cell_1_in_cell_2(mid[3], back);
  }

  // A face across the middle of the volume, along the closed path of level-`level` edges that starts with d.
  // The faces on d's side of the path are a strip of quads, so the path goes on beyond each quad's next side.
  // Returns the new face's darts at the corners of that path, from the start of d on, on the far side.
  std::array<Dart, 8> SplitAcross(Dart d, int level) {
    path_.clear();
    Dart e = d;
    do {
      e = lcc_.beta(FollowSide(e, level, [this](Dart part) { path_.push_back(part); }), 1, 2, 1);
    } while (e != d);
    const Dart made = lcc_.insert_cell_2_in_cell_3(path_.begin(), path_.end());
    return DartsAt(lcc_.template beta<3>(made), level);
  }

  // Edges and faces are split: cuts across x, across y in each half, across z in each quarter.
  void SplitInside(const CornerTable& corners, const std::array<Point, 8>& points, int level) {
    const auto start = [&](unsigned c, unsigned axis) { return NextCorner(corners[c][axis].dart, level); };
    const std::array<Dart, 8> x = SplitAcross(start(0, 0), level);  // Edge, face, edge, ...
    SplitQuad({x[1], x[3], x[5], x[7]}, Centre(points), level);
    for (unsigned half = 0; half < 2; ++half) {
      const std::array<Dart, 8> y = SplitAcross(start(half, 1), level);
      // The path leaves the edge along z or along x: the old face's centre comes first, or the new one's.
      const unsigned first = FaceAxis(half, 1) == 2 ? 1 : 2;
      lcc_.insert_cell_1_in_cell_2(y[first], y[first + 3]);
    }
    for (unsigned quarter = 0; quarter < 4; ++quarter) SplitAcross(start(quarter, 2), level);
  }

  Lcc& lcc_;
  std::vector<Dart> path_;  // Kept for its memory.
};

}  // namespace ndmap::reference

// SPDX-License-Identifier: GPL-3.0-or-later
// The changes that refinement makes to one block: an edge split at its midpoint, a face in four, a hexahedron
// in eight; with the labels of critical darts derived as core/algorithm/refine/label.h says. No messages
// here: what others have to be told is returned.
#pragma once

#include <array>
#include <vector>

#include "absl/container/inlined_vector.h"
#include "core/algorithm/refine/frame.h"
#include "core/algorithm/refine/geometry.h"
#include "core/algorithm/refine/label.h"
#include "core/map/block.h"
#include "core/map/dart_writer.h"

namespace ndmap {

template <class BlockT>
class Subdivider {
 public:
  using Lcc = typename BlockT::Lcc;
  using Dart = typename BlockT::Dart;
  using Cell = typename BlockT::Types::Cell;
  using Vertex = typename BlockT::Types::Vertex;
  using F = Frame<BlockT>;
  static_assert(BlockT::n == 3, "hexahedra live in 3-maps");

  explicit Subdivider(BlockT& block) : block_(block), map_(block.map()), writer_(block.map()) {}

  // A critical dart of an edge that was split, with the label it had; `dart` has the edge's first half now.
  struct SplitCritical {
    Dart dart;
    Label label;
  };
  // An edge of a block is a fan of volumes, so it has two critical darts at most.
  using SplitCriticals = absl::InlinedVector<SplitCritical, 2>;

  // Splits the edge of d, every dart of it in this block. O(volumes around it).
  SplitCriticals SplitEdge(Dart d) {
    writer_.Begin();
    const bool closed = FindFan(d);
    const Dart end = map_.template beta<1>(d);
    const int level = std::max(F::StartLevel(map_, d), F::StartLevel(map_, end)) + 1;
    const Vertex middle = NewVertex(Midpoint(F::StartPoint(map_, d), F::StartPoint(map_, end)), level);
    const size_t count = fan_.size();
    second_.clear();
    for (Dart x : fan_) {
      const Cell cell = map_.template attribute<3>(x);
      const Dart y = writer_.New(middle, cell);
      writer_.CountCell(cell, 1);
      writer_.Link1(y, map_.template beta<1>(x));
      writer_.Link1(x, y);
      second_.push_back(y);
    }
    writer_.CountVertex(middle, count);
    map_.template set_dart_of_attribute<0>(middle, second_[0]);
    // Neighbours in the fan run against each other: halves are linked crosswise, by beta_2 and beta_3 in
    // turn.
    for (size_t i = 0; i + 1 < count || (closed && i < count); ++i) {
      const size_t j = i + 1 == count ? 0 : i + 1;
      if (i % 2 == 0) {
        writer_.template Link<2>(fan_[i], second_[j]);
        writer_.template Link<2>(second_[i], fan_[j]);
      } else {
        writer_.template Link<3>(fan_[i], second_[j]);
        writer_.template Link<3>(second_[i], fan_[j]);
      }
    }
    SplitCriticals criticals;
    for (size_t i = 0; i < count; ++i) {
      if (block_.IsCritical(fan_[i])) criticals.push_back(DeriveHalves(fan_[i], second_[i]));
    }
    return criticals;
  }

  // Splits the whole face of level l in which `corner` leaves a vertex of level <= l, on both sides; all four
  // edges are split already. O(darts of the face).
  void SplitFace(Dart corner, int l) {
    std::array<Dart, 4> arriving;
    std::array<Point3, 4> points;
    Dart d = corner;
    for (int k = 0; k < 4; ++k) {
      points[k] = F::StartPoint(map_, d);
      while (F::EndLevel(map_, d) != l + 1) d = map_.template beta<1>(d);
      arriving[k] = d;
      d = map_.template beta<1>(d);
      while (F::StartLevel(map_, d) > l) d = map_.template beta<1>(d);
    }
    writer_.Begin();
    const Vertex centre = NewVertex(FaceCentre(points), l + 1);
    const bool two_sided = !map_.template is_free<3>(corner);
    const Cell cell = map_.template attribute<3>(corner);
    std::array<Dart, 4> inward, outward, leaving;
    for (int k = 0; k < 4; ++k) {
      leaving[k] = map_.template beta<1>(arriving[k]);
      const Vertex middle = map_.template attribute<0>(leaving[k]);
      inward[k] = writer_.New(middle, cell);
      outward[k] = writer_.New(centre, cell);
      writer_.template Link<2>(inward[k], outward[k]);
      writer_.CountVertex(middle, two_sided ? 2 : 1);
    }
    for (int k = 0; k < 4; ++k) {
      writer_.Link1(arriving[k], inward[k]);
      writer_.Link1(inward[k], outward[(k + 3) % 4]);
      writer_.Link1(outward[k], leaving[k]);
    }
    writer_.CountCell(cell, 8);
    writer_.CountVertex(centre, two_sided ? 8 : 4);
    map_.template set_dart_of_attribute<0>(centre, outward[0]);
    if (two_sided) MirrorFace(arriving, leaving, inward, outward, centre);
    if (block_.IsCritical(corner)) DeriveFace(arriving, inward, outward, l);
  }

  // The label that names the face of level l, of which d is a dart, in a SplitFace message: of the labels of
  // level l of its four edges the one that ends in digit 2, which exactly one does unless the face has fresh
  // roots; then any. Whole or already split edges alike. O(darts of the face).
  Label FaceName(Dart d, int l) const {
    Label name;
    Dart e = d;
    do {
      name = AncestorLabel(block_.critical(e).label, l);
      if (l == 0 || LastDigit(name) == 2) return name;
      e = map_.template beta<1>(e);
    } while (e != d);
    return name;
  }

  // Splits the inside of a hexahedron whose twelve edges and six faces are split already into its eight
  // children, which it returns by child number. `frame` was made before or after those splits: its darts are
  // the same. O(darts on its boundary).
  std::array<Cell, 8> SplitVolume(Cell cell, const F& frame, const std::array<Point3, 8>& corners) {
    writer_.Begin();
    const CellId id = map_.template info_of_attribute<3>(cell).id;
    const Vertex centre = NewVertex(VolumeCentre(corners), frame.level + 1);
    std::array<Cell, 8> children;
    for (unsigned c = 0; c < 8; ++c) {
      children[c] = map_.template create_attribute<3>();
      auto& info = map_.template info_of_attribute<3>(children[c]);
      info.id = id.Child(c);
      info.reference = frame.first[hexahedron::kCornerRole[c]];
      map_.template set_dart_of_attribute<3>(children[c], info.reference);
    }
    darts_of_.fill(0);
    WalkLines(frame);
    for (unsigned role = 0; role < hexahedron::kRoles; ++role) MakeWall(role, centre, children);
    map_.template set_dart_of_attribute<0>(centre, walls_[0].to_face);
    writer_.CountVertex(centre, hexahedron::kRoles);
    for (unsigned role = 0; role < hexahedron::kRoles; ++role) LinkWall(role);
    size_t moved = 0;
    for (unsigned role = 0; role < hexahedron::kRoles; ++role) {
      const unsigned child = hexahedron::StartCorner(role);
      const size_t adopted = Adopt(frame, role, children[child]);
      darts_of_[child] += adopted;
      moved += adopted;
    }
    for (unsigned c = 0; c < 8; ++c) writer_.CountCell(children[c], darts_of_[c]);
    writer_.DiscountCell(cell, moved);
    return children;
  }

  // Labels that came into being since the last call: what kept messages may wait for.
  std::vector<Label>& made_labels() { return made_; }

 private:
  // What one role contributes to the twelve inner faces: the face between the two ends of the role's edge, as
  // far as it hangs on the role's outer face. The line from the edge's middle m to the face's centre f has
  // two sides: the near one in the child at the edge's start, and the far one in the child at its end.
  struct Wall {
    Dart near_last;         // arrives at m, in the near child; f -> m
    Dart far_first;         // leaves m, in the far child; m -> f
    Dart to_face;           // volume centre -> f, in the near child
    Dart from_centre_last;  // f -> volume centre, in the far child
  };

  Vertex NewVertex(const Point3& p, int level) {
    const Vertex v = map_.template create_attribute<0>(typename Lcc::Point(p[0], p[1], p[2]));
    map_.template info_of_attribute<0>(v).level = static_cast<uint8_t>(level);
    return v;
  }

  // The darts of the edge of d in this block, into fan_: in fan order, linked by beta_2 (from even to odd)
  // and beta_3 in turn. Whether the last is linked to the first.
  bool FindFan(Dart d) {
    // Back to where the fan begins, or once around.
    Dart begin = d;
    while (!map_.template is_free<3>(begin)) {
      begin = map_.template beta<3, 2>(begin);
      if (begin == d) break;
    }
    const bool closed = !map_.template is_free<3>(begin);
    fan_.clear();
    Dart x = begin;
    while (true) {
      const Dart y = map_.template beta<2>(x);
      fan_.push_back(x);
      fan_.push_back(y);
      if (map_.template is_free<3>(y)) break;
      x = map_.template beta<3>(y);
      if (x == begin) break;
    }
    return closed;
  }

  SplitCritical DeriveHalves(Dart first, Dart second) {
    const Critical c = block_.critical(first);
    const unsigned begin = c.positive ? 0 : 1;
    block_.Relabel(first, ChildLabel(c.label, begin));
    block_.SetCritical(second, {ChildLabel(c.label, 1 - begin), c.peer, c.positive});
    made_.push_back(ChildLabel(c.label, 0));
    made_.push_back(ChildLabel(c.label, 1));
    return {first, c.label};
  }

  void DeriveFace(const std::array<Dart, 4>& arriving, const std::array<Dart, 4>& inward,
                  const std::array<Dart, 4>& outward, int l) {
    for (int k = 0; k < 4; ++k) {
      const Critical c = block_.critical(arriving[k]);
      // The base is the edge's label of level l, however deep the edge is split here by now.
      const Label base = AncestorLabel(c.label, l);
      const Label two = ChildLabel(base, 2);
      const Label three = ChildLabel(base, 3);
      block_.SetCritical(inward[k], {c.positive ? two : three, c.peer, c.positive});
      block_.SetCritical(outward[k], {c.positive ? three : two, c.peer, c.positive});
      made_.push_back(two);
      made_.push_back(three);
    }
  }

  void MirrorFace(const std::array<Dart, 4>& arriving, const std::array<Dart, 4>& leaving,
                  const std::array<Dart, 4>& inward, const std::array<Dart, 4>& outward, Vertex centre) {
    const Cell cell = map_.template attribute<3>(map_.template beta<3>(arriving[0]));
    std::array<Dart, 4> mirror_in, mirror_out;
    for (int k = 0; k < 4; ++k) {
      mirror_in[k] = writer_.New(map_.template attribute<0>(leaving[k]), cell);
      mirror_out[k] = writer_.New(centre, cell);
      writer_.template Link<2>(mirror_in[k], mirror_out[k]);
      writer_.template Link<3>(outward[k], mirror_in[k]);
      writer_.template Link<3>(inward[k], mirror_out[k]);
    }
    for (int k = 0; k < 4; ++k) {
      writer_.Link1(map_.template beta<3>(leaving[k]), mirror_in[k]);
      writer_.Link1(mirror_in[k], mirror_out[(k + 1) % 4]);
      writer_.Link1(mirror_out[k], map_.template beta<3>(arriving[k]));
    }
    writer_.CountCell(cell, 8);
  }

  // For each role the darts from the middle of its edge to the centre of its face, near side, in order; all
  // lines in line_, that of a role from line_begin_[role]. One dart, unless a neighbour has refined further.
  // Before any wall is built: walls change beta_2 of these darts, and the walk needs it.
  void WalkLines(const F& frame) {
    const int middle_level = frame.level + 1;
    line_.clear();
    for (unsigned role = 0; role < hexahedron::kRoles; ++role) {
      line_begin_[role] = line_.size();
      Dart x = map_.template beta<1>(frame.first[role]);
      half_is_dart_[role] = F::StartLevel(map_, x) == middle_level;
      if (!half_is_dart_[role]) {
        x = map_.template beta<1>(F::EdgeMiddle(map_, frame.first[role], frame.level));
      }
      line_.push_back(x);
      if (F::EndLevel(map_, x) == middle_level) continue;
      typename F::Line walk(map_, x);
      while (F::EndLevel(map_, walk.dart()) > middle_level) {
        walk.Advance();
        line_.push_back(walk.dart());
      }
    }
    line_begin_[hexahedron::kRoles] = line_.size();
  }
  size_t LineLength(unsigned role) const { return line_begin_[role + 1] - line_begin_[role]; }

  // The darts of a wall, linked along it and to the line.
  void MakeWall(unsigned role, Vertex centre, const std::array<Cell, 8>& children) {
    const unsigned near = hexahedron::StartCorner(role), far = hexahedron::EndCorner(role);
    Wall& wall = walls_[role];
    Dart near_before, far_before;
    Vertex from = map_.template attribute<0>(line_[line_begin_[role]]);
    for (size_t i = line_begin_[role]; i < line_begin_[role + 1]; ++i) {
      const Dart x = line_[i];
      const Dart y = map_.template beta<2>(x);
      const Vertex to = map_.template attribute<0>(y);
      const Dart x2 = writer_.New(to, children[near]);
      const Dart y2 = writer_.New(from, children[far]);
      writer_.CountVertex(to, 1);
      writer_.CountVertex(from, 1);
      writer_.template Link<3>(x2, y2);
      writer_.template Link<2>(x, x2);
      writer_.template Link<2>(y, y2);
      if (i == line_begin_[role]) {
        wall.near_last = x2;
        wall.far_first = y2;
      } else {
        writer_.Link1(x2, near_before);
        writer_.Link1(far_before, y2);
      }
      near_before = x2;
      far_before = y2;
      from = to;
    }
    wall.to_face = writer_.New(centre, children[near]);
    wall.from_centre_last = writer_.New(from, children[far]);
    writer_.CountVertex(from, 1);
    writer_.template Link<3>(wall.to_face, wall.from_centre_last);
    writer_.Link1(wall.to_face, near_before);
    writer_.Link1(far_before, wall.from_centre_last);
    darts_of_[near] += LineLength(role) + 1;
    darts_of_[far] += LineLength(role) + 1;
  }

  // A wall to its neighbours: the same inner face has the wall across; the other two faces of the child that
  // have the edge from the centre to the face's centre are those of the role and of the one before it.
  void LinkWall(unsigned role) {
    const Wall& wall = walls_[role];
    const Wall& beside = walls_[hexahedron::kAcross[role]];
    writer_.Link1(wall.near_last, beside.far_first);
    writer_.Link1(beside.from_centre_last, wall.to_face);
    writer_.template Link<2>(wall.to_face, walls_[hexahedron::PreviousRole(role)].from_centre_last);
  }

  // Gives a child the outer darts in the role's quarter of the role's face, and what hangs on them; those
  // that it has already bound the search. Returns how many.
  size_t Adopt(const F& frame, unsigned role, Cell child) {
    const Dart d = frame.first[role];
    // Four darts, from the corner over two lines of one dart, are the whole quarter.
    if (half_is_dart_[role] && LineLength(role) == 1 && LineLength(hexahedron::PreviousRole(role)) == 1) {
      const Dart a = map_.template beta<1>(d), b = map_.template beta<1>(a), c = map_.template beta<1>(b);
      if (map_.template beta<1>(c) == d && map_.template attribute<3>(d) != child) {
        for (Dart x : {d, a, b, c}) writer_.Move(x, child);
        return 4;
      }
    }
    size_t adopted = 0;
    stack_.push_back(d);
    while (!stack_.empty()) {
      const Dart x = stack_.back();
      stack_.pop_back();
      if (map_.template attribute<3>(x) == child) continue;
      writer_.Move(x, child);
      ++adopted;
      stack_.push_back(map_.template beta<1>(x));
      stack_.push_back(map_.template beta<2>(x));
    }
    return adopted;
  }

  BlockT& block_;
  Lcc& map_;
  DartWriter<BlockT> writer_;
  std::vector<Label> made_;
  std::vector<Dart> fan_, second_;
  std::array<Wall, hexahedron::kRoles> walls_;
  std::vector<Dart> line_;
  std::array<size_t, hexahedron::kRoles + 1> line_begin_;
  // Whether the first half of a role's edge is one dart.
  std::array<bool, hexahedron::kRoles> half_is_dart_;
  // By child number: darts that it has been given.
  std::array<size_t, 8> darts_of_;
  std::vector<Dart> stack_;
};

}  // namespace ndmap

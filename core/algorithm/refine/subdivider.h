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
#include "core/map/link.h"

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

  explicit Subdivider(BlockT& block) : block_(block), map_(block.map()) {}

  // A critical dart of an edge that was split, with the label it had; `dart` has the edge's first half now.
  struct SplitCritical {
    Dart dart;
    Label label;
  };
  // An edge of a block is a fan of volumes, so it has two critical darts at most.
  using SplitCriticals = absl::InlinedVector<SplitCritical, 2>;

  // Splits the edge of d, every dart of it in this block. O(volumes around it).
  SplitCriticals SplitEdge(Dart d) {
    const Fan fan = FanOf(d);
    const Dart end = map_.template beta<1>(d);
    const int level = std::max(F::StartLevel(map_, d), F::StartLevel(map_, end)) + 1;
    const Vertex middle = NewVertex(Midpoint(F::StartPoint(map_, d), F::StartPoint(map_, end)), level);
    absl::InlinedVector<Dart, 16> second;
    for (Dart x : fan.darts) {
      const Dart y = map_.create_dart();
      LinkBeta1(map_, y, map_.template beta<1>(x));
      LinkBeta1(map_, x, y);
      map_.template set_dart_attribute<0>(y, middle);
      map_.template set_dart_attribute<3>(y, map_.template attribute<3>(x));
      second.push_back(y);
    }
    // Neighbours in the fan run against each other: halves are linked crosswise, by beta_2 and beta_3 in
    // turn.
    const size_t count = fan.darts.size();
    for (size_t i = 0; i + 1 < count || (fan.closed && i < count); ++i) {
      const size_t j = i + 1 == count ? 0 : i + 1;
      if (i % 2 == 0) {
        map_.template basic_link_beta_for_involution<2>(fan.darts[i], second[j]);
        map_.template basic_link_beta_for_involution<2>(second[i], fan.darts[j]);
      } else {
        map_.template basic_link_beta_for_involution<3>(fan.darts[i], second[j]);
        map_.template basic_link_beta_for_involution<3>(second[i], fan.darts[j]);
      }
    }
    SplitCriticals criticals;
    for (size_t i = 0; i < count; ++i) {
      if (block_.IsCritical(fan.darts[i])) criticals.push_back(DeriveHalves(fan.darts[i], second[i]));
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
    const Vertex centre = NewVertex(FaceCentre(points), l + 1);
    const bool two_sided = !map_.template is_free<3>(corner);
    std::array<Dart, 4> inward, outward, leaving;
    for (int k = 0; k < 4; ++k) {
      leaving[k] = map_.template beta<1>(arriving[k]);
      const Vertex middle = map_.template attribute<0>(leaving[k]);
      inward[k] = NewDart(middle, arriving[k]);
      outward[k] = NewDart(centre, arriving[k]);
      map_.template basic_link_beta_for_involution<2>(inward[k], outward[k]);
    }
    for (int k = 0; k < 4; ++k) {
      LinkBeta1(map_, arriving[k], inward[k]);
      LinkBeta1(map_, inward[k], outward[(k + 3) % 4]);
      LinkBeta1(map_, outward[k], leaving[k]);
    }
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
  // children. `frame` was made before or after those splits: its darts are the same. O(darts on its
  // boundary).
  void SplitVolume(Cell cell, const F& frame) {
    const std::array<Point3, 8> corners = frame.Corners(map_);
    const CellId id = map_.template info_of_attribute<3>(cell).id;
    const Vertex centre = NewVertex(VolumeCentre(corners), frame.level + 1);
    std::array<Cell, 8> children;
    for (unsigned c = 0; c < 8; ++c) {
      children[c] = map_.template create_attribute<3>();
      auto& info = map_.template info_of_attribute<3>(children[c]);
      info.id = id.Child(c);
      info.reference = frame.first[hexahedron::kCornerRole[c]];
    }
    for (unsigned role = 0; role < hexahedron::kRoles; ++role) WalkLine(frame, role);
    for (unsigned role = 0; role < hexahedron::kRoles; ++role) BuildWall(role, centre, children);
    for (unsigned role = 0; role < hexahedron::kRoles; ++role) {
      const Wall& wall = walls_[role];
      const Wall& beside = walls_[hexahedron::kAcross[role]];
      LinkBeta1(map_, wall.near_last, beside.far_first);
      LinkBeta1(map_, beside.from_centre_last, wall.to_face);
      map_.template basic_link_beta_for_involution<2>(
          wall.to_face, walls_[hexahedron::PreviousRole(role)].from_centre_last);
    }
    for (unsigned role = 0; role < hexahedron::kRoles; ++role) {
      Adopt(frame.first[role], children[hexahedron::StartCorner(role)]);
    }
  }

  // Labels that came into being since the last call: what kept messages may wait for.
  std::vector<Label>& made_labels() { return made_; }

 private:
  // The darts of an edge in this block in fan order, linked by beta_2 (from even to odd) and beta_3 in turn.
  struct Fan {
    absl::InlinedVector<Dart, 16> darts;
    bool closed = false;
  };

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

  // A dart that starts at a vertex, in the cell of another dart.
  Dart NewDart(Vertex start, Dart like) { return NewDart(start, map_.template attribute<3>(like)); }
  Dart NewDart(Vertex start, Cell cell) {
    const Dart d = map_.create_dart();
    map_.template set_dart_attribute<0>(d, start);
    map_.template set_dart_attribute<3>(d, cell);
    return d;
  }

  Fan FanOf(Dart d) {
    // Back to where the fan begins, or once around.
    Dart begin = d;
    while (!map_.template is_free<3>(begin)) {
      begin = map_.template beta<3, 2>(begin);
      if (begin == d) break;
    }
    Fan fan;
    fan.closed = !map_.template is_free<3>(begin);
    Dart x = begin;
    while (true) {
      const Dart y = map_.template beta<2>(x);
      fan.darts.push_back(x);
      fan.darts.push_back(y);
      if (map_.template is_free<3>(y)) break;
      x = map_.template beta<3>(y);
      if (x == begin) break;
    }
    return fan;
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
    std::array<Dart, 4> mirror_in, mirror_out;
    for (int k = 0; k < 4; ++k) {
      const Dart back = map_.template beta<3>(arriving[k]);
      mirror_in[k] = NewDart(map_.template attribute<0>(leaving[k]), back);
      mirror_out[k] = NewDart(centre, back);
      map_.template basic_link_beta_for_involution<2>(mirror_in[k], mirror_out[k]);
      map_.template basic_link_beta_for_involution<3>(outward[k], mirror_in[k]);
      map_.template basic_link_beta_for_involution<3>(inward[k], mirror_out[k]);
    }
    for (int k = 0; k < 4; ++k) {
      LinkBeta1(map_, map_.template beta<3>(leaving[k]), mirror_in[k]);
      LinkBeta1(map_, mirror_in[k], mirror_out[(k + 1) % 4]);
      LinkBeta1(map_, mirror_out[k], map_.template beta<3>(arriving[k]));
    }
  }

  // The darts from the middle of the role's edge to the centre of its face, near side, in order. Before any
  // wall is built: walls change beta_2 of these darts, and the walk needs it.
  void WalkLine(const F& frame, unsigned role) {
    Line& line = lines_[role];
    line.clear();
    typename F::Line walk(map_, map_.template beta<1>(F::EdgeMiddle(map_, frame.first[role], frame.level)));
    line.push_back(walk.dart());
    while (F::EndLevel(map_, walk.dart()) > frame.level + 1) {
      walk.Advance();
      line.push_back(walk.dart());
    }
  }

  void BuildWall(unsigned role, Vertex centre, const std::array<Cell, 8>& children) {
    const Cell near = children[hexahedron::StartCorner(role)];
    const Cell far = children[hexahedron::EndCorner(role)];
    Wall& wall = walls_[role];
    Dart near_before, far_before;
    for (size_t i = 0; i < lines_[role].size(); ++i) {
      const Dart x = lines_[role][i];
      const Dart y = map_.template beta<2>(x);
      const Dart x2 = NewDart(map_.template attribute<0>(y), near);
      const Dart y2 = NewDart(map_.template attribute<0>(x), far);
      map_.template basic_link_beta_for_involution<3>(x2, y2);
      map_.template basic_link_beta_for_involution<2>(x, x2);
      map_.template basic_link_beta_for_involution<2>(y, y2);
      if (i == 0) {
        wall.near_last = x2;
        wall.far_first = y2;
      } else {
        LinkBeta1(map_, x2, near_before);
        LinkBeta1(map_, far_before, y2);
      }
      near_before = x2;
      far_before = y2;
    }
    wall.to_face = NewDart(centre, near);
    wall.from_centre_last = NewDart(map_.template attribute<0>(near_before), far);
    map_.template basic_link_beta_for_involution<3>(wall.to_face, wall.from_centre_last);
    LinkBeta1(map_, wall.to_face, near_before);
    LinkBeta1(map_, far_before, wall.from_centre_last);
  }

  // Gives a child the outer darts around d; those it has already bound the search.
  void Adopt(Dart d, Cell child) {
    stack_.push_back(d);
    while (!stack_.empty()) {
      const Dart x = stack_.back();
      stack_.pop_back();
      if (map_.template attribute<3>(x) == child) continue;
      map_.template set_dart_attribute<3>(x, child);
      stack_.push_back(map_.template beta<1>(x));
      stack_.push_back(map_.template beta<2>(x));
    }
  }

  BlockT& block_;
  Lcc& map_;
  std::vector<Label> made_;
  std::array<Wall, hexahedron::kRoles> walls_;
  using Line = absl::InlinedVector<Dart, 4>;
  std::array<Line, hexahedron::kRoles> lines_;
  std::vector<Dart> stack_;
};

}  // namespace ndmap

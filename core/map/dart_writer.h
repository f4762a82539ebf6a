// SPDX-License-Identifier: GPL-3.0-or-later
// Makes and links many darts at a time, for algorithms that know what they build: without what CGAL's
// functions look up for every dart. Darts do not count at once as references of their attributes; the
// algorithm says how many there are, once an attribute. CGAL's storage does it all with CGAL's functions.
#pragma once

#include <bitset>
#include <cstddef>

#include "core/map/dart_index.h"
#include "core/map/link.h"

namespace ndmap {

template <class BlockT>
class DartWriter {
 public:
  using Lcc = typename BlockT::Lcc;
  using Dart = typename BlockT::Dart;
  using Vertex = typename BlockT::Types::Vertex;
  using Cell = typename BlockT::Types::Cell;
  static constexpr int n = BlockT::n;

  explicit DartWriter(Lcc& map) : map_(map) {}

  // To be called after others have changed the map or its marks.
  void Begin() { marks_known_ = false; }

  // A dart without links that starts at a vertex, in a cell; CountVertex() and CountCell() must follow.
  // Throws std::bad_alloc.
  Dart New(Vertex vertex, Cell cell) {
    if constexpr (kFlat) {
      const Dart d = NewRow();
      map_.darts().template set_attribute<kColumn<0>>(d, vertex.index);
      map_.darts().template set_attribute<kColumn<n>>(d, cell.index);
      return d;
    } else {
      const Dart d = map_.create_dart();
      map_.template set_dart_attribute<0>(d, vertex);
      map_.template set_dart_attribute<n>(d, cell);
      return d;
    }
  }
  // Gives a dart of one cell to another; DiscountCell() and CountCell() must follow.
  void Move(Dart d, Cell cell) {
    if constexpr (kFlat) {
      map_.darts().template set_attribute<kColumn<n>>(d, cell.index);
    } else {
      map_.template set_dart_attribute<n>(d, cell);
    }
  }
  // So many darts were made or moved with this attribute.
  void CountVertex(Vertex vertex, size_t darts) { Count<0>(vertex, darts); }
  void CountCell(Cell cell, size_t darts) { Count<n>(cell, darts); }
  // So many darts were moved away; a cell that has none left is erased.
  void DiscountCell(Cell cell, size_t darts) {
    if constexpr (kFlat) {
      for (size_t i = 0; i < darts; ++i) map_.template dec_attribute_ref_counting<n>(cell);
      if (map_.template get_attribute_ref_counting<n>(cell) == 0) map_.template erase_attribute<n>(cell);
    }
  }

  // beta_1(d) = e. All faces that this opens must be closed again before anybody asks for a beta_0 of theirs.
  void Link1(Dart d, Dart e) { LinkBeta1(map_, d, e); }
  // beta_i(d) = e and beta_i(e) = d, i > 1.
  template <unsigned i>
  void Link(Dart d, Dart e) {
    map_.template basic_link_beta_for_involution<i>(d, e);
  }

 private:
  static constexpr bool kFlat = internal::kIsFlat<typename Lcc::Dart_container>;
  template <int i>
  static constexpr size_t kColumn = Lcc::Helper::template Dimension_index<i>::value;

  // As create_dart() does it, but the marks that mean "not marked" are looked up once.
  Dart NewRow() {
    if (!marks_known_) {
      const Dart d = map_.create_dart();
      marks_ = map_.get_dart_marks(d);
      marks_known_ = true;
      return d;
    }
    const Dart d = map_.darts().emplace();
    if (marks_.any()) map_.set_dart_marks(d, marks_);
    return d;
  }

  template <unsigned i, class Attribute>
  void Count([[maybe_unused]] Attribute attribute, [[maybe_unused]] size_t darts) {
    if constexpr (kFlat) {
      for (size_t k = 0; k < darts; ++k) map_.template inc_attribute_ref_counting<i>(attribute);
    }
  }

  Lcc& map_;
  std::bitset<Lcc::NB_MARKS> marks_;
  bool marks_known_ = false;
};

}  // namespace ndmap

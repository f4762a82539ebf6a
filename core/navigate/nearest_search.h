// SPDX-License-Identifier: GPL-3.0-or-later
// The vertex of a block that is nearest to a point, of those equally near the one with the lowest id: exact
// for any finite point. In parts: Choose() weighs cells by their boxes, which needs the index alone and
// belongs on a thread of its own when there are many; Step() looks at the vertices of those chosen.
#pragma once

#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

#include "core/map/ids.h"
#include "core/navigate/cell_index.h"

namespace ndmap {

struct NearestVertex {
  // Squared and rounded: it may be infinite though there is a vertex.
  double distance = std::numeric_limits<double>::infinity();
  CellId id;
  DartIndex dart;
};

class NearestSearch {
 public:
  // Both must outlive it.
  NearestSearch(const CellIndex& index, const InitialCells& initial, const Point3& point);
  // Whether Choose() weighs few cells: then it may be called wherever Step() is.
  bool ChoosesQuickly() const { return !far_ && most_ <= kFew; }
  // Chooses the cells to look at next. After those before were looked at, and not when done().
  // O(cells) for a point far away, else O(chosen log chosen), from call to call four times as many.
  void Choose();
  // Looks at up to `budget` of the chosen cells of the block, which is as it was when the index was made;
  // true when all were looked at.
  template <class BlockT>
  bool Step(BlockT& block, size_t budget);
  // Whether nearest() is known.
  bool done() const { return done_; }
  // Without a dart if there is no cell.
  const NearestVertex& nearest() const { return nearest_; }

 private:
  static constexpr size_t kFirst = 16, kFew = 256;

  template <class BlockT, class Names>
  void Look(BlockT& block, Names& names, const CellIndex::Entry& entry);

  const CellIndex& index_;
  const InitialCells& initial_;
  const Point3 point_;
  const bool far_;
  bool done_;
  // Of a point that is not far: how many cells Choose() takes.
  size_t most_ = kFirst;
  // With the squared distances of their boxes, 0 for all when the point is far.
  std::vector<std::pair<double, const CellIndex::Entry*>> chosen_;
  size_t next_ = 0;
  NearestVertex nearest_;
  Point3 at_{};
};

}  // namespace ndmap

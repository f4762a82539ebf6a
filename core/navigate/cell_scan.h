// SPDX-License-Identifier: GPL-3.0-or-later
// All i-cells of one block, each once, a part of the block at a time, without a table of those that were met:
// an i-cell is told at the one of its darts that has the lowest index. Those at faces that are not closed in
// the block may be in other blocks, or twice in this one where two parts of the mesh touch, under one id:
// they are kept apart, ascending by id.
#pragma once

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/container/flat_hash_set.h"
#include "core/map/block.h"
#include "core/map/partial_scan.h"
#include "core/names/cell_names.h"

namespace ndmap {

template <class BlockT>
class CellScan {
 public:
  using Lcc = typename BlockT::Lcc;
  using Dart = typename BlockT::Dart;
  using Cell = typename BlockT::Types::Cell;
  using Named = std::pair<CellId, DartIndex>;

  // The block must not change before the scan is over. `initial` may be null for n-cells.
  CellScan(BlockT& block, const InitialCells* initial, unsigned dimension)
      : map_(block.map()), dimension_(dimension), cells_(map_.template attributes<3>()) {
    if (dimension < 3) names_.emplace(map_, *initial);
  }

  // Looks at the next n-cells, at most `budget` of them, and appends the cells in the inside of the block.
  // True when there are no more. O(darts of the n-cells around each).
  bool Step(size_t budget, std::vector<Named>& inner) {
    return cells_.Next(&budget, [&](Cell cell) { Visit(cell, inner); });
  }

  // After Step() was true: the cells at its faces. O(n log n).
  std::vector<Named> TakeOuter() {
    std::vector<Named> outer(outer_.begin(), outer_.end());
    outer_.clear();
    std::sort(outer.begin(), outer.end());
    return outer;
  }

 private:
  void Visit(Cell cell, std::vector<Named>& inner) {
    if (dimension_ == 3) {
      const auto& info = map_.template info_of_attribute<3>(cell);
      inner.emplace_back(info.id, IndexOf(map_, info.reference));
      return;
    }
    const size_t darts = names_->Look(cell);
    for (size_t k = 0; k < darts; ++k) {
      const Dart d = names_->dart(k);
      bool open = false;
      if (!IsLowest(d, &open)) continue;
      if (open) {
        outer_.try_emplace(names_->Name(k, dimension_), IndexOf(map_, d));
      } else {
        inner.emplace_back(names_->Name(k, dimension_), IndexOf(map_, d));
      }
    }
  }

  // Whether no dart of the cell has a lower index; then also whether it lies on an open face.
  bool IsLowest(Dart first, bool* open) {
    seen_.clear();
    todo_.clear();
    const uint32_t index = IndexOf(map_, first).value;
    bool lowest = Meet(first, index);
    for (size_t k = 0; lowest && k < todo_.size(); ++k) {
      const Dart d = todo_[k];
      const bool is_free = map_.template is_free<3>(d);
      *open = *open || is_free;
      const Dart before = map_.template beta<0>(d);
      if (dimension_ == 0) {
        lowest = Meet(map_.template beta<2, 1>(d), index) && Meet(map_.template beta<2>(before), index) &&
                 (is_free ||
                  (Meet(map_.template beta<3, 1>(d), index) && Meet(map_.template beta<3>(before), index)));
      } else {
        lowest = Meet(map_.template beta<1>(d), dimension_ == 2, index) &&
                 Meet(map_.template beta<2>(d), dimension_ == 1, index) &&
                 (is_free || Meet(map_.template beta<3>(d), index));
      }
    }
    return lowest;
  }
  bool Meet(Dart d, bool belongs, uint32_t index) { return !belongs || Meet(d, index); }
  bool Meet(Dart d, uint32_t index) {
    const uint32_t here = IndexOf(map_, d).value;
    if (here < index) return false;
    if (seen_.insert(here).second) todo_.push_back(d);
    return true;
  }

  Lcc& map_;
  const unsigned dimension_;
  PartialScan<typename Lcc::template Attribute_range<3>::type> cells_;
  std::optional<CellNames<BlockT>> names_;
  absl::flat_hash_set<uint32_t> seen_;
  std::vector<Dart> todo_;
  absl::flat_hash_map<CellId, DartIndex> outer_;
};

}  // namespace ndmap

// SPDX-License-Identifier: GPL-3.0-or-later
// The ids of the cells of given darts.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/types/span.h"
#include "core/map/block.h"
#include "core/names/cell_names.h"

namespace ndmap {

// By dimension: of a dart's vertex, edge, face and volume; that is none in a map of dimension 2.
using DartIds = std::array<CellId, 4>;

// Names darts cell by cell: those of one n-cell cost O(its darts) together.
template <class BlockT>
class DartNamer {
 public:
  // The darts must stay where they are.
  DartNamer(const InitialCells& initial, absl::Span<const DartIndex> darts)
      : initial_(initial), darts_(darts), ids_(darts.size()), corners_(darts.size()) {}

  // Up to `budget` darts; true when all are named. NOT_FOUND: no dart with this index.
  absl::StatusOr<bool> Step(BlockT& block, size_t budget) {
    auto& map = block.map();
    if (names_ == nullptr) names_ = std::make_unique<CellNames<BlockT>>(map, initial_);
    for (size_t k = 0; k < budget && next_ < darts_.size(); ++k, ++next_) {
      const auto d = DartAt(map, darts_[next_]);
      if (d == BlockT::Lcc::null_handle) {
        return absl::NotFoundError(
            absl::StrCat("block ", block.id().value, " has no dart ", darts_[next_].value));
      }
      if (!known_.contains(darts_[next_])) Learn(map, map.template attribute<BlockT::n>(d));
      const Known& known = known_.at(darts_[next_]);
      ids_[next_] = known.ids;
      corners_[next_] = known.corner;
    }
    return next_ == darts_.size();
  }

  const std::vector<DartIds>& ids() const { return ids_; }
  // The corner of its n-cell where each dart starts (core/mesh/cell_darts.h), or CellNames::kNoCorner.
  const std::vector<uint32_t>& corners() const { return corners_; }

 private:
  struct Known {
    DartIds ids;
    uint32_t corner = 0;
  };

  void Learn(typename BlockT::Lcc& map, typename BlockT::Types::Cell cell) {
    // Darts of one cell mostly come together; those of more than some cells are not kept.
    if (known_.size() > 4096) known_.clear();
    const size_t darts = names_->Look(cell);
    for (size_t i = 0; i < darts; ++i) {
      Known& known = known_[IndexOf(map, names_->dart(i))];
      for (unsigned k = 0; k <= BlockT::n; ++k) known.ids[k] = names_->Name(i, k);
      known.corner = names_->Corner(i);
    }
  }

  const InitialCells& initial_;
  const absl::Span<const DartIndex> darts_;
  std::vector<DartIds> ids_;
  std::vector<uint32_t> corners_;
  size_t next_ = 0;
  std::unique_ptr<CellNames<BlockT>> names_;
  absl::flat_hash_map<DartIndex, Known> known_;
};

}  // namespace ndmap

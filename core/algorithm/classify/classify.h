// SPDX-License-Identifier: GPL-3.0-or-later
// Tells every cell's state: cut, inside or outside. Cut: the closed box of its corners meets the surface. A
// cell that is not cut is on one side altogether, and so are all that are reached from it
// over faces of others that are not cut: within the block such a set is asked once, by parity at the centre
// of one of them (of its box, if that is no hexahedron).
//
// Counts: cut, inside, outside.
#pragma once

#include <memory>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/status/statusor.h"
#include "core/algorithm/block_algorithm.h"
#include "core/algorithm/refine/frame.h"
#include "core/algorithm/refine/geometry.h"
#include "core/geometry/parity.h"
#include "core/geometry/surface_index.h"
#include "core/map/block.h"
#include "core/map/handle_hash.h"
#include "core/map/partial_scan.h"

namespace ndmap {

template <class BlockT>
class Classify final : public BlockAlgorithm {
 public:
  using Lcc = typename BlockT::Lcc;
  using Dart = typename BlockT::Dart;
  using Cell = typename BlockT::Types::Cell;
  using F = Frame<BlockT>;

  static absl::StatusOr<std::unique_ptr<BlockAlgorithm>> Make(const Parameters&,
                                                              const Environment& environment, BlockT& block) {
    auto index = environment.Index([&block] { return VertexBox(block); });
    if (!index.ok()) return index.status();
    auto parity = environment.Parity();
    if (!parity.ok()) return parity.status();
    return std::make_unique<Classify>(*std::move(index), *std::move(parity), block);
  }

  Classify(std::shared_ptr<const SurfaceIndex> index, std::shared_ptr<const ParityIndex> parity,
           BlockT& block)
      : index_(std::move(index)),
        parity_(std::move(parity)),
        block_(block),
        map_(block.map()),
        scan_(map_.template attributes<3>()) {}

  absl::StatusOr<bool> Start(size_t budget) override {
    if (cancelled_) return true;
    // A table that grows is copied in one go.
    if (cells_.empty()) number_of_.reserve(map_.template number_of_attributes<3>());
    return scan_.Next(&budget, [this](Cell cell) {
      number_of_[cell] = static_cast<uint32_t>(cells_.size());
      group_.push_back(static_cast<uint32_t>(cells_.size()));
      cells_.push_back(cell);
    });
  }

  absl::Status Receive(BlockId from, const Message&, Outbox&) override {
    return absl::InvalidArgumentError(
        absl::StrCat("classify: a message from block ", from.value, ", expected none"));
  }

  absl::StatusOr<size_t> Work(size_t budget, Outbox&) override {
    size_t steps = 0;
    for (; steps < budget && HasWork(); ++steps) {
      if (tested_ < cells_.size()) {
        Test(cells_[tested_++]);
      } else if (joined_ < DartIndexBound(map_)) {
        // A dart costs far less than a cell.
        for (int i = 0; i < 32 && joined_ < DartIndexBound(map_); ++i) Join(DartIndex{joined_++});
      } else {
        Decide(decided_++);
      }
    }
    return steps;
  }

  bool HasWork() const override { return !cancelled_ && decided_ < cells_.size(); }
  void Cancel() override { cancelled_ = true; }

  absl::StatusOr<bool> Finish(size_t) override {
    block_.Touch();
    return true;
  }

  Report report() const override {
    Report report;
    report.counts["cut"] = cut_;
    report.counts["inside"] = inside_;
    report.counts["outside"] = outside_;
    return report;
  }

 private:
  CellState& State(Cell cell) { return map_.template info_of_attribute<3>(cell).state; }

  void Test(Cell cell) {
    CellState& state = State(cell);
    if (state == CellState::kUnknown) {
      state = index_->Meets(CellBox<BlockT>(map_, cell)) ? CellState::kCut : CellState::kClear;
    }
    if (state == CellState::kCut) ++cut_;
  }

  // A point of the cell's box, which does not meet the surface.
  Point3 Centre(Cell cell) {
    if (map_.template info_of_attribute<3>(cell).kind == CellKind::kHexahedron) {
      return VolumeCentre(F::Of(map_, cell).Corners(map_));
    }
    const Box3 box = CellBox<BlockT>(map_, cell);
    return Midpoint(box.lo, box.hi);
  }

  uint32_t GroupOf(uint32_t i) {
    while (group_[i] != i) i = group_[i] = group_[group_[i]];
    return i;
  }

  void Join(DartIndex index) {
    const Dart d = DartAt(map_, index);
    if (d == Lcc::null_handle || map_.template is_free<3>(d)) return;
    const Cell a = map_.template attribute<3>(d);
    const Cell b = map_.template attribute<3>(map_.template beta<3>(d));
    if (a == b || State(a) == CellState::kCut || State(b) == CellState::kCut) return;
    const uint32_t x = GroupOf(number_of_.find(a)->second);
    const uint32_t y = GroupOf(number_of_.find(b)->second);
    group_[std::max(x, y)] = std::min(x, y);
  }

  // Groups are named by their lowest cell, so its state is known before any other's of the group.
  void Decide(size_t i) {
    CellState& state = State(cells_[i]);
    if (state == CellState::kCut) return;
    const uint32_t group = GroupOf(static_cast<uint32_t>(i));
    if (group != i) {
      state = State(cells_[group]);
    } else if (state == CellState::kClear) {
      state = parity_->Inside(Centre(cells_[i])) ? CellState::kInside : CellState::kOutside;
    }
    ++(state == CellState::kInside ? inside_ : outside_);
  }

  const std::shared_ptr<const SurfaceIndex> index_;
  const std::shared_ptr<const ParityIndex> parity_;
  BlockT& block_;
  Lcc& map_;
  PartialScan<typename Lcc::template Attribute_range<3>::type> scan_;
  std::vector<Cell> cells_;
  absl::flat_hash_map<Cell, uint32_t, HandleHash<Cell>> number_of_;
  std::vector<uint32_t> group_;
  size_t tested_ = 0;
  uint32_t joined_ = 0;
  size_t decided_ = 0;
  bool cancelled_ = false;
  int64_t cut_ = 0;
  int64_t inside_ = 0;
  int64_t outside_ = 0;
};

}  // namespace ndmap

// SPDX-License-Identifier: GPL-3.0-or-later
// Tells every cell's state: cut, inside or outside. Cut: the closed box of its corners meets the surface. A
// cell that is not cut is on one side altogether, and so are all that are reached from it over faces of
// others that are not cut: within the block such a set has the side of one of its cells that is known, or is
// asked once, by parity at the centre of one of them (of its box, if that is no hexahedron). A cell whose
// state is known costs no more than a look at it.
//
// Counts: cut, inside, outside.
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "core/algorithm/block_algorithm.h"
#include "core/algorithm/refine/frame.h"
#include "core/algorithm/refine/geometry.h"
#include "core/geometry/parity.h"
#include "core/geometry/surface_index.h"
#include "core/map/block.h"
#include "core/map/handle_table.h"
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
    if (!reserved_) {
      number_of_.Reserve(map_.template attributes<3>());
      cells_.reserve(map_.template number_of_attributes<3>());
      reserved_ = true;
    }
    return scan_.Next(&budget, [this](Cell cell) {
      const CellState state = State(cell);
      if (state == CellState::kUnknown || state == CellState::kClear) {
        number_of_[cell] = static_cast<uint32_t>(cells_.size());
        cells_.push_back({cell, static_cast<uint32_t>(cells_.size()), CellState::kUnknown});
      } else {
        Tally(state);
      }
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
        Test(cells_[tested_++].cell);
      } else if (joined_ < cells_.size()) {
        Join(static_cast<uint32_t>(joined_++));
      } else {
        Decide(static_cast<uint32_t>(decided_++));
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

  void Tally(CellState state) {
    ++(state == CellState::kCut ? cut_ : state == CellState::kInside ? inside_ : outside_);
  }

  void Test(Cell cell) {
    CellState& state = State(cell);
    if (state == CellState::kUnknown) {
      state = index_->Meets(CellBox<BlockT>(map_, cell)) ? CellState::kCut : CellState::kClear;
    }
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
    while (cells_[i].group != i) i = cells_[i].group = cells_[cells_[i].group].group;
    return i;
  }

  // Puts a cell into one group with those beyond its faces that are not cut either. Of two hexahedra one sees
  // the whole of the other's face in one face of its own, the one of higher level, if their levels differ: so
  // a dart of each of the six faces will do. O(1), or O(its darts) for other cells.
  void Join(uint32_t i) {
    const Cell cell = cells_[i].cell;
    const auto& info = map_.template info_of_attribute<3>(cell);
    if (info.state == CellState::kCut) return;
    if (info.kind != CellKind::kHexahedron) {
      for (auto it = map_.template darts_of_cell<3>(info.reference).begin(); it.cont(); ++it) JoinOver(it, i);
    } else if (!JoinOverWhole(info.reference, info.id.level(), i)) {
      const F frame = F::Of(map_, cell);
      for (unsigned f = 0; f < hexahedron::kFaces; ++f) JoinOver(frame.first[hexahedron::Role(f, 0)], i);
    }
  }

  // The same where two faces of the hexahedron at the edge of r, which leaves a corner, are whole and have
  // whole edges: then the other four faces are those beyond their other edges at the corner and opposite to
  // it. False if they are not.
  bool JoinOverWhole(Dart r, int level, uint32_t i) {
    const Dart r1 = map_.template beta<1>(r), r2 = map_.template beta<1>(r1);
    const Dart s = map_.template beta<2>(r);
    const Dart s1 = map_.template beta<1>(s), s2 = map_.template beta<1>(s1);
    // A face of four darts that has corners beside `r` and opposite to it is the whole face.
    if (map_.template beta<1, 1>(r2) != r || map_.template beta<1, 1>(s2) != s ||
        F::StartLevel(map_, r2) > level || F::EndLevel(map_, s2) > level) {
      return false;
    }
    for (const Dart d : {r, s}) JoinOver(d, i);
    for (const Dart d : {r1, r2, s1, s2}) JoinOver(map_.template beta<2>(d), i);
    return true;
  }

  void JoinOver(Dart d, uint32_t i) {
    if (map_.template is_free<3>(d)) return;
    const Cell beyond = map_.template attribute<3>(map_.template beta<3>(d));
    const CellState state = State(beyond);
    if (state == CellState::kCut) return;
    uint32_t x = GroupOf(i);
    if (state != CellState::kClear) {
      cells_[x].side = state;
      return;
    }
    uint32_t y = GroupOf(number_of_.Get(beyond));
    if (x == y) return;
    if (x > y) std::swap(x, y);
    cells_[y].group = x;
    if (cells_[x].side == CellState::kUnknown) cells_[x].side = cells_[y].side;
  }

  void Decide(uint32_t i) {
    CellState& state = State(cells_[i].cell);
    if (state == CellState::kClear) {
      CellState& side = cells_[GroupOf(i)].side;
      if (side == CellState::kUnknown) {
        side = parity_->Inside(Centre(cells_[i].cell)) ? CellState::kInside : CellState::kOutside;
      }
      state = side;
    }
    Tally(state);
  }

  const std::shared_ptr<const SurfaceIndex> index_;
  const std::shared_ptr<const ParityIndex> parity_;
  BlockT& block_;
  Lcc& map_;
  PartialScan<typename Lcc::template Attribute_range<3>::type> scan_;
  // The cells that have no side yet when it begins.
  struct Undecided {
    Cell cell;
    uint32_t group;  // the number of another of the group, lower, or its own
    CellState side;  // of the group, where group is its own number; kUnknown until it is known
  };
  std::vector<Undecided> cells_;
  HandleTable<Cell, uint32_t> number_of_;
  bool reserved_ = false;
  size_t tested_ = 0;
  size_t joined_ = 0;
  size_t decided_ = 0;
  bool cancelled_ = false;
  int64_t cut_ = 0;
  int64_t inside_ = 0;
  int64_t outside_ = 0;
};

}  // namespace ndmap

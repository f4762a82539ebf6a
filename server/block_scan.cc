// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/block_scan.h"

#include "core/attributes/cell_measure.h"
#include "server/block_version.h"

namespace ndmap::server {
namespace {

constexpr size_t kScannedCellsAStep = 64;
constexpr size_t kOuterPointsAStep = 2048;
constexpr absl::Duration kLookForCaller = absl::Milliseconds(20);

}  // namespace

absl::StatusOr<bool> BlockScan::Step(Block3& block, std::vector<FoundCell>& inner) {
  if (!scan_) {
    scan_.emplace(block, initial_.get(), dimension_);
    version_ = block.version();
  }
  if (absl::Status s = CheckUnchanged(block, version_); !s.ok()) return s;
  const auto found = [&block](const CellScan<Block3>::Named& cell) {
    return FoundCell{cell.first, cell.second, block.id().value};
  };
  if (!scanned_) {
    named_.clear();
    scanned_ = scan_->Step(kScannedCellsAStep, named_);
    for (const auto& cell : named_) inner.push_back(found(cell));
    if (!scanned_) return false;
    named_ = scan_->TakeOuter();
    outer_.reserve(named_.size());
    for (const auto& cell : named_) outer_.push_back(found(cell));
    named_ = {};
  }
  if (!points_) return true;
  CellMeasure<Block3> measure(block.map());
  for (size_t k = 0; k < kOuterPointsAStep && next_ < outer_.size(); ++k, ++next_) {
    FoundCell& cell = outer_[next_];
    cell.point = measure.CentreOf(DartAt(block.map(), cell.dart), dimension_);
  }
  return next_ == outer_.size();
}

ScanTurns::Turn::~Turn() {
  absl::MutexLock lock(&turns_->mutex_);
  --turns_->running_;
}

absl::StatusOr<std::unique_ptr<ScanTurns::Turn>> ScanTurns::Wait(const std::function<bool()>& gone) {
  absl::MutexLock lock(&mutex_);
  const auto free = [this]() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) { return running_ < kAtOnce; };
  while (!mutex_.AwaitWithTimeout(absl::Condition(&free), kLookForCaller)) {
    if (gone()) return absl::CancelledError("the caller has gone");
  }
  ++running_;
  return std::unique_ptr<Turn>(new Turn(this));
}

}  // namespace ndmap::server

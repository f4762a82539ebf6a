// SPDX-License-Identifier: GPL-3.0-or-later
// The cells of a dimension that has no attributes, and so no rows: found by looking at a block, a step of
// about a millisecond at a time. Cells at the block's faces may be in other blocks, too; they are put
// together by the server that is asked, which counts each in the lowest of its blocks (found_cells.h).
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"
#include "core/names/initial_cells.h"
#include "core/navigate/cell_scan.h"
#include "server/attribute_columns.h"

namespace ndmap::server {

class BlockScan {
 public:
  // `points`: whether those of the outer cells are wanted. `initial` may be null for cells of dimension 3.
  BlockScan(unsigned dimension, bool points, std::shared_ptr<const InitialCells> initial)
      : dimension_(dimension), points_(points), initial_(std::move(initial)) {}

  // Appends cells in the inside of the block. True when the block is done. ABORTED when it changed since the
  // first step.
  absl::StatusOr<bool> Step(Block3& block, std::vector<FoundCell>& inner);
  // The version of the block that was looked at.
  uint64_t version() const { return version_; }
  // When it is done: ascending by id.
  std::vector<FoundCell> TakeOuter() { return std::move(outer_); }

 private:
  const unsigned dimension_;
  const bool points_;
  const std::shared_ptr<const InitialCells> initial_;
  uint64_t version_ = 0;
  std::optional<CellScan<Block3>> scan_;
  std::vector<CellScan<Block3>::Named> named_;
  bool scanned_ = false;
  std::vector<FoundCell> outer_;
  size_t next_ = 0;
};

// At most some scans on one server at one time, each of which may remember the faces of a block; the others
// wait for their turn.
class ScanTurns {
 public:
  static constexpr int kAtOnce = 4;
  class Turn {
   public:
    ~Turn();
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;

   private:
    friend class ScanTurns;
    explicit Turn(ScanTurns* turns) : turns_(turns) {}
    ScanTurns* const turns_;
  };
  // CANCELLED when the caller has gone before.
  absl::StatusOr<std::unique_ptr<Turn>> Wait(const std::function<bool()>& gone);

 private:
  absl::Mutex mutex_;
  int running_ ABSL_GUARDED_BY(mutex_) = 0;
};

}  // namespace ndmap::server

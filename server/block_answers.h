// SPDX-License-Identifier: GPL-3.0-or-later
// What one block of this server knows of cells: the questions that block servers put to each other
// (AskBlock). Answers are read between two steps of what runs on the block, at one version of it.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/container/flat_hash_map.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"
#include "core/navigate/cell_index.h"
#include "ndmap/v1/navigate.pb.h"
#include "server/block_host.h"

namespace ndmap::server {

class BlockAnswers {
 public:
  // `max_darts`: of one answer, and of one question.
  BlockAnswers(BlockHost* host, uint64_t max_darts) : host_(host), max_darts_(max_darts) {}

  // Where the cells of a block are, as it is now: kept until the block changes. O(block) when it has changed.
  // FAILED_PRECONDITION when it is at another version than `version`; 0 names none.
  absl::StatusOr<std::shared_ptr<const CellIndex>> Index(const std::string& map, uint32_t block,
                                                         uint64_t version, const std::function<bool()>& gone);

  // Blocks; `gone` (checked before each step) ends it early with CANCELLED.
  absl::Status Answer(const v1::AskBlockRequest& request, const std::function<bool()>& gone,
                      v1::AskBlockResponse& response);

 private:
  struct Asked;
  absl::Status Expand(const Asked& asked, v1::AskBlockResponse& response);
  absl::Status Name(const Asked& asked, v1::AskBlockResponse& response);
  absl::Status Find(const Asked& asked, v1::AskBlockResponse& response);
  absl::Status Resolve(const Asked& asked, v1::AskBlockResponse& response);

  BlockHost* const host_;
  const uint64_t max_darts_;
  absl::Mutex mutex_;
  absl::flat_hash_map<std::pair<std::string, uint32_t>, std::shared_ptr<const CellIndex>> indexes_
      ABSL_GUARDED_BY(mutex_);
};

// An id from the wire. INVALID_ARGUMENT when it is none.
absl::StatusOr<CellId> FromWire(const v1::CellId& id);
void ToWire(const CellId& id, v1::CellId& wire);

}  // namespace ndmap::server

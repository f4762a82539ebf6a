// SPDX-License-Identifier: GPL-3.0-or-later
// Cells across blocks, by Proposition 1 and without gathering anything: whoever can put questions to blocks
// (a block service to its peers, a test to blocks in memory) gets from a set of darts to all darts of their
// i-cells. Every question about neighbourhoods is a word of such closures: the cells that meet hexahedra H in
// a vertex are Close(3, Close(0, Close(3, H))).
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/types/span.h"
#include "core/navigate/dart_set.h"
#include "core/navigate/orbit.h"

namespace ndmap {

// The interface "ask block b".
class BlockAccess {
 public:
  struct Question {
    BlockId block;
    // 0: any. Otherwise FAILED_PRECONDITION if the block is at another version.
    uint64_t version = 0;
    unsigned dimension = 0;
    std::vector<OrbitSeed> seeds;
  };

  virtual ~BlockAccess() = default;
  virtual uint32_t block_count() const = 0;
  // Asks different blocks at the same time; one piece for each question, in order.
  virtual absl::StatusOr<std::vector<OrbitPiece>> Expand(absl::Span<const Question> questions) = 0;
};

// All darts of the i-cells that have a dart in `start`. ABORTED when a block changed on the way (ask again);
// RESOURCE_EXHAUSTED naming the limit above `most` darts; UNAVAILABLE when a label has no partner, as happens
// while a job changes the map. The number of rounds of questions is the greatest number of crossings from a
// dart of `start` to a dart of its cell.
absl::StatusOr<DartSet> Close(BlockAccess& access, unsigned i, const DartSet& start, size_t most);

}  // namespace ndmap

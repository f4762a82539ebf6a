// SPDX-License-Identifier: GPL-3.0-or-later
// k blocks in one thread under a seeded scheduler: messages arrive in random order, duplicated and late, work
// is done in random slices. Everything that may happen between real services happens here too, and a failure
// is a seed.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/algorithm/block_algorithm.h"

namespace ndmap {

struct SimulatorOptions {
  uint64_t seed = 0;
  // Messages of one channel (ordered pair of blocks) arrive in the order they were sent.
  bool ordered_channels = false;
  // Chance in a thousand that a message that was delivered will be delivered once more.
  int duplicates_per_mille = 100;
  // Start, own work and Finish are done in slices of 1 ... this many steps.
  int largest_slice = 16;
  // Gives up with DEADLINE_EXCEEDED after this many deliveries and slices.
  uint64_t most_events = 200'000'000;
};

// What a phase cost: messages sent (a broadcast is one for each receiver), largest number under way at once.
struct PhaseStatistics {
  uint64_t messages = 0;
  uint64_t duplicates = 0;
  size_t most_in_flight = 0;
};

// Runs one phase: Start on all, in parts, then deliveries and slices of work in random order until nothing is
// left, then Finish on all. `algorithms`: one a block. Returns the merged report. The status names the seed.
class Simulator {
 public:
  explicit Simulator(const SimulatorOptions& options) : options_(options), random_(options.seed) {}

  absl::StatusOr<Report> RunPhase(const std::vector<std::unique_ptr<BlockAlgorithm>>& algorithms);

  const PhaseStatistics& statistics() const { return statistics_; }

 private:
  struct InFlight {
    BlockId from;
    BlockId to;
    uint8_t kind;
    Label label;
    std::string payload;
    bool duplicate;
  };
  class BlockOutbox;

  void Put(BlockId from, BlockId to, const Message& message);
  // A number in 0 ... n - 1, the same on every platform.
  uint64_t Random(uint64_t n) { return random_() % n; }
  // Steps for one call.
  size_t RandomSlice() { return 1 + Random(static_cast<uint64_t>(options_.largest_slice)); }
  InFlight TakeMessage();

  const SimulatorOptions options_;
  std::mt19937_64 random_;
  std::deque<InFlight> in_flight_;
  uint32_t block_count_ = 0;
  PhaseStatistics statistics_;
};

}  // namespace ndmap

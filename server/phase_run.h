// SPDX-License-Identifier: GPL-3.0-or-later
// An algorithm while it runs on one block: what it says goes into batches, what it hears is heard once, and
// both are counted as quiescence detection needs it. Used by one thread at a time.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/algorithm/block_algorithm.h"
#include "core/algorithm/message.h"
#include "server/sequence_filter.h"
#include "server/transport.h"

namespace ndmap::server {

// A block of the map as the others see it.
struct Peer {
  // Of the process that hosts it: batches that carry another one are dropped.
  uint64_t incarnation = 0;
  // In another process.
  bool remote = false;
};

struct PhaseSetup {
  std::string map;
  PhaseId id;
  // By block number, the own one included.
  std::vector<Peer> peers;
};

// Counters of one block in one phase, as the wire has them (BlockProgress).
struct PhaseCounters {
  // Once a message, at enqueue.
  uint64_t messages_sent = 0;
  // Without duplicates, after what the message caused was counted as sent.
  uint64_t messages_received = 0;
  uint64_t bytes_sent = 0;
  uint64_t batches_sent = 0;
  uint64_t remote_messages_sent = 0;
  uint64_t remote_bytes_sent = 0;
  // Steps of own work.
  uint64_t steps = 0;
};

class PhaseRun : public Outbox {
 public:
  // A batch of this size is sent without waiting for more.
  static constexpr size_t kFullBatch = 1 << 20;

  PhaseRun(BlockId self, PhaseSetup setup, std::unique_ptr<BlockAlgorithm> algorithm);

  const PhaseSetup& setup() const { return setup_; }
  BlockAlgorithm& algorithm() { return *algorithm_; }
  const PhaseCounters& counters() const { return counters_; }

  // Whether the batch is to be applied: from a block and incarnation of this phase, and not seen before.
  bool Accept(const Envelope& envelope);
  // Applies messages [from, from + most) of an accepted batch; returns how many there were.
  absl::StatusOr<size_t> Receive(const Envelope& envelope, size_t from, size_t most);
  // At most `budget` steps of own work; returns how many were done.
  absl::StatusOr<size_t> Work(size_t budget);

  // The batches that are full.
  std::vector<Envelope> TakeFull() { return std::exchange(full_, {}); }
  // The batch for `to` as far as it is filled. It must not be empty.
  Envelope TakePending(BlockId to);
  bool HasPending(BlockId to) const { return !pending_[to.value].empty(); }
  bool HasPending() const;

  void Send(BlockId to, const Message& message) override;
  void Broadcast(const Message& message) override;

 private:
  const BlockId self_;
  const PhaseSetup setup_;
  std::unique_ptr<BlockAlgorithm> algorithm_;
  // By block.
  std::vector<MessageBatch> pending_;
  std::vector<uint64_t> last_sequence_;
  std::vector<SequenceFilter> seen_;
  std::vector<Envelope> full_;
  PhaseCounters counters_;
  absl::Status misuse_;
};

}  // namespace ndmap::server

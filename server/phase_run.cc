// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/phase_run.h"

#include <algorithm>

#include "absl/strings/str_cat.h"

namespace ndmap::server {

PhaseRun::PhaseRun(BlockId self, PhaseSetup setup, std::unique_ptr<BlockAlgorithm> algorithm)
    : self_(self),
      setup_(std::move(setup)),
      algorithm_(std::move(algorithm)),
      pending_(setup_.peers.size()),
      last_sequence_(setup_.peers.size()),
      seen_(setup_.peers.size()) {}

bool PhaseRun::Accept(const Envelope& envelope) {
  const uint32_t source = envelope.source.value;
  if (source >= setup_.peers.size() || envelope.incarnation != setup_.peers[source].incarnation) return false;
  return seen_[source].FirstTime(envelope.sequence);
}

absl::StatusOr<size_t> PhaseRun::Receive(const Envelope& envelope, size_t from, size_t most) {
  const size_t count = std::min(most, envelope.messages.size() - from);
  for (size_t i = from; i < from + count; ++i) {
    absl::Status status = algorithm_->Receive(envelope.source, envelope.messages[i], *this);
    ++counters_.messages_received;
    if (!status.ok()) return status;
    if (!misuse_.ok()) return misuse_;
  }
  return count;
}

absl::StatusOr<size_t> PhaseRun::Work(size_t budget) {
  absl::StatusOr<size_t> steps = algorithm_->Work(budget, *this);
  if (!steps.ok()) return steps;
  if (!misuse_.ok()) return misuse_;
  counters_.steps += *steps;
  return steps;
}

Envelope PhaseRun::TakePending(BlockId to) {
  MessageBatch& batch = pending_[to.value];
  const size_t bytes = batch.encoded_bytes();
  counters_.bytes_sent += bytes;
  ++counters_.batches_sent;
  if (setup_.peers[to.value].remote) {
    counters_.remote_messages_sent += batch.size();
    counters_.remote_bytes_sent += bytes;
  }
  Envelope envelope{setup_.map,
                    setup_.id,
                    self_,
                    to,
                    setup_.peers[self_.value].incarnation,
                    ++last_sequence_[to.value],
                    std::move(batch)};
  batch = MessageBatch();
  return envelope;
}

bool PhaseRun::HasPending() const {
  return std::any_of(pending_.begin(), pending_.end(), [](const MessageBatch& b) { return !b.empty(); });
}

void PhaseRun::Send(BlockId to, const Message& message) {
  if (to.value >= pending_.size() || to == self_) {
    misuse_ = absl::InternalError(absl::StrCat("the algorithm sent a message from block ", self_.value,
                                               " to block ", to.value, " of ", pending_.size()));
    return;
  }
  ++counters_.messages_sent;
  pending_[to.value].Add(message);
  if (pending_[to.value].encoded_bytes() >= kFullBatch) full_.push_back(TakePending(to));
}

void PhaseRun::Broadcast(const Message& message) {
  for (uint32_t b = 0; b < pending_.size(); ++b) {
    if (b != self_.value) Send(BlockId{b}, message);
  }
}

}  // namespace ndmap::server

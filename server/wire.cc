// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/wire.h"

#include <utility>

namespace ndmap::server {

PhaseId FromWire(const v1::PhaseKey& key) { return {key.job(), key.attempt(), key.phase()}; }

void ToWire(const Envelope& envelope, v1::Batch& batch) {
  v1::PhaseKey& key = *batch.mutable_key();
  key.set_map(envelope.map);
  key.set_job(envelope.phase.job);
  key.set_attempt(envelope.phase.attempt);
  key.set_phase(envelope.phase.phase);
  batch.set_source(envelope.source.value);
  batch.set_destination(envelope.destination.value);
  batch.set_incarnation(envelope.incarnation);
  batch.set_sequence(envelope.sequence);
  batch.set_messages(envelope.messages.Encode());
}

absl::StatusOr<Envelope> FromWire(const v1::Batch& batch) {
  absl::StatusOr<MessageBatch> messages = MessageBatch::Decode(batch.messages());
  if (!messages.ok()) return absl::DataLossError(messages.status().message());
  return Envelope{
      batch.key().map(),   FromWire(batch.key()), BlockId{batch.source()}, BlockId{batch.destination()},
      batch.incarnation(), batch.sequence(),      *std::move(messages)};
}

void ToWire(BlockId block, const BlockSnapshot& snapshot, v1::BlockProgress& progress) {
  progress.set_block(block.value);
  progress.set_idle(snapshot.idle);
  for (const auto& [name, count] : snapshot.counts) (*progress.mutable_counts())[name] = count;
  const PhaseCounters& c = snapshot.counters;
  progress.set_messages_sent(c.messages_sent);
  progress.set_messages_received(c.messages_received);
  progress.set_bytes_sent(c.bytes_sent);
  progress.set_batches_sent(c.batches_sent);
  progress.set_remote_messages_sent(c.remote_messages_sent);
  progress.set_remote_bytes_sent(c.remote_bytes_sent);
  progress.set_steps(c.steps);
  progress.set_accounted_bytes(snapshot.accounted_bytes);
  progress.set_busy_seconds(snapshot.busy_seconds);
  progress.set_outstanding_bytes(snapshot.outstanding_bytes);
}

void ToWire(const Report& report, v1::Report& wire) {
  for (const auto& [name, count] : report.counts) (*wire.mutable_counts())[name] = count;
  wire.set_digest_hi(report.digest.hi);
  wire.set_digest_lo(report.digest.lo);
  for (const std::string& finding : report.findings) wire.add_findings(finding);
}

void ToWire(const Label& label, v1::Label& wire) {
  wire.set_root(label.root);
  wire.set_path(label.path);
}

}  // namespace ndmap::server

// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/attribute_gates.h"

#include <algorithm>
#include <utility>

#include "service/guarded.h"

namespace ndmap::server {
namespace {

// The phase is short: so long reads and writes wait for its end before they are told to come again.
constexpr absl::Duration kPhasePatience = absl::Seconds(2);
// What is applied belongs to a part under way: another server is only a moment behind with its phase.
constexpr absl::Duration kApplyPatience = absl::Seconds(8);

absl::Status InPhase() {
  return absl::AbortedError("the map's attributes are being brought up to date: try again in a moment");
}

}  // namespace

absl::Status AttributesChanged() {
  return absl::AbortedError("the map or its attributes changed during the question: ask again");
}

absl::Status AttributeGates::BeginPart() {
  {
    absl::MutexLock lock(&mutex_);
    const auto open = [this]() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) { return !in_phase_; };
    const auto free = [this]() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) { return in_phase_ || !part_; };
    // Parts end, each after some seconds at most; the phase is waited for a while.
    do {
      if (!mutex_.AwaitWithTimeout(absl::Condition(&open), kPhasePatience)) return InPhase();
      mutex_.Await(absl::Condition(&free));
    } while (in_phase_);
    part_ = true;
  }
  absl::Status settled = Settle();
  if (!settled.ok()) EndPart();
  return settled;
}

void AttributeGates::EndPart() {
  absl::MutexLock lock(&mutex_);
  part_ = false;
}

uint64_t AttributeGates::NextSequence() {
  absl::MutexLock lock(&mutex_);
  last_sequence_ = std::max(last_sequence_ + 1, static_cast<uint64_t>(absl::ToUnixMicros(absl::Now())));
  return last_sequence_;
}

void AttributeGates::SetUnsettled(std::function<absl::Status()> again) { unsettled_ = std::move(again); }

absl::Status AttributeGates::Settle() {
  if (!unsettled_) return absl::OkStatus();
  absl::Status status = service::Guarded(unsettled_);
  if (status.ok()) unsettled_ = nullptr;
  return status;
}

absl::Status AttributeGates::BeginApply() {
  absl::MutexLock lock(&mutex_);
  const auto free = [this]() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) { return !working_ && !apply_; };
  if (!mutex_.AwaitWithTimeout(absl::Condition(&free), kApplyPatience)) return InPhase();
  apply_ = true;
  return absl::OkStatus();
}

void AttributeGates::EndApply() {
  absl::MutexLock lock(&mutex_);
  apply_ = false;
}

absl::StatusOr<uint64_t> AttributeGates::Update(absl::Duration patience) {
  absl::MutexLock lock(&mutex_);
  const auto open = [this]() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) { return !in_phase_; };
  if (!mutex_.AwaitWithTimeout(absl::Condition(&open), patience)) return InPhase();
  return update_;
}

absl::Status AttributeGates::BeginPhase() {
  {
    absl::MutexLock lock(&mutex_);
    in_phase_ = true;
    working_ = false;
    const auto free = [this]() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) { return !part_; };
    mutex_.Await(absl::Condition(&free));
  }
  return Settle();
}

void AttributeGates::RunPhase() {
  absl::MutexLock lock(&mutex_);
  working_ = true;
  const auto free = [this]() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) { return !apply_; };
  mutex_.Await(absl::Condition(&free));
}

void AttributeGates::EndPhase(uint64_t job) {
  absl::MutexLock lock(&mutex_);
  in_phase_ = false;
  working_ = false;
  if (job != 0) update_ = job;
}

}  // namespace ndmap::server

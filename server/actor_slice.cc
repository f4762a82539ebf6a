// SPDX-License-Identifier: GPL-3.0-or-later
// A slice of an actor: tasks, then a step of what runs, until its time is over.
#include <time.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "absl/strings/str_cat.h"
#include "server/actor.h"
#include "service/guarded.h"

namespace ndmap::server {
namespace {

using Clock = std::chrono::steady_clock;
using service::Guarded;

// Messages applied between two looks at the clock.
constexpr size_t kMessagesAStep = 64;
// The algorithm's own steps between two looks at the clock take about this long. Their cost changes by a
// factor of tens from one part of the work to another; kMaxBudget bounds what one surprise takes.
constexpr absl::Duration kWorkStep = absl::Milliseconds(1);
constexpr size_t kFirstBudget = 16;
constexpr size_t kMaxBudget = 1024;

double ThreadCpuSeconds() {
  timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

const absl::Status& StatusOf(const absl::Status& status) { return status; }
template <class T>
const absl::Status& StatusOf(const absl::StatusOr<T>& result) {
  return result.status();
}

absl::Duration Since(Clock::time_point begin) { return absl::FromChrono(Clock::now() - begin); }

}  // namespace

template <class F>
auto BlockActor::Change(F f) -> decltype(f()) {
  bool thrown = false;
  auto result = Guarded(f, &thrown);
  if (thrown && broken_.ok() && run_->algorithm().changes_map()) {
    broken_ = absl::DataLossError(absl::StrCat("block ", self_.value, " of map \"", run_->setup().map,
                                               "\" was left half changed by: ", StatusOf(result).message(),
                                               "; delete the map"));
  }
  return result;
}

void BlockActor::CancelRun(const PhaseId& id) {
  if (!Runs(id) || failed_ || stage_ == Stage::kFinishing) return;
  absl::Status status = Change([this]() -> absl::Status {
    run_->algorithm().Cancel();
    return absl::OkStatus();
  });
  if (!status.ok()) Fail(std::move(status));
}

bool BlockActor::RunSlice() {
  const double cpu = ThreadCpuSeconds();
  const Clock::time_point begin = Clock::now();
  absl::Status status = Guarded([&]() -> absl::Status {
    do {
      const bool did_task = RunTasks();
      if (!RunStep() && !did_task) break;
    } while (Since(begin) < options_.slice);
    if (stage_ == Stage::kStarted && !failed_) Flush(!has_current_ && !MayWork());
    return absl::OkStatus();
  });
  if (!status.ok()) Fail(std::move(status));
  return EndSlice(ThreadCpuSeconds() - cpu);
}

bool BlockActor::RunTasks() {
  std::list<Waiting> tasks;
  absl::Status closed;
  bool lost = false;
  {
    MutexLock lock(&mutex_);
    tasks.swap(tasks_);
    closed = closed_;
    lost = std::exchange(lost_mail_, false);
  }
  if (!closed.ok()) EndPhase(closed);
  if (lost) Fail(absl::ResourceExhaustedError("out of memory: a batch could not be kept"));
  for (Waiting& waiting : tasks) waiting.task(waiting.needs == Needs::kSound ? broken_ : absl::OkStatus());
  return RunSlicedStep() || !tasks.empty();
}

bool BlockActor::RunSlicedStep() {
  std::list<Step> first;
  {
    MutexLock lock(&mutex_);
    if (sliced_.empty()) return false;
    first.splice(first.end(), sliced_, sliced_.begin());
  }
  if (first.front()(broken_) || !broken_.ok()) return true;
  absl::Status closed;
  {
    MutexLock lock(&mutex_);
    closed = closed_;
    if (closed.ok()) sliced_.splice(sliced_.end(), first);
  }
  if (!closed.ok()) first.front()(closed);
  return true;
}

bool BlockActor::RunStep() {
  switch (stage_) {
    case Stage::kNone:
      return false;
    case Stage::kStarting:
      return StartStep();
    case Stage::kFinishing:
      return FinishStep();
    case Stage::kStarted:
      break;
  }
  if (ReceiveStep()) return true;
  return MayWork() && !Throttled() && WorkStep();
}

void BlockActor::AdaptBudget(absl::Duration took, bool used_up) {
  if (took > kWorkStep) {
    budget_ = std::max<size_t>(1, static_cast<size_t>(static_cast<double>(budget_) * (kWorkStep / took)));
  } else if (took < kWorkStep / 2 && used_up) {
    budget_ = std::min(budget_ * 2, kMaxBudget);
  }
}

bool BlockActor::StartStep() {
  if (budget_ == 0) budget_ = kFirstBudget;
  const Clock::time_point begin = Clock::now();
  // Start() changes nothing in the block.
  absl::StatusOr<bool> over =
      failed_ ? snapshot().status
              : Guarded([this]() -> absl::StatusOr<bool> { return run_->algorithm().Start(budget_); });
  AdaptBudget(Since(begin), true);
  if (over.ok() && !*over) return true;
  if (!over.ok()) Fail(over.status());
  stage_ = Stage::kStarted;
  budget_ = kFirstBudget;
  std::exchange(started_, nullptr)(over.status());
  return true;
}

bool BlockActor::FinishStep() {
  if (budget_ == 0) budget_ = kFirstBudget;
  const Clock::time_point begin = Clock::now();
  absl::StatusOr<bool> over =
      failed_ ? snapshot().status
              : Change([this]() -> absl::StatusOr<bool> { return run_->algorithm().Finish(budget_); });
  AdaptBudget(Since(begin), true);
  if (!over.ok() || *over) Finished(over.status());
  return true;
}

void BlockActor::Finished(absl::Status status) {
  BlockSnapshot last = snapshot();
  absl::StatusOr<Report> report =
      Guarded([this]() -> absl::StatusOr<Report> { return run_->algorithm().report(); });
  status.Update(report.status());
  if (report.ok()) last.counts = report->counts;
  last.counters = run_->counters();
  if (options_.accounted_bytes) last.accounted_bytes = options_.accounted_bytes();
  auto done = std::exchange(finished_, nullptr);
  EndPhase(absl::OkStatus());
  done(std::move(status), std::move(last), report.ok() ? *std::move(report) : Report());
}

bool BlockActor::ReceiveStep() {
  if (!has_current_) {
    MutexLock lock(&mutex_);
    if (mailbox_.empty()) return false;
    current_ = std::move(mailbox_.front());
    mailbox_.pop_front();
    has_current_ = true;
  }
  if (!failed_ && !current_.accepted) {
    current_.accepted = run_->Accept(current_.envelope);
    if (!current_.accepted) current_.applied = current_.envelope.messages.size();
  }
  if (!failed_ && current_.applied < current_.envelope.messages.size()) {
    absl::StatusOr<size_t> applied = Change([&]() -> absl::StatusOr<size_t> {
      return run_->Receive(current_.envelope, current_.applied, kMessagesAStep);
    });
    if (applied.ok()) {
      current_.applied += *applied;
    } else {
      Fail(applied.status());
    }
    for (Envelope& full : run_->TakeFull()) SendOut(std::move(full));
  }
  if (failed_ || current_.applied >= current_.envelope.messages.size()) {
    has_current_ = false;
    std::exchange(current_, Mail()).taken();
  }
  return true;
}

bool BlockActor::WorkStep() {
  const Clock::time_point begin = Clock::now();
  absl::StatusOr<size_t> steps = Change([&]() -> absl::StatusOr<size_t> { return run_->Work(budget_); });
  for (Envelope& full : run_->TakeFull()) SendOut(std::move(full));
  if (!steps.ok()) {
    Fail(steps.status());
    return true;
  }
  AdaptBudget(Since(begin), *steps >= budget_);
  // No step although there is work: let others run first.
  return *steps > 0;
}

void BlockActor::Fail(absl::Status status) {
  if (!run_) return;
  failed_ = true;
  MutexLock lock(&mutex_);
  if (snapshot_.status.ok()) snapshot_.status = std::move(status);
}

// --- What goes out. ---

bool BlockActor::Throttled() const {
  MutexLock lock(&mutex_);
  return over_limit_ > 0;
}

// A batch goes out when it is full, when its destination has nothing of ours left to read, or when the block
// comes to rest; so none waits for a timer while its receiver starves.
void BlockActor::Flush(bool all) {
  const std::vector<Peer>& peers = run_->setup().peers;
  for (uint32_t b = 0; b < peers.size(); ++b) {
    if (!run_->HasPending(BlockId{b})) continue;
    if (!all && peers[b].remote) {
      MutexLock lock(&mutex_);
      if (outstanding_[b] > 0) continue;
    }
    SendOut(run_->TakePending(BlockId{b}));
  }
}

void BlockActor::SendOut(Envelope envelope) {
  const BlockId to = envelope.destination;
  const PhaseId id = envelope.phase;
  const uint64_t bytes = envelope.messages.encoded_bytes();
  {
    MutexLock lock(&mutex_);
    // Another phase was asked for meanwhile, and this one's batches are no longer counted.
    if (to.value >= outstanding_.size() || !(id == phase_)) return;
    const uint64_t before = outstanding_[to.value];
    outstanding_[to.value] += bytes;
    if (before <= options_.outstanding_limit && before + bytes > options_.outstanding_limit) ++over_limit_;
  }
  transport_->Send(std::move(envelope), [self = weak_from_this(), id, to, bytes] {
    if (std::shared_ptr<BlockActor> actor = self.lock()) actor->OnTaken(id, to, bytes);
  });
}

void BlockActor::OnTaken(const PhaseId& id, BlockId to, uint64_t bytes) {
  MutexLock lock(&mutex_);
  if (!open_ || !(id == phase_)) return;
  const uint64_t before = outstanding_[to.value];
  outstanding_[to.value] -= bytes;
  if (before > options_.outstanding_limit && before - bytes <= options_.outstanding_limit) --over_limit_;
  if (wake_when_taken_) ScheduleLocked();
}

bool BlockActor::EndSlice(double busy_seconds) {
  bool turned_to_rest = false;
  bool again = false;
  {
    const bool may_work = MayWork();
    const bool pending = run_ && !failed_ && run_->HasPending();
    Report report;
    if (run_ && !failed_) {
      absl::Status status = Guarded([&]() -> absl::Status {
        report = run_->algorithm().report();
        return absl::OkStatus();
      });
      if (!status.ok()) Fail(std::move(status));
    }
    MutexLock lock(&mutex_);
    if (run_) {
      snapshot_.counters = run_->counters();
      if (!failed_) snapshot_.counts = std::move(report.counts);
      snapshot_.busy_seconds += busy_seconds;
      if (options_.accounted_bytes) snapshot_.accounted_bytes = options_.accounted_bytes();
    }
    again = !tasks_.empty() || !sliced_.empty() || (run_ && !mailbox_.empty()) || has_current_ ||
            stage_ == Stage::kStarting || stage_ == Stage::kFinishing || (run_ && !closed_.ok()) ||
            lost_mail_ || (may_work && over_limit_ == 0);
    wake_when_taken_ = may_work || pending;
    scheduled_ = again;
    const bool idle = stage_ == Stage::kStarted && go_ && !failed_ && !may_work && !pending &&
                      mailbox_.empty() && !has_current_;
    turned_to_rest = (idle && !snapshot_.idle) || failed_;
    snapshot_.idle = idle;
  }
  if (turned_to_rest && options_.on_rest) options_.on_rest();
  return again;
}

}  // namespace ndmap::server

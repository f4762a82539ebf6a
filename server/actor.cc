// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/actor.h"

#include <time.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <new>
#include <utility>

#include "absl/strings/str_cat.h"

namespace ndmap::server {
namespace {

using Clock = std::chrono::steady_clock;

// Messages applied between two looks at the clock.
constexpr size_t kMessagesAStep = 64;
// Own work between two looks at the clock takes about this long.
constexpr std::chrono::microseconds kWorkStep(1000);
constexpr size_t kMaxBudget = 4096;

double ThreadCpuSeconds() {
  timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

// What a library throws inside an algorithm fails the job, not the process.
template <class F>
auto Guarded(F&& f) -> decltype(f()) {
  try {
    return f();
  } catch (const std::bad_alloc&) {
    return absl::ResourceExhaustedError("out of memory");
  } catch (const std::exception& e) {
    return absl::InternalError(absl::StrCat("exception: ", e.what()));
  }
}

}  // namespace

BlockActor::BlockActor(BlockId self, WorkerPool* pool, PeerTransport* transport, Options options)
    : self_(self), pool_(pool), transport_(transport), options_(std::move(options)) {}

BlockActor::~BlockActor() {
  for (Mail& mail : mailbox_) mail.taken();
  if (has_current_) current_.taken();
}

void BlockActor::ScheduleLocked() {
  if (scheduled_) return;
  scheduled_ = true;
  pool_->Enqueue(shared_from_this());
}

void BlockActor::Post(absl::AnyInvocable<void()> task) {
  MutexLock lock(&mutex_);
  tasks_.push_back(std::move(task));
  ScheduleLocked();
}

void BlockActor::PostSliced(absl::AnyInvocable<bool()> step) {
  MutexLock lock(&mutex_);
  sliced_.push_back(std::move(step));
  ScheduleLocked();
}

void BlockActor::Start(PhaseSetup setup, MakeRun make, absl::AnyInvocable<void(absl::Status)> done) {
  std::deque<Mail> dropped;
  {
    MutexLock lock(&mutex_);
    CloseLocked(dropped);
    open_ = true;
    phase_ = setup.id;
    outstanding_.assign(setup.peers.size(), 0);
    over_limit_ = 0;
    snapshot_ = BlockSnapshot();
  }
  for (Mail& mail : dropped) mail.taken();
  Post([this, setup = std::move(setup), make = std::move(make), done = std::move(done)]() mutable {
    if (std::exchange(has_current_, false)) current_.taken();
    run_.reset();
    go_ = failed_ = false;
    absl::Status status = Guarded([&]() -> absl::Status {
      absl::StatusOr<std::unique_ptr<BlockAlgorithm>> algorithm = make();
      if (!algorithm.ok()) return algorithm.status();
      run_ = std::make_unique<PhaseRun>(self_, std::move(setup), *std::move(algorithm));
      return run_->algorithm().Start();
    });
    if (!status.ok()) Fail(status);
    done(std::move(status));
  });
}

void BlockActor::Run(const PhaseId& id) {
  Post([this, id] {
    if (run_ && run_->setup().id == id) go_ = true;
  });
}

void BlockActor::Cancel(const PhaseId& id) {
  Post([this, id] {
    if (run_ && run_->setup().id == id && !failed_) run_->algorithm().Cancel();
  });
}

void BlockActor::CloseLocked(std::deque<Mail>& dropped) {
  open_ = false;
  dropped.swap(mailbox_);
  wake_when_taken_ = false;
}

void BlockActor::Finish(const PhaseId& id,
                        absl::AnyInvocable<void(absl::Status, BlockSnapshot, Report)> done) {
  Post([this, id, done = std::move(done)]() mutable {
    if (!run_ || !(run_->setup().id == id)) {
      done(absl::FailedPreconditionError(absl::StrCat("block ", self_.value, " does not run that phase")), {},
           {});
      return;
    }
    BlockSnapshot last = snapshot();
    std::deque<Mail> dropped;
    {
      MutexLock lock(&mutex_);
      CloseLocked(dropped);
    }
    for (Mail& mail : dropped) mail.taken();
    absl::Status status =
        failed_ ? last.status : Guarded([&]() -> absl::Status { return run_->algorithm().Finish(); });
    Report report = run_->algorithm().report();
    last.counts = report.counts;
    last.counters = run_->counters();
    if (options_.accounted_bytes) last.accounted_bytes = options_.accounted_bytes();
    run_.reset();
    go_ = failed_ = false;
    done(std::move(status), std::move(last), std::move(report));
  });
}

void BlockActor::Abandon(absl::AnyInvocable<void()> done) {
  Post([this, done = std::move(done)]() mutable {
    std::deque<Mail> dropped;
    {
      MutexLock lock(&mutex_);
      CloseLocked(dropped);
    }
    for (Mail& mail : dropped) mail.taken();
    if (std::exchange(has_current_, false)) current_.taken();
    run_.reset();
    go_ = failed_ = false;
    done();
  });
}

void BlockActor::Deliver(Envelope envelope, Taken taken) {
  {
    MutexLock lock(&mutex_);
    if (open_ && envelope.phase == phase_) {
      mailbox_.push_back({std::move(envelope), std::move(taken)});
      snapshot_.idle = false;
      ScheduleLocked();
      return;
    }
  }
  taken();
}

BlockSnapshot BlockActor::snapshot() const {
  MutexLock lock(&mutex_);
  BlockSnapshot result = snapshot_;
  for (uint64_t bytes : outstanding_) result.outstanding_bytes += bytes;
  return result;
}

// --- A slice. ---

bool BlockActor::RunSlice() {
  const double cpu = ThreadCpuSeconds();
  const Clock::time_point end = Clock::now() + absl::ToChronoMicroseconds(options_.slice);
  do {
    const bool did_task = RunTasks();
    if (!RunStep() && !did_task) break;
  } while (Clock::now() < end);
  if (run_ && !failed_) Flush(!has_current_ && !MayWork());
  return EndSlice(ThreadCpuSeconds() - cpu);
}

bool BlockActor::RunTasks() {
  std::deque<absl::AnyInvocable<void()>> tasks;
  absl::AnyInvocable<bool()> step;
  {
    MutexLock lock(&mutex_);
    tasks.swap(tasks_);
    if (!sliced_.empty()) {
      step = std::move(sliced_.front());
      sliced_.pop_front();
    }
  }
  for (auto& task : tasks) task();
  const bool did = !tasks.empty() || step;
  if (step && !step()) {
    MutexLock lock(&mutex_);
    sliced_.push_back(std::move(step));
  }
  return did;
}

bool BlockActor::RunStep() {
  if (!run_) return false;
  if (ReceiveStep()) return true;
  return MayWork() && !Throttled() && WorkStep();
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
    absl::StatusOr<size_t> applied = Guarded([&]() -> absl::StatusOr<size_t> {
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
  absl::StatusOr<size_t> steps = Guarded([&]() -> absl::StatusOr<size_t> { return run_->Work(budget_); });
  for (Envelope& full : run_->TakeFull()) SendOut(std::move(full));
  if (!steps.ok()) {
    Fail(steps.status());
    return true;
  }
  const auto took = std::chrono::duration_cast<std::chrono::microseconds>(Clock::now() - begin);
  if (took > kWorkStep) {
    budget_ = std::max<size_t>(1, budget_ * kWorkStep.count() / took.count());
  } else if (took < kWorkStep / 2 && *steps >= budget_) {
    budget_ = std::min(budget_ * 2, kMaxBudget);
  }
  // No step although there is work: let others run first.
  return *steps > 0;
}

void BlockActor::Fail(absl::Status status) {
  failed_ = true;
  MutexLock lock(&mutex_);
  snapshot_.status = std::move(status);
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
    absl::btree_map<std::string, int64_t> counts;
    if (run_) counts = run_->algorithm().report().counts;
    MutexLock lock(&mutex_);
    if (run_) {
      snapshot_.counters = run_->counters();
      snapshot_.counts = std::move(counts);
      snapshot_.busy_seconds += busy_seconds;
      if (options_.accounted_bytes) snapshot_.accounted_bytes = options_.accounted_bytes();
    }
    again = !tasks_.empty() || !sliced_.empty() || (run_ && !mailbox_.empty()) || has_current_ ||
            (may_work && over_limit_ == 0);
    wake_when_taken_ = may_work || pending;
    scheduled_ = again;
    const bool idle = run_ && go_ && !failed_ && !may_work && !pending && mailbox_.empty() && !has_current_;
    turned_to_rest = (idle && !snapshot_.idle) || failed_;
    snapshot_.idle = idle;
  }
  if (turned_to_rest && options_.on_rest) options_.on_rest();
  return again;
}

}  // namespace ndmap::server

// SPDX-License-Identifier: GPL-3.0-or-later
// A block as an actor: one thread at a time runs it, in slices of some milliseconds. Between slices' steps it
// answers queries, so that nobody waits longer than tens of milliseconds for one, or for a cancel. It knows
// no map and no gRPC: the block is reached through the algorithm and through closures.
//
// Whatever is asked of it is answered exactly once: when its turn comes, or with an error when it never will
// because the actor was closed or its pool has stopped. So a caller may wait for the answer, and what the
// closures refer to may live on the caller's stack.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <list>
#include <memory>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/functional/any_invocable.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "core/algorithm/block_algorithm.h"
#include "server/mutex.h"
#include "server/phase_run.h"
#include "server/transport.h"
#include "server/worker_pool.h"

namespace ndmap::server {

// A block at one instant of a phase.
struct BlockSnapshot {
  // Neither own work nor unread messages, and own work may begin. Counters of an idle block are exact; of
  // another one they are those of the end of its last slice.
  bool idle = false;
  PhaseCounters counters;
  absl::btree_map<std::string, int64_t> counts;
  uint64_t accounted_bytes = 0;
  double busy_seconds = 0;
  // Bytes sent and not yet taken in.
  uint64_t outstanding_bytes = 0;
  // The algorithm's error; it stands still since.
  absl::Status status;
};

class BlockActor final : public Runnable, public std::enable_shared_from_this<BlockActor> {
 public:
  struct Options {
    absl::Duration slice = absl::Milliseconds(5);
    // Own work rests while more than this is on its way to any one destination.
    uint64_t outstanding_limit = 8 << 20;
    // The block's accounted bytes, called between slices' steps; may be empty. What it holds (the block)
    // lives as long as the actor, whose last slice may end after its map was deleted.
    std::function<uint64_t()> accounted_bytes;
    // Called when the block turns idle or fails, on a worker thread; may be empty.
    std::function<void()> on_rest;
  };
  // Called once: with OK on the block's turn, or with the reason why it has none. Does not throw.
  using Task = absl::AnyInvocable<void(const absl::Status&)>;
  // The same, but with OK again and again until it returns true.
  using Step = absl::AnyInvocable<bool(const absl::Status&)>;
  // A block that was left half changed answers only what looks at no links: kAny.
  enum class Needs { kSound, kAny };

  // Pool and transport outlive the actor's last slice.
  BlockActor(BlockId self, WorkerPool* pool, PeerTransport* transport, Options options);
  ~BlockActor() override;

  // Runs a short task between slices' steps.
  void Post(Task task, Needs needs = Needs::kSound);
  // Runs a long task a step (about a millisecond) at a time until it returns true; others go on in between.
  void PostSliced(Step step);

  // Starts the algorithm, in steps like any other work, then calls done. From this call on, batches of this
  // phase are taken. A phase that was still running is thrown away.
  void Start(PhaseSetup setup, std::unique_ptr<BlockAlgorithm> algorithm,
             absl::AnyInvocable<void(absl::Status)> done);
  // Own work may begin.
  void Run(const PhaseId& id);
  void Cancel(const PhaseId& id);
  // At quiescence: ends the phase, in steps.
  void Finish(const PhaseId& id, absl::AnyInvocable<void(absl::Status, BlockSnapshot, Report)> done);
  // Throws away the phase that runs, if one does.
  void Abandon(absl::AnyInvocable<void()> done);
  // Answers everything that waits, and everything that will be asked, with `why`.
  void Close(const absl::Status& why);

  // Takes a batch, or drops it when it is not of the running phase.
  void Deliver(Envelope envelope, Taken taken);

  BlockSnapshot snapshot() const;
  BlockId id() const { return self_; }

  bool RunSlice() override;
  void Dropped() override;

 private:
  struct Mail {
    Envelope envelope;
    Taken taken;
    // Messages applied so far; the first look decides whether it is a duplicate.
    size_t applied = 0;
    bool accepted = false;
  };
  struct Waiting {
    Task task;
    Needs needs = Needs::kSound;
  };
  enum class Stage { kNone, kStarting, kStarted, kFinishing };

  // False: the pool has stopped.
  bool ScheduleLocked() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  bool RunTasks();
  bool RunSlicedStep();
  bool RunStep();
  bool StartStep();
  bool FinishStep();
  bool ReceiveStep();
  bool WorkStep();
  void Flush(bool all);
  void SendOut(Envelope envelope);
  void OnTaken(const PhaseId& id, BlockId to, uint64_t bytes);
  bool Throttled() const;
  // Runs a part of the algorithm that may change the block.
  template <class F>
  auto Change(F f) -> decltype(f());
  void AdaptBudget(absl::Duration took, bool used_up);
  void Fail(absl::Status status);
  void Finished(absl::Status status);
  void CancelRun(const PhaseId& id);
  // Ends the phase for the outside: no mail is accepted any more.
  void CloseMailbox();
  void EndPhase(const absl::Status& why);
  bool EndSlice(double busy_seconds);
  bool Runs(const PhaseId& id) const { return run_ && run_->setup().id == id; }
  bool MayWork() const { return stage_ == Stage::kStarted && go_ && !failed_ && run_->algorithm().HasWork(); }

  const BlockId self_;
  WorkerPool* const pool_;
  PeerTransport* const transport_;
  const Options options_;

  // Used by the running slice only; when the pool has stopped, by Dropped().
  std::unique_ptr<PhaseRun> run_;
  Stage stage_ = Stage::kNone;
  absl::AnyInvocable<void(absl::Status)> started_;
  absl::AnyInvocable<void(absl::Status, BlockSnapshot, Report)> finished_;
  bool go_ = false;
  bool failed_ = false;
  bool has_current_ = false;
  Mail current_;
  size_t budget_ = 0;
  // Not OK: an algorithm was thrown out of in the middle of a change.
  absl::Status broken_;

  mutable Mutex mutex_;
  bool scheduled_ ABSL_GUARDED_BY(mutex_) = false;
  absl::Status closed_ ABSL_GUARDED_BY(mutex_);
  // Lists: elements move from one to another without asking for memory.
  std::list<Waiting> tasks_ ABSL_GUARDED_BY(mutex_);
  std::list<Step> sliced_ ABSL_GUARDED_BY(mutex_);
  std::deque<Mail> mailbox_ ABSL_GUARDED_BY(mutex_);
  // A batch could not be kept.
  bool lost_mail_ ABSL_GUARDED_BY(mutex_) = false;
  bool open_ ABSL_GUARDED_BY(mutex_) = false;
  PhaseId phase_ ABSL_GUARDED_BY(mutex_);
  // By destination.
  std::vector<uint64_t> outstanding_ ABSL_GUARDED_BY(mutex_);
  size_t over_limit_ ABSL_GUARDED_BY(mutex_) = 0;
  bool wake_when_taken_ ABSL_GUARDED_BY(mutex_) = false;
  BlockSnapshot snapshot_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace ndmap::server

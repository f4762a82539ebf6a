// SPDX-License-Identifier: GPL-3.0-or-later
// What is asked of an actor. What it then does, in slices: actor_slice.cc.
#include "server/actor.h"

#include <new>
#include <utility>

#include "absl/strings/str_cat.h"
#include "service/guarded.h"

namespace ndmap::server {
namespace {

absl::Status Stopping() { return absl::UnavailableError("the server is stopping"); }

}  // namespace

BlockActor::BlockActor(BlockId self, WorkerPool* pool, PeerTransport* transport, Options options)
    : self_(self), pool_(pool), transport_(transport), options_(std::move(options)) {}

BlockActor::~BlockActor() {
  for (Mail& mail : mailbox_) mail.taken();
  if (has_current_) current_.taken();
}

bool BlockActor::ScheduleLocked() {
  if (scheduled_) return true;
  scheduled_ = pool_->Enqueue(shared_from_this());
  return scheduled_;
}

void BlockActor::Post(Task task, Needs needs) {
  std::list<Waiting> waiting;
  waiting.push_back({std::move(task), needs});
  absl::Status refused;
  {
    MutexLock lock(&mutex_);
    if (closed_.ok() && !ScheduleLocked()) closed_ = Stopping();
    if (closed_.ok()) return tasks_.splice(tasks_.end(), waiting);
    refused = closed_;
  }
  waiting.front().task(refused);
}

void BlockActor::PostSliced(Step step) {
  std::list<Step> waiting;
  waiting.push_back(std::move(step));
  absl::Status refused;
  {
    MutexLock lock(&mutex_);
    if (closed_.ok() && !ScheduleLocked()) closed_ = Stopping();
    if (closed_.ok()) return sliced_.splice(sliced_.end(), waiting);
    refused = closed_;
  }
  waiting.front()(refused);
}

void BlockActor::Start(PhaseSetup setup, std::unique_ptr<BlockAlgorithm> algorithm,
                       absl::AnyInvocable<void(absl::Status)> done) {
  CloseMailbox();
  {
    MutexLock lock(&mutex_);
    open_ = true;
    lost_mail_ = false;
    phase_ = setup.id;
    outstanding_.assign(setup.peers.size(), 0);
    over_limit_ = 0;
    snapshot_ = BlockSnapshot();
  }
  Post(
      [this, setup = std::move(setup), algorithm = std::move(algorithm),
       done = std::move(done)](const absl::Status& turn) mutable {
        if (!turn.ok()) return done(turn);
        EndPhase(absl::AbortedError(absl::StrCat("block ", self_.value, ": another phase began")));
        if (!broken_.ok()) return done(broken_);
        const absl::Status status = service::Guarded([&]() -> absl::Status {
          run_ = std::make_unique<PhaseRun>(self_, std::move(setup), std::move(algorithm));
          return absl::OkStatus();
        });
        if (!status.ok()) return done(status);
        {
          MutexLock lock(&mutex_);
          snapshot_ = BlockSnapshot();
        }
        stage_ = Stage::kStarting;
        budget_ = 0;
        started_ = std::move(done);
      },
      Needs::kAny);
}

void BlockActor::Run(const PhaseId& id) {
  Post(
      [this, id](const absl::Status& turn) {
        if (turn.ok() && Runs(id)) go_ = true;
      },
      Needs::kAny);
}

void BlockActor::Cancel(const PhaseId& id) {
  Post(
      [this, id](const absl::Status& turn) {
        if (turn.ok()) CancelRun(id);
      },
      Needs::kAny);
}

void BlockActor::Finish(const PhaseId& id,
                        absl::AnyInvocable<void(absl::Status, BlockSnapshot, Report)> done) {
  Post(
      [this, id, done = std::move(done)](const absl::Status& turn) mutable {
        if (!turn.ok()) return done(turn, {}, {});
        if (!Runs(id) || stage_ != Stage::kStarted) {
          return done(
              absl::FailedPreconditionError(absl::StrCat("block ", self_.value, " does not run that phase")),
              {}, {});
        }
        CloseMailbox();
        finished_ = std::move(done);
        stage_ = Stage::kFinishing;
        budget_ = 0;
      },
      Needs::kAny);
}

void BlockActor::Abandon(absl::AnyInvocable<void()> done) {
  Post(
      [this, done = std::move(done)](const absl::Status& turn) mutable {
        if (turn.ok()) {
          CloseMailbox();
          EndPhase(absl::AbortedError(absl::StrCat("block ", self_.value, ": the phase was given up")));
        }
        done();
      },
      Needs::kAny);
}

void BlockActor::CloseMailbox() {
  std::deque<Mail> dropped;
  {
    MutexLock lock(&mutex_);
    open_ = false;
    dropped.swap(mailbox_);
    wake_when_taken_ = false;
  }
  for (Mail& mail : dropped) mail.taken();
}

void BlockActor::EndPhase(const absl::Status& why) {
  if (std::exchange(has_current_, false)) std::exchange(current_, Mail()).taken();
  run_.reset();
  stage_ = Stage::kNone;
  go_ = failed_ = false;
  if (started_) std::exchange(started_, nullptr)(why);
  if (finished_) std::exchange(finished_, nullptr)(why, {}, {});
}

void BlockActor::Close(const absl::Status& why) {
  std::list<Waiting> tasks;
  std::list<Step> sliced;
  {
    MutexLock lock(&mutex_);
    if (closed_.ok()) closed_ = why;
    tasks.swap(tasks_);
    sliced.swap(sliced_);
    // A phase is ended by the actor's own next slice.
    if (open_) ScheduleLocked();
  }
  CloseMailbox();
  for (Waiting& waiting : tasks) waiting.task(why);
  for (Step& step : sliced) step(why);
}

void BlockActor::Dropped() {
  Close(Stopping());
  EndPhase(Stopping());
}

void BlockActor::Deliver(Envelope envelope, Taken taken) {
  {
    MutexLock lock(&mutex_);
    if (open_ && envelope.phase == phase_) {
      Mail mail{std::move(envelope), std::move(taken)};
      snapshot_.idle = false;
      ScheduleLocked();
      try {
        mailbox_.push_back(std::move(mail));
        return;
      } catch (const std::bad_alloc&) {
        lost_mail_ = true;
        taken = std::move(mail.taken);
      }
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

}  // namespace ndmap::server

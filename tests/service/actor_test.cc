// SPDX-License-Identifier: GPL-3.0-or-later
// Actors over a fake transport: this program also runs under the thread sanitizer.
#include "server/actor.h"

#include <gtest/gtest.h>

#include <memory>
#include <random>
#include <thread>
#include <vector>

#include "tests/service/token_algorithm.h"

namespace ndmap::server {
namespace {

class Event {
 public:
  void Set() {
    MutexLock lock(&mutex_);
    set_ = true;
    changed_.SignalAll();
  }
  void Wait() {
    MutexLock lock(&mutex_);
    while (!set_) changed_.Wait(&mutex_);
  }

 private:
  Mutex mutex_;
  CondVar changed_;
  bool set_ = false;
};

// Delivers in random order on a thread of its own, some batches twice.
class FakeTransport : public PeerTransport {
 public:
  explicit FakeTransport(uint32_t seed) : random_(seed), thread_([this] { Deliver(); }) {}
  ~FakeTransport() override { Stop(); }

  void Send(Envelope envelope, Taken taken) override {
    MutexLock lock(&mutex_);
    if (random_() % 4 == 0) waiting_.push_back({envelope, [] {}});
    waiting_.push_back({std::move(envelope), std::move(taken)});
    changed_.Signal();
  }
  void SetActors(std::vector<std::shared_ptr<BlockActor>> actors) { actors_ = std::move(actors); }
  // While held, nothing is delivered.
  void Hold(bool held) {
    MutexLock lock(&mutex_);
    held_ = held;
    changed_.Signal();
  }
  void Stop() {
    {
      MutexLock lock(&mutex_);
      stopping_ = true;
      changed_.Signal();
    }
    if (thread_.joinable()) thread_.join();
  }

 private:
  struct Item {
    Envelope envelope;
    Taken taken;
  };
  void Deliver() {
    while (true) {
      Item item;
      {
        MutexLock lock(&mutex_);
        while ((waiting_.empty() || held_) && !stopping_) changed_.Wait(&mutex_);
        if (stopping_) return;
        std::swap(waiting_[random_() % waiting_.size()], waiting_.back());
        item = std::move(waiting_.back());
        waiting_.pop_back();
      }
      const uint32_t to = item.envelope.destination.value;
      actors_[to]->Deliver(std::move(item.envelope), std::move(item.taken));
    }
  }

  Mutex mutex_;
  CondVar changed_;
  std::vector<Item> waiting_;
  bool held_ = false;
  bool stopping_ = false;
  std::mt19937 random_;
  std::vector<std::shared_ptr<BlockActor>> actors_;
  std::thread thread_;
};

class ActorTest : public ::testing::Test {
 protected:
  void Make(uint32_t blocks, BlockActor::Options options = {}) {
    for (uint32_t b = 0; b < blocks; ++b) {
      actors_.push_back(std::make_shared<BlockActor>(BlockId{b}, &pool_, &transport_, options));
    }
    transport_.SetActors(actors_);
  }
  PhaseSetup Setup() const { return {"m", kPhase, std::vector<Peer>(actors_.size(), Peer{7, true})}; }
  absl::Status Start(const Parameters& parameters) {
    absl::Status result;
    for (auto& actor : actors_) {
      Event started;
      const Environment environment{actor->id(), static_cast<uint32_t>(actors_.size()), Routing::kDirect,
                                    nullptr, nullptr};
      actor->Start(Setup(), std::make_unique<TokenAlgorithm>(environment, parameters),
                   [&](absl::Status status) {
                     result.Update(status);
                     started.Set();
                   });
      started.Wait();
    }
    for (auto& actor : actors_) actor->Run(kPhase);
    return result;
  }
  absl::Status StartOne(const Parameters& parameters) {
    absl::Status result;
    Event started;
    const Environment environment{BlockId{0}, 1, Routing::kDirect, nullptr, nullptr};
    actors_[0]->Start(Setup(), std::make_unique<TokenAlgorithm>(environment, parameters),
                      [&](absl::Status status) {
                        result = status;
                        started.Set();
                      });
    started.Wait();
    return result;
  }
  // What a query of block 0 is told.
  absl::Status AskFor(BlockActor::Needs needs) {
    absl::Status result;
    Event answered;
    actors_[0]->Post(
        [&](const absl::Status& turn) {
          result = turn;
          answered.Set();
        },
        needs);
    answered.Wait();
    return result;
  }
  // Mattern's four counters.
  void AwaitQuiescence() {
    uint64_t before = ~uint64_t{0};
    while (true) {
      bool idle = true;
      uint64_t sent = 0, received = 0;
      for (auto& actor : actors_) {
        const BlockSnapshot s = actor->snapshot();
        idle = idle && s.idle;
        sent += s.counters.messages_sent;
        received += s.counters.messages_received;
      }
      if (idle && sent == received && sent == before) return;
      before = idle && sent == received ? sent : ~uint64_t{0};
      std::this_thread::yield();
    }
  }
  std::pair<absl::Status, Report> Finish(BlockActor& actor) {
    std::pair<absl::Status, Report> result;
    Event finished;
    actor.Finish(kPhase, [&](absl::Status status, BlockSnapshot, Report report) {
      result = {status, report};
      finished.Set();
    });
    finished.Wait();
    return result;
  }
  void TearDown() override {
    transport_.Stop();
    pool_.Stop();
  }

  const PhaseId kPhase{3, 1, 2};
  WorkerPool pool_{3};
  FakeTransport transport_{17};
  std::vector<std::shared_ptr<BlockActor>> actors_;
};

TEST_F(ActorTest, EveryMessageIsAppliedOnceInSpiteOfDuplicatesAndReordering) {
  Make(5);
  ASSERT_TRUE(Start(Parameters().Set("tokens", int64_t{200}).Set("hops", int64_t{30})).ok());
  AwaitQuiescence();
  int64_t received = 0;
  for (auto& actor : actors_) {
    auto [status, report] = Finish(*actor);
    EXPECT_TRUE(status.ok()) << status;
    received += report.counts["received"];
  }
  EXPECT_EQ(received, 5 * 200 * 30);
}

TEST_F(ActorTest, QueriesAndCancelComeBetweenTheStepsOfEndlessWork) {
  Make(2);
  ASSERT_TRUE(Start(Parameters().Set("endless", int64_t{1})).ok());
  for (int i = 0; i < 20; ++i) {
    Event answered;
    actors_[0]->Post([&](const absl::Status&) { answered.Set(); });
    answered.Wait();
  }
  int steps = 0;
  Event done;
  actors_[0]->PostSliced([&](const absl::Status&) {
    if (++steps < 50) return false;
    done.Set();
    return true;
  });
  done.Wait();
  EXPECT_FALSE(actors_[0]->snapshot().idle);
  for (auto& actor : actors_) actor->Cancel(kPhase);
  AwaitQuiescence();
  EXPECT_TRUE(Finish(*actors_[0]).first.ok());
}

TEST_F(ActorTest, OwnWorkRestsWhileADestinationDoesNotTakeWhatItWasSent) {
  BlockActor::Options options;
  options.outstanding_limit = 4 << 20;
  Make(2, options);
  transport_.Hold(true);
  // About 17 bytes a message: 34 MB in all.
  const int64_t tokens = 1 << 20;
  ASSERT_TRUE(Start(Parameters().Set("tokens", tokens)).ok());
  // Each turn of the queue gives work a chance; it stands still once two batches more than the limit are out.
  uint64_t before = 0;
  for (int same = 0; same < 100;) {
    Event turn;
    actors_[0]->Post([&](const absl::Status&) { turn.Set(); });
    turn.Wait();
    const uint64_t steps = actors_[0]->snapshot().counters.steps;
    same = steps > 0 && steps == before ? same + 1 : 0;
    before = steps;
  }
  EXPECT_LT(before, uint64_t{tokens});
  EXPECT_LT(actors_[0]->snapshot().outstanding_bytes, uint64_t{6 << 20});
  transport_.Hold(false);
  AwaitQuiescence();
  EXPECT_EQ(Finish(*actors_[1]).second.counts["received"], tokens);
}

TEST_F(ActorTest, AnErrorAndAnExceptionStopTheBlockAndAreReported) {
  Make(2);
  auto abandon = [&] {
    for (auto& actor : actors_) {
      Event abandoned;
      actor->Abandon([&] { abandoned.Set(); });
      abandoned.Wait();
    }
  };
  ASSERT_TRUE(Start(Parameters().Set("tokens", int64_t{5}).Set("fail_block", int64_t{1})).ok());
  absl::Status status;
  while (status.ok()) status = actors_[1]->snapshot().status;
  EXPECT_EQ(status, absl::InternalError("label 12:1 is not known"));
  abandon();
  ASSERT_TRUE(Start(Parameters().Set("tokens", int64_t{5}).Set("throw_block", int64_t{0})).ok());
  for (status = absl::OkStatus(); status.ok();) status = actors_[0]->snapshot().status;
  EXPECT_EQ(status, absl::InternalError("exception: precondition violated"));
  abandon();
  EXPECT_EQ(Finish(*actors_[0]).first.code(), absl::StatusCode::kFailedPrecondition);
}

TEST_F(ActorTest, BatchesOfOtherPhasesAndIncarnationsAreDroppedButCountAsTaken) {
  Make(2);
  ASSERT_TRUE(Start(Parameters()).ok());
  auto deliver = [&](PhaseId phase, uint64_t incarnation, uint64_t sequence) {
    Envelope envelope{"m", phase, BlockId{1}, BlockId{0}, incarnation, sequence, {}};
    envelope.messages.Add({1, {4, 1}, {}});
    Event taken;
    actors_[0]->Deliver(std::move(envelope), [&] { taken.Set(); });
    taken.Wait();
  };
  deliver({3, 1, 1}, 7, 1);
  deliver({3, 0, 2}, 7, 1);
  deliver({2, 1, 2}, 7, 1);
  deliver(kPhase, 6, 1);
  EXPECT_EQ(actors_[0]->snapshot().counters.messages_received, 0u);
  deliver(kPhase, 7, 1);
  deliver(kPhase, 7, 1);
  EXPECT_EQ(Finish(*actors_[0]).second.counts["received"], 1);
}

TEST_F(ActorTest, QueriesAndCancelComeBetweenTheStepsOfStart) {
  Make(1);
  const Environment environment{BlockId{0}, 1, Routing::kDirect, nullptr, nullptr};
  Event started;
  absl::Status status = absl::UnknownError("");
  actors_[0]->Start(
      Setup(),
      std::make_unique<TokenAlgorithm>(
          environment, Parameters().Set("endless_start", int64_t{1}).Set("endless", int64_t{1})),
      [&](absl::Status s) {
        status = s;
        started.Set();
      });
  for (int i = 0; i < 20; ++i) {
    Event answered;
    actors_[0]->Post([&](const absl::Status&) { answered.Set(); });
    answered.Wait();
  }
  actors_[0]->Cancel(kPhase);
  started.Wait();
  EXPECT_TRUE(status.ok()) << status;
  actors_[0]->Run(kPhase);
  AwaitQuiescence();
  EXPECT_EQ(Finish(*actors_[0]).second.counts["worked"], 0);
}

struct NoMemory {
  std::string where;
  bool read_only = false;
  bool broken = false;
};
class NoMemoryTest : public ActorTest, public ::testing::WithParamInterface<NoMemory> {};

// Wherever memory runs out, the process lives and the job has the reason; a block that may be half changed is
// not read again.
TEST_P(NoMemoryTest, ABlockThatAnAlgorithmLeftHalfChangedSaysSo) {
  const auto& [where, read_only, broken] = GetParam();
  Make(2);
  Parameters parameters;
  parameters.Set("tokens", int64_t{5}).Set("no_memory", where);
  if (read_only) parameters.Set("read_only", int64_t{1});
  absl::Status status = Start(parameters);
  if (where == "finish") {
    AwaitQuiescence();
    status = Finish(*actors_[0]).first;
  }
  while (status.ok()) status = actors_[0]->snapshot().status;
  EXPECT_EQ(status, absl::ResourceExhaustedError("out of memory"));
  for (auto& actor : actors_) {
    Event abandoned;
    actor->Abandon([&] { abandoned.Set(); });
    abandoned.Wait();
  }
  const absl::Status expected =
      broken ? absl::DataLossError(
                   "block 0 of map \"m\" was left half changed by: out of memory; delete the map")
             : absl::OkStatus();
  EXPECT_EQ(AskFor(BlockActor::Needs::kSound), expected);
  EXPECT_TRUE(AskFor(BlockActor::Needs::kAny).ok());
  Event stepped;
  actors_[0]->PostSliced([&](const absl::Status& turn) {
    EXPECT_EQ(turn, expected);
    stepped.Set();
    return true;
  });
  stepped.Wait();
  EXPECT_EQ(StartOne(Parameters()), expected);
}

INSTANTIATE_TEST_SUITE_P(Places, NoMemoryTest,
                         ::testing::Values(NoMemory{"start"}, NoMemory{"receive", false, true},
                                           NoMemory{"receive", true}, NoMemory{"work", false, true},
                                           NoMemory{"work", true}, NoMemory{"finish", false, true},
                                           NoMemory{"report"}));

TEST_F(ActorTest, AClosedActorAnswersEverythingWithTheReason) {
  Make(1);
  Event started;
  absl::Status status;
  const Environment environment{BlockId{0}, 1, Routing::kDirect, nullptr, nullptr};
  actors_[0]->Start(
      Setup(), std::make_unique<TokenAlgorithm>(environment, Parameters().Set("endless_start", int64_t{1})),
      [&](absl::Status s) {
        status = s;
        started.Set();
      });
  Event running;
  actors_[0]->Post([&](const absl::Status&) { running.Set(); });
  running.Wait();
  const absl::Status why = absl::NotFoundError("map \"m\" was deleted");
  actors_[0]->Close(why);
  started.Wait();
  EXPECT_EQ(status, why);
  EXPECT_EQ(AskFor(BlockActor::Needs::kAny), why);
  EXPECT_EQ(StartOne(Parameters()), why);
  EXPECT_EQ(Finish(*actors_[0]).first, why);
}

TEST_F(ActorTest, AnActorOfAPoolThatHasStoppedAnswersWithAnError) {
  Make(2);
  Event started;
  absl::Status status;
  const Environment environment{BlockId{0}, 2, Routing::kDirect, nullptr, nullptr};
  actors_[0]->Start(
      Setup(), std::make_unique<TokenAlgorithm>(environment, Parameters().Set("endless_start", int64_t{1})),
      [&](absl::Status s) {
        status = s;
        started.Set();
      });
  Event step;
  actors_[0]->PostSliced([&](const absl::Status& turn) {
    if (!turn.ok()) step.Set();
    return !turn.ok();
  });
  pool_.Stop();
  started.Wait();
  step.Wait();
  EXPECT_EQ(status, absl::UnavailableError("the server is stopping"));
  EXPECT_EQ(AskFor(BlockActor::Needs::kAny).code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(Finish(*actors_[1]).first.code(), absl::StatusCode::kUnavailable);
}

TEST(SequenceFilterTest, SeesEachNumberOnceInAnyOrder) {
  SequenceFilter filter;
  EXPECT_TRUE(filter.FirstTime(2));
  EXPECT_FALSE(filter.FirstTime(2));
  EXPECT_TRUE(filter.FirstTime(1));
  EXPECT_FALSE(filter.FirstTime(1));
  EXPECT_FALSE(filter.FirstTime(2));
  EXPECT_TRUE(filter.FirstTime(3));
}

}  // namespace
}  // namespace ndmap::server

// SPDX-License-Identifier: GPL-3.0-or-later
// Jobs on real services: phases, quiescence, cancelling, refusals, failures.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <random>
#include <thread>

#include "coordinator/quiescence.h"
#include "tests/service/cluster.h"

namespace ndmap {
namespace {

using ::testing::HasSubstr;

// Sends some batches twice; drops all of them when asked to.
class FaultyTransport : public server::PeerTransport {
 public:
  FaultyTransport(server::PeerTransport* next, bool lose) : next_(next), lose_(lose) {}
  void Send(server::Envelope envelope, server::Taken taken) override {
    if (lose_) {
      taken();
      return;
    }
    if (count_.fetch_add(1) % 3 == 0) next_->Send(envelope, [] {});
    next_->Send(std::move(envelope), std::move(taken));
  }

 private:
  server::PeerTransport* const next_;
  const bool lose_;
  std::atomic<uint64_t> count_ = 0;
};

server::HostOptions Faulty(bool lose) {
  server::HostOptions host;
  host.wrap_transport = [lose](server::PeerTransport* next) {
    return std::make_unique<FaultyTransport>(next, lose);
  };
  return host;
}

TEST(QuiescenceTest, TwoEqualWavesInARowEndAPhaseAndNothingLess) {
  coordinator::Quiescence q;
  EXPECT_FALSE(q.Add({true, 5, 5}));
  EXPECT_FALSE(q.Add({true, 6, 6}));
  EXPECT_FALSE(q.Add({false, 6, 6}));
  EXPECT_FALSE(q.Add({true, 6, 6}));
  EXPECT_FALSE(q.Add({true, 6, 5}));
  EXPECT_FALSE(q.Add({true, 6, 6}));
  EXPECT_TRUE(q.Add({true, 6, 6}));
}

TEST(JobTest, RunsPhasesOnEveryBlockAndAddsUpTheirReports) {
  Cluster cluster(3);
  ASSERT_EQ(cluster.Create(Cluster::GridRequest("m", 7)).state(), v1::JOB_STATE_DONE);
  const v1::Job job = cluster.Run("m", {{"token", {{"tokens", "100"}, {"hops", "20"}}}, {"peek", {}}});
  ASSERT_EQ(job.state(), v1::JOB_STATE_DONE) << job.error();
  ASSERT_EQ(job.results_size(), 2);
  const v1::PhaseResult& result = job.results(0);
  EXPECT_EQ(result.report().counts().at("received"), 7 * 100 * 20);
  EXPECT_EQ(result.messages(), 7u * 100 * 20);
  EXPECT_GT(result.message_bytes(), 17u * result.messages());
  ASSERT_EQ(result.blocks_size(), 7);
  int64_t received = 0;
  for (int b = 0; b < 7; ++b) {
    EXPECT_EQ(result.blocks(b).progress().block(), static_cast<uint32_t>(b));
    received += result.blocks(b).report().counts().at("received");
    EXPECT_GT(result.blocks(b).progress().remote_messages_sent(), 0u);
    EXPECT_LT(result.blocks(b).progress().remote_messages_sent(),
              result.blocks(b).progress().messages_sent());
  }
  EXPECT_EQ(received, 7 * 100 * 20);
  EXPECT_GT(result.wall_seconds(), 0);
  EXPECT_EQ(job.results(1).messages(), 0u);
}

TEST(JobTest, EveryMessageCountsOnceInSpiteOfDuplicatesAndBrokenStreams) {
  Cluster cluster(3, {}, Faulty(false));
  ASSERT_EQ(cluster.Create(Cluster::GridRequest("m", 6)).state(), v1::JOB_STATE_DONE);
  uint64_t number = 0;
  ASSERT_TRUE(cluster.Start("m", {{"token", {{"tokens", "2000"}, {"hops", "100"}}}}, &number).ok());
  std::atomic<bool> over = false;
  std::atomic<int> breaks = 0;
  std::thread breaker([&] {
    for (size_t i = 0; !over; ++i) {
      // Each time after some more progress.
      cluster.Watch(number, [&, seen = 0](const v1::JobProgress&) mutable { return ++seen == 3; });
      cluster.server(i % cluster.size()).host().streams().BreakAll();
      ++breaks;
    }
  });
  const v1::Job job = cluster.Await(number);
  over = true;
  breaker.join();
  ASSERT_EQ(job.state(), v1::JOB_STATE_DONE) << job.error();
  EXPECT_EQ(job.results(0).report().counts().at("received"), 6 * 2000 * 100);
  EXPECT_GE(breaks, 1);
}

TEST(JobTest, ACancelledJobStopsWhileQueriesAreAnsweredAndTheMapGoesOn) {
  Cluster cluster(2);
  ASSERT_EQ(cluster.Create(Cluster::GridRequest("m", 4)).state(), v1::JOB_STATE_DONE);
  uint64_t number = 0;
  ASSERT_TRUE(cluster.Start("m", {{"token", {{"endless", "1"}}}, {"token", {}}}, &number).ok());
  cluster.AwaitWork(number);
  auto stub = cluster.ServerOf("m", 0);
  for (int i = 0; i < 10; ++i) {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(5));
    v1::GetBlockStatsRequest request;
    request.set_map("m");
    v1::GetBlockStatsResponse response;
    ASSERT_TRUE(stub->GetBlockStats(&context, request, &response).ok());
    ASSERT_EQ(response.blocks_size(), 2);
    EXPECT_EQ(response.blocks(0).hexahedra(), 2u);
  }
  cluster.Cancel(number);
  const v1::Job job = cluster.Await(number);
  EXPECT_EQ(job.state(), v1::JOB_STATE_CANCELLED);
  // The phase that ran has a report, the next never began.
  ASSERT_EQ(job.results_size(), 1);
  EXPECT_TRUE(job.results(0).cancelled());
  EXPECT_EQ(cluster.Run("m", {{"token", {}}}).state(), v1::JOB_STATE_DONE);
}

TEST(JobTest, ASecondJobIsRefusedNamingTheFirst) {
  Cluster cluster(1);
  ASSERT_EQ(cluster.Create(Cluster::GridRequest("m", 2)).state(), v1::JOB_STATE_DONE);
  uint64_t reader = 0, other = 0;
  ASSERT_TRUE(cluster.Start("m", {{"peek", {{"endless", "1"}}}}, &reader).ok());
  // Also one that only reads: a block runs one algorithm at a time.
  for (const char* second : {"token", "peek"}) {
    const grpc::Status status = cluster.Start("m", {{second, {}}}, &other);
    EXPECT_EQ(status.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
    EXPECT_THAT(status.error_message(),
                HasSubstr(absl::StrCat("job ", reader, " (peek) is running on map \"m\"")));
  }
  grpc::ClientContext context;
  v1::DeleteMapRequest request;
  request.set_map("m");
  v1::DeleteMapResponse response;
  EXPECT_EQ(cluster.stub().DeleteMap(&context, request, &response).error_code(),
            grpc::StatusCode::FAILED_PRECONDITION);
  cluster.Cancel(reader);
  cluster.Await(reader);
  EXPECT_TRUE(cluster.Start("m", {{"token", {}}}, &other).ok());
  EXPECT_EQ(cluster.Await(other).state(), v1::JOB_STATE_DONE);
}

TEST(JobTest, AnAlgorithmsErrorFailsTheJobWithBlockAndReasonAndTheMapOnlyAnswers) {
  Cluster cluster(2);
  ASSERT_EQ(cluster.Create(Cluster::GridRequest("m", 4)).state(), v1::JOB_STATE_DONE);
  v1::Job job = cluster.Run("m", {{"token", {{"tokens", "10"}, {"hops", "9"}, {"fail_block", "2"}}}});
  EXPECT_EQ(job.state(), v1::JOB_STATE_FAILED);
  EXPECT_EQ(job.error(), "phase 0 (token): block 2: label 12:1 is not known");
  uint64_t other = 0;
  const grpc::Status status = cluster.Start("m", {{"token", {}}}, &other);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_THAT(status.error_message(), HasSubstr("label 12:1 is not known"));
  job = cluster.Run("m", {{"peek", {{"tokens", "10"}, {"hops", "9"}}}});
  EXPECT_EQ(job.state(), v1::JOB_STATE_DONE) << job.error();
  EXPECT_EQ(job.results(0).report().counts().at("received"), 4 * 90);
  // What is wrong with a reading job leaves the map as it is.
  job = cluster.Run("m", {{"peek", {{"kept_block", "3"}}}});
  EXPECT_EQ(job.error(), "phase 0 (peek): block 3: still kept: label 7:1");
}

TEST(JobTest, LostMessagesAreNamedAsAHang) {
  coordinator::CoordinatorOptions options;
  options.runner.stall_timeout = absl::Milliseconds(300);
  Cluster cluster(2, std::move(options), Faulty(true));
  ASSERT_EQ(cluster.Create(Cluster::GridRequest("m", 2)).state(), v1::JOB_STATE_DONE);
  const v1::Job job = cluster.Run("m", {{"token", {{"tokens", "10"}}}});
  EXPECT_EQ(job.state(), v1::JOB_STATE_FAILED);
  EXPECT_THAT(job.error(), HasSubstr("no progress for 300ms: 20 messages sent, 0 received"));
}

TEST(JobTest, AServerThatDiesFailsTheJobAndIsNamed) {
  Cluster cluster(2);
  ASSERT_EQ(cluster.Create(Cluster::GridRequest("m", 2)).state(), v1::JOB_STATE_DONE);
  uint64_t number = 0;
  ASSERT_TRUE(cluster.Start("m", {{"token", {{"endless", "1"}}}}, &number).ok());
  cluster.AwaitWork(number);
  const std::string address = cluster.server(1).address();
  cluster.server(1).Stop();
  const v1::Job job = cluster.Await(number);
  EXPECT_EQ(job.state(), v1::JOB_STATE_FAILED);
  EXPECT_THAT(job.error(), HasSubstr(address));
}

TEST(JobTest, AWrongParameterOrAlgorithmIsOneSentence) {
  Cluster cluster(1);
  ASSERT_EQ(cluster.Create(Cluster::GridRequest("m", 1)).state(), v1::JOB_STATE_DONE);
  uint64_t number = 0;
  grpc::Status status = cluster.Start("m", {{"frobnicate", {}}}, &number);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_THAT(status.error_message(), HasSubstr("frobnicate"));
  status = cluster.Start("m", {}, &number);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  // The build algorithm's own parameters, wrong.
  const v1::Job job = cluster.Run("m", {{"build", {{"cells", "many"}}}});
  EXPECT_EQ(job.state(), v1::JOB_STATE_FAILED);
  EXPECT_THAT(job.error(), HasSubstr("many"));
}

}  // namespace
}  // namespace ndmap

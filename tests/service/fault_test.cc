// SPDX-License-Identifier: GPL-3.0-or-later
// Maps that are deleted, cancelled or run out of memory while others use them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <random>
#include <thread>

#include "server/block_host.h"
#include "tests/service/cluster.h"

namespace ndmap {
namespace {

using ::testing::HasSubstr;

v1::PhaseKey Key(uint64_t job) {
  v1::PhaseKey key;
  key.set_map("m");
  key.set_job(job);
  key.set_attempt(1);
  return key;
}

class HostTest : public ::testing::Test {
 protected:
  HostTest() {
    server::HostOptions options;
    options.threads = 3;
    options.factory = MakeTestAlgorithm;
    host_ = std::make_unique<server::BlockHost>(std::move(options));
    host_->SetAddress("here:1");
  }

  absl::Status Create() {
    v1::CreateBlocksRequest request;
    request.set_map("m");
    request.set_block_count(3);
    for (uint32_t b = 0; b < 3; ++b) request.add_blocks(b);
    return host_->CreateBlocks(request);
  }
  absl::Status StartPhase(uint64_t job, const std::string& algorithm, const Cluster::Values& values) {
    v1::StartPhaseRequest request;
    *request.mutable_key() = Key(job);
    request.mutable_phase()->set_algorithm(algorithm);
    request.mutable_phase()->mutable_parameters()->insert(values.begin(), values.end());
    for (uint32_t b = 0; b < 3; ++b) {
      v1::BlockPlacement& placement = *request.add_placement();
      placement.set_block(b);
      placement.set_address("here:1");
      placement.set_incarnation(1);
    }
    return host_->StartPhase(request);
  }
  absl::Status CountDarts() {
    return host_->Query("m", 1, [](Block3& block) {
      return block.map().number_of_darts() < 1000 ? absl::OkStatus() : absl::InternalError("too many");
    });
  }

  std::unique_ptr<server::BlockHost> host_;
};

// Phases, queries, deletion and creation of one map at the same time: every call comes back.
TEST_F(HostTest, AMapMayBeDeletedAndMadeAgainUnderEverybodysHands) {
  ASSERT_TRUE(Create().ok());
  std::atomic<uint64_t> job = 1;
  const auto hammer = [&](uint32_t seed) {
    std::mt19937 random(seed);
    for (int i = 0; i < 500; ++i) {
      switch (random() % 8) {
        case 0:
          host_->DropMap("m").IgnoreError();
          break;
        case 1:
          EXPECT_TRUE(Create().ok());
          break;
        case 2:
        case 3: {
          const uint64_t mine = job++;
          if (!StartPhase(mine, "token", {{"tokens", "300"}, {"hops", "20"}}).ok()) break;
          host_->RunPhase(Key(mine)).IgnoreError();
          break;
        }
        case 4: {
          v1::PollPhaseRequest request;
          *request.mutable_key() = Key(job - 1);
          request.set_wait_milliseconds(2);
          v1::PollPhaseResponse response;
          host_->PollPhase(request, response).IgnoreError();
          break;
        }
        case 5: {
          v1::FinishPhaseResponse response;
          host_->FinishPhase(Key(job - 1), response).IgnoreError();
          break;
        }
        default:
          CountDarts().IgnoreError();
      }
    }
  };
  std::vector<std::thread> threads;
  for (uint32_t t = 0; t < 4; ++t) threads.emplace_back(hammer, t + 1);
  for (std::thread& thread : threads) thread.join();
  ASSERT_TRUE(Create().ok());
  EXPECT_TRUE(CountDarts().ok());
  EXPECT_TRUE(StartPhase(job, "token", {}).ok());
}

TEST_F(HostTest, AQueryOfAHostThatHasStoppedIsAnError) {
  ASSERT_TRUE(Create().ok());
  host_->Stop();
  EXPECT_EQ(CountDarts().code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(StartPhase(1, "token", {}).code(), absl::StatusCode::kUnavailable);
  EXPECT_TRUE(host_->DropMap("m").ok());
}

TEST_F(HostTest, ACancelDuringStartReachesTheBlocks) {
  ASSERT_TRUE(Create().ok());
  std::thread starter([this] {
    EXPECT_TRUE(StartPhase(1, "token", {{"endless_start", "1"}, {"endless", "1"}}).ok());
  });
  while (!host_->CancelPhase(Key(1), false).ok()) std::this_thread::yield();
  starter.join();
  EXPECT_TRUE(CountDarts().ok());
}

TEST(FaultTest, ACancelDuringStartEndsTheJob) {
  Cluster cluster(2);
  ASSERT_EQ(cluster.Create(Cluster::GridRequest("m", 4)).state(), v1::JOB_STATE_DONE);
  uint64_t number = 0;
  ASSERT_TRUE(cluster.Start("m", {{"token", {{"endless_start", "1"}, {"endless", "1"}}}}, &number).ok());
  cluster.Cancel(number);
  EXPECT_EQ(cluster.Await(number).state(), v1::JOB_STATE_CANCELLED);
}

TEST(FaultTest, ACancelledCreateLeavesNoMapToUse) {
  Cluster cluster(2);
  v1::CreateMapRequest request = Cluster::GridRequest("m", 2, 100);
  grpc::ClientContext context;
  v1::CreateMapResponse response;
  ASSERT_TRUE(cluster.stub().CreateMap(&context, request, &response).ok());
  cluster.AwaitWork(response.job().job());
  cluster.Cancel(response.job().job());
  const v1::Job job = cluster.Await(response.job().job());
  ASSERT_EQ(job.state(), v1::JOB_STATE_CANCELLED);
  uint64_t number = 0;
  const grpc::Status refused = cluster.Start("m", {{"refine", {{"depth", "1"}}}}, &number);
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_THAT(refused.error_message(), HasSubstr("was cancelled"));
  // Half a grid stays nowhere.
  for (uint32_t block : {0u, 1u}) {
    grpc::ClientContext asking;
    v1::GetBlockStatsRequest stats;
    stats.set_map("m");
    stats.add_blocks(block);
    v1::GetBlockStatsResponse found;
    ASSERT_TRUE(cluster.ServerOf("m", block)->GetBlockStats(&asking, stats, &found).ok());
    EXPECT_EQ(found.blocks(0).darts(), 0u);
  }
}

TEST(FaultTest, AMapThatRanOutOfMemoryInTheMiddleCountsAndDiesButIsNotRead) {
  Cluster cluster(1);
  ASSERT_EQ(cluster.Create(Cluster::GridRequest("m", 2)).state(), v1::JOB_STATE_DONE);
  const v1::Job failed = cluster.Run("m", {{"token", {{"tokens", "3"}, {"no_memory", "work"}}}});
  EXPECT_EQ(failed.state(), v1::JOB_STATE_FAILED);
  EXPECT_THAT(failed.error(), HasSubstr("out of memory"));
  const v1::Job read = cluster.Run("m", {{"hash", {}}});
  EXPECT_EQ(read.state(), v1::JOB_STATE_FAILED);
  EXPECT_THAT(read.error(),
              HasSubstr("of map \"m\" was left half changed by: out of memory; delete the map"));
  auto stub = cluster.ServerOf("m", 0);
  {
    grpc::ClientContext context;
    v1::GetBlockStatsRequest request;
    request.set_map("m");
    v1::GetBlockStatsResponse response;
    EXPECT_TRUE(stub->GetBlockStats(&context, request, &response).ok());
    EXPECT_EQ(response.blocks_size(), 2);
  }
  {
    grpc::ClientContext context;
    v1::BetaRequest request;
    request.set_map("m");
    request.add_starts()->set_any_dart(true);
    v1::BetaResponse response;
    EXPECT_EQ(stub->Beta(&context, request, &response).error_code(), grpc::StatusCode::DATA_LOSS);
  }
  grpc::ClientContext context;
  v1::DeleteMapRequest request;
  request.set_map("m");
  v1::DeleteMapResponse response;
  EXPECT_TRUE(cluster.stub().DeleteMap(&context, request, &response).ok());
  EXPECT_EQ(cluster.Create(Cluster::GridRequest("m", 2)).state(), v1::JOB_STATE_DONE);
}

}  // namespace
}  // namespace ndmap

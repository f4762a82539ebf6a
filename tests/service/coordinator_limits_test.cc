// SPDX-License-Identifier: GPL-3.0-or-later
// Calls of the coordinator that last are bounded in number, because each of them keeps a thread.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <thread>
#include <vector>

#include "absl/synchronization/notification.h"
#include "client/sdk/client.h"
#include "client/sdk/job.h"
#include "tests/service/cluster.h"

namespace ndmap {
namespace {

using ::testing::HasSubstr;

coordinator::CoordinatorOptions Limits(uint32_t watches, uint32_t uploads) {
  coordinator::CoordinatorOptions options;
  options.limits.max_watches = watches;
  options.limits.max_uploads = uploads;
  return options;
}

TEST(CoordinatorLimitsTest, WatchersAboveTheMostAreRefusedAndWhoWaitsForAJobStillLearnsItsEnd) {
  Cluster cluster(1, Limits(1, 1));
  // No watch is left over from this one: its stream has ended.
  ASSERT_EQ(cluster.Create(Cluster::GridRequest("m", 1)).state(), v1::JOB_STATE_DONE);
  uint64_t job = 0;
  ASSERT_TRUE(cluster.Start("m", {{"peek", {{"endless", "1"}}}}, &job).ok());
  v1::WatchJobRequest request;
  request.set_job(job);
  v1::WatchJobResponse response;
  grpc::ClientContext first;
  auto watch = cluster.stub().WatchJob(&first, request);
  ASSERT_TRUE(watch->Read(&response));

  grpc::ClientContext second;
  auto refused = cluster.stub().WatchJob(&second, request);
  EXPECT_FALSE(refused->Read(&response));
  const grpc::Status status = refused->Finish();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_THAT(status.error_message(), HasSubstr("1 clients are watching jobs"));
  EXPECT_THAT(status.error_message(), HasSubstr("--max-watches"));

  const Client client = Client::Connect(cluster.coordinator().address()).value();
  absl::StatusOr<v1::Job> waited = absl::UnknownError("not waited for");
  std::thread waiter([&] { waited = client.Job(job).Wait(); });
  cluster.Cancel(job);
  while (watch->Read(&response)) {
  }
  waiter.join();
  ASSERT_TRUE(waited.ok()) << waited.status();
  EXPECT_EQ(waited->state(), v1::JOB_STATE_CANCELLED);
  EXPECT_TRUE(watch->Finish().ok());
  // The place is free again.
  grpc::ClientContext third;
  auto again = cluster.stub().WatchJob(&third, request);
  EXPECT_TRUE(again->Read(&response));
  EXPECT_TRUE(again->Finish().ok());
}

TEST(CoordinatorLimitsTest, WhoWaitsWhileNobodyMayWatchLearnsTheEndByAsking) {
  Cluster cluster(1, Limits(1, 1));
  ASSERT_EQ(cluster.Create(Cluster::GridRequest("m", 1)).state(), v1::JOB_STATE_DONE);
  ASSERT_EQ(cluster.Create(Cluster::GridRequest("n", 1)).state(), v1::JOB_STATE_DONE);
  uint64_t endless = 0, short_one = 0;
  ASSERT_TRUE(cluster.Start("m", {{"peek", {{"endless", "1"}}}}, &endless).ok());
  v1::WatchJobRequest request;
  request.set_job(endless);
  v1::WatchJobResponse response;
  grpc::ClientContext context;
  auto watch = cluster.stub().WatchJob(&context, request);
  ASSERT_TRUE(watch->Read(&response));
  ASSERT_TRUE(cluster.Start("n", {{"peek", {{"tokens", "10"}, {"hops", "9"}}}}, &short_one).ok());
  const Client client = Client::Connect(cluster.coordinator().address()).value();
  const absl::StatusOr<v1::Job> done = client.Job(short_one).Wait();
  ASSERT_TRUE(done.ok()) << done.status();
  EXPECT_EQ(done->state(), v1::JOB_STATE_DONE);
  context.TryCancel();
  while (watch->Read(&response)) {
  }
  watch->Finish();
  cluster.Cancel(endless);
  // Its place may not be free yet: this one, too, learns the end by asking then.
  const absl::StatusOr<v1::Job> ended = client.Job(endless).Wait();
  ASSERT_TRUE(ended.ok()) << ended.status();
  EXPECT_EQ(ended->state(), v1::JOB_STATE_CANCELLED);
}

TEST(CoordinatorLimitsTest, UploadsAboveTheMostAreRefused) {
  Cluster cluster(0, Limits(1, 1));
  // Two that do not end: one of them has the place.
  std::vector<grpc::ClientContext> contexts(2);
  std::vector<grpc::Status> ends(2);
  absl::Notification one_over;
  absl::Mutex mutex;
  int ended = 0;
  std::vector<std::thread> uploads;
  for (size_t k = 0; k < 2; ++k) {
    uploads.emplace_back([&, k] {
      v1::UploadSurfaceResponse response;
      auto writer = cluster.stub().UploadSurface(&contexts[k], &response);
      ends[k] = writer->Finish();
      absl::MutexLock lock(&mutex);
      if (++ended == 1) one_over.Notify();
    });
  }
  EXPECT_TRUE(one_over.WaitForNotificationWithTimeout(absl::Seconds(60)));
  for (grpc::ClientContext& context : contexts) context.TryCancel();
  for (std::thread& thread : uploads) thread.join();
  int refused = 0;
  for (const grpc::Status& status : ends) {
    if (status.error_code() != grpc::StatusCode::RESOURCE_EXHAUSTED) continue;
    ++refused;
    EXPECT_THAT(status.error_message(), HasSubstr("receiving 1 surfaces"));
    EXPECT_THAT(status.error_message(), HasSubstr("--max-uploads"));
  }
  EXPECT_EQ(refused, 1);
}

TEST(CoordinatorLimitsTest, JobsOfAMapThatNeverWasAreAnError) {
  Cluster cluster(1);
  ASSERT_EQ(cluster.Create(Cluster::GridRequest("m", 1)).state(), v1::JOB_STATE_DONE);
  const Client client = Client::Connect(cluster.coordinator().address()).value();
  EXPECT_EQ(client.ListJobs("m")->size(), 1u);
  const absl::Status status = client.ListJobs("nosuch").status();
  EXPECT_EQ(status.code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(std::string(status.message()), HasSubstr("there is no map \"nosuch\""));
  // One that was deleted is remembered by its jobs.
  ASSERT_TRUE(client.DeleteMap("m").ok());
  EXPECT_EQ(client.ListJobs("m")->size(), 1u);
}

// With a result for each of a thousand blocks.
void RunLongJob(coordinator::State& state) {
  v1::StartJobRequest request;
  request.set_map("m");
  request.set_kind("count");
  request.add_phases()->set_algorithm("count");
  const absl::StatusOr<v1::Job> job = state.AddJob(request, false);
  ASSERT_TRUE(job.ok()) << job.status();
  v1::PhaseResult result;
  for (int b = 0; b < 1000; ++b) {
    for (const char* name : {"darts", "hexahedra", "vertices"})
      (*result.add_blocks()->mutable_report()->mutable_counts())[name] = b;
  }
  state.AddResult(job->job(), 0, std::move(result));
  state.EndJob(job->job(), absl::OkStatus(), false);
}

TEST(CoordinatorLimitsTest, JobsThatHaveEndedAreForgottenWhenTheirResultsAreLong) {
  v1::Map map;
  map.set_map("m");
  for (uint64_t most : {uint64_t{4} << 20, uint64_t{1} << 40}) {
    coordinator::StateOptions options;
    options.max_job_bytes = most;
    coordinator::State state(options);
    state.EndJob(state.AddMap(map, {}).value().job(), absl::OkStatus(), false);
    for (int i = 0; i < 100; ++i) RunLongJob(state);
    uint64_t bytes = 0;
    const std::vector<v1::Job> jobs = state.Jobs("m");
    for (const v1::Job& job : jobs) {
      EXPECT_EQ(job.results_size(), 0);
      bytes += state.FindJob(job.job())->SpaceUsedLong();
    }
    // The last are there in any case, and with them their results.
    EXPECT_EQ(jobs.back().job(), 101u);
    EXPECT_EQ(state.FindJob(101)->results(0).blocks_size(), 3000);
    if (most > bytes) {
      EXPECT_EQ(jobs.size(), 101u);
    } else {
      EXPECT_EQ(jobs.size(), 16u);
      EXPECT_FALSE(state.FindJob(1).ok());
    }
  }
}

}  // namespace
}  // namespace ndmap

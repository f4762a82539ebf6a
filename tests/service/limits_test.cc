// SPDX-License-Identifier: GPL-3.0-or-later
// What questions of clients may cost a server, through real services: each limit is named when it is met, and
// stops neither jobs nor what servers ask each other.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <thread>

#include "absl/synchronization/mutex.h"
#include "absl/synchronization/notification.h"
#include "tests/service/cluster.h"

namespace ndmap {
namespace {

using grpc::StatusCode;
using ::testing::HasSubstr;

// Exports that wait to be let go on, and say when they have come.
class Turnstile {
 public:
  server::PieceSource Source() {
    return [this](const Parameters&,
                  const server::PieceOrigin&) -> absl::StatusOr<std::unique_ptr<server::PieceBuilder>> {
      return std::make_unique<Piece>(this);
    };
  }
  void AwaitArrivals(int n) {
    const auto enough = [this, n]() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) { return arrived_ >= n; };
    absl::MutexLock lock(&mutex_, absl::Condition(&enough));
  }
  void Open() { open_.Notify(); }

 private:
  class Piece : public server::PieceBuilder {
   public:
    explicit Piece(Turnstile* turnstile) : turnstile_(turnstile) {}
    absl::StatusOr<bool> Step(Block3&, const AttributeStore&) override { return true; }
    absl::Status Write(const server::PieceSink& sink) override {
      {
        absl::MutexLock lock(&turnstile_->mutex_);
        ++turnstile_->arrived_;
      }
      turnstile_->open_.WaitForNotification();
      sink("piece");
      return absl::OkStatus();
    }
    absl::btree_map<std::string, int64_t> counts() const override { return {}; }

   private:
    Turnstile* const turnstile_;
  };

  absl::Mutex mutex_;
  int arrived_ ABSL_GUARDED_BY(mutex_) = 0;
  absl::Notification open_;
};

class LimitsTest : public ::testing::Test {
 protected:
  void Start(const server::QueryLimits& limits, server::PieceSource source = server::MakeVtuPiece,
             uint32_t cells = 2) {
    server::ServiceOptions service;
    service.query_limits = limits;
    service.piece_source = std::move(source);
    cluster_ =
        std::make_unique<Cluster>(2, coordinator::CoordinatorOptions(), server::HostOptions(), service);
    ASSERT_EQ(cluster_->Create(Cluster::GridRequest("m", 2, cells)).state(), v1::JOB_STATE_DONE);
    stub_ = cluster_->ServerOf("m", 0);
  }

  static std::unique_ptr<grpc::ClientContext> Context() {
    auto context = std::make_unique<grpc::ClientContext>();
    context->set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(60));
    return context;
  }

  // All darts of the map.
  static v1::ExploreRequest AllDarts() {
    v1::ExploreRequest request;
    request.set_map("m");
    request.set_give(v1::GIVE_DARTS);
    for (uint32_t b = 0; b < 2; ++b) request.add_anchors()->set_block(b);
    return request;
  }
  grpc::Status Explore() {
    const auto context = Context();
    auto reader = stub_->Explore(context.get(), AllDarts());
    v1::ExploreResponse part;
    while (reader->Read(&part)) {
    }
    return reader->Finish();
  }
  // Once around the face of any dart of block 0.
  grpc::Status Beta(bool stay = false) {
    v1::BetaRequest request;
    request.set_map("m");
    request.add_starts()->set_any_dart(true);
    request.set_word(std::string(4, 1));
    request.set_stay(stay);
    v1::BetaResponse response;
    return stub_->Beta(Context().get(), request, &response);
  }
  grpc::Status Walk() {
    v1::WalkRequest request;
    request.set_map("m");
    request.set_blocks(std::string(4, '\0'));
    request.set_darts(std::string("\1\0\0\0", 4));
    request.set_word(std::string(4, 1));
    v1::WalkResponse response;
    return stub_->Walk(Context().get(), request, &response);
  }
  grpc::Status FetchCells() {
    v1::FetchCellsRequest request;
    request.set_map("m");
    request.mutable_dart()->set_dart(1);
    const auto context = Context();
    auto stream = stub_->FetchCells(context.get(), request);
    v1::FetchCellsResponse part;
    while (stream->Read(&part)) {
    }
    return stream->Finish();
  }
  grpc::Status BlockStats() {
    v1::GetBlockStatsRequest request;
    request.set_map("m");
    v1::GetBlockStatsResponse response;
    return stub_->GetBlockStats(Context().get(), request, &response);
  }
  grpc::Status Export() {
    const auto context = Context();
    v1::ExportPieceRequest request;
    request.set_map("m");
    auto reader = stub_->ExportPiece(context.get(), request);
    v1::ExportPieceResponse part;
    while (reader->Read(&part)) {
    }
    return reader->Finish();
  }
  // A question of another server.
  grpc::Status AskBlock() {
    v1::AskBlockRequest request;
    request.set_map("m");
    request.mutable_find()->add_anchors()->set_block(0);
    v1::AskBlockResponse response;
    return stub_->AskBlock(Context().get(), request, &response);
  }

  static void ExpectRefused(const grpc::Status& status, const std::string& flag) {
    EXPECT_EQ(status.error_code(), StatusCode::RESOURCE_EXHAUSTED) << status.error_message();
    EXPECT_THAT(status.error_message(), HasSubstr(flag));
  }
  static void ExpectOk(const grpc::Status& status) { EXPECT_TRUE(status.ok()) << status.error_message(); }

  std::unique_ptr<Cluster> cluster_;
  std::unique_ptr<v1::BlockService::Stub> stub_;
};

TEST_F(LimitsTest, QuestionsAboveTheMostAtOneTimeAreRefusedAndNothingElseIs) {
  Turnstile turnstile;
  server::QueryLimits limits;
  limits.max_queries = 2;
  Start(limits, turnstile.Source());
  std::vector<std::thread> exports;
  for (int k = 0; k < 2; ++k) exports.emplace_back([this] { ExpectOk(Export()); });
  turnstile.AwaitArrivals(2);
  for (const grpc::Status& status : {Explore(), Beta(), Walk(), FetchCells(), BlockStats(), Export()}) {
    ExpectRefused(status, "--max-queries");
    EXPECT_THAT(status.error_message(), HasSubstr("answering 2 questions"));
  }
  // Servers among themselves, the coordinator's jobs, and who only asks who is there.
  ExpectOk(AskBlock());
  ExpectOk(Beta(/*stay=*/true));
  v1::GetVersionResponse version;
  ExpectOk(stub_->GetVersion(Context().get(), {}, &version));
  EXPECT_EQ(
      cluster_->Run("m", {{"refine", {{"oracle", "everything"}, {"depth", "1"}}}, {"check", {}}}).state(),
      v1::JOB_STATE_DONE);
  turnstile.Open();
  for (std::thread& thread : exports) thread.join();
  for (const grpc::Status& status : {Explore(), Beta(), Walk(), FetchCells(), BlockStats(), Export()})
    ExpectOk(status);
}

TEST_F(LimitsTest, AnAnswerOfTooManyBytesIsRefused) {
  server::QueryLimits limits;
  limits.max_response_bytes = 20;
  Start(limits);
  for (const grpc::Status& status : {Explore(), Beta(), Walk(), FetchCells()}) {
    ExpectRefused(status, "--max-response-bytes");
    EXPECT_THAT(status.error_message(), HasSubstr("over 20 bytes"));
  }
  // A file is not an answer.
  ExpectOk(Export());
}

TEST_F(LimitsTest, ALongAnswerEndsWhenItHasBecomeTooLarge) {
  server::QueryLimits limits;
  limits.max_response_bytes = 110000;
  Start(limits, server::MakeVtuPiece, 12);
  const auto context = Context();
  auto reader = stub_->Explore(context.get(), AllDarts());
  v1::ExploreResponse part;
  uint64_t bytes = 0;
  while (reader->Read(&part)) bytes += part.ByteSizeLong();
  ExpectRefused(reader->Finish(), "--max-response-bytes");
  EXPECT_GT(bytes, 0u);
  EXPECT_LE(bytes, limits.max_response_bytes);
}

TEST_F(LimitsTest, AQuestionThatTakesTooLongIsRefused) {
  server::QueryLimits limits;
  limits.max_query_time = absl::Nanoseconds(1);
  Start(limits);
  for (const grpc::Status& status : {Explore(), Beta(), Walk(), FetchCells(), BlockStats()}) {
    ExpectRefused(status, "--max-query-seconds");
    EXPECT_THAT(status.error_message(), HasSubstr("longer than 1ns"));
  }
  ExpectOk(Export());
  ExpectOk(AskBlock());
  ExpectOk(Beta(/*stay=*/true));
}

TEST_F(LimitsTest, AnExportHasALimitOfItsOwn) {
  server::QueryLimits limits;
  limits.max_export_time = absl::Nanoseconds(1);
  Start(limits);
  ExpectRefused(Export(), "--max-export-seconds");
  ExpectOk(Explore());
}

// A piece without an end.
class Endless : public server::PieceBuilder {
 public:
  absl::StatusOr<bool> Step(Block3&, const AttributeStore&) override { return true; }
  absl::Status Write(const server::PieceSink& sink) override {
    const std::string bytes(1 << 20, 'x');
    while (sink(bytes)) {
    }
    return absl::OkStatus();
  }
  absl::btree_map<std::string, int64_t> counts() const override { return {}; }
};

TEST_F(LimitsTest, WhoDoesNotReadDoesNotKeepItsPlace) {
  server::QueryLimits limits;
  limits.max_queries = 1;
  limits.max_export_time = absl::Milliseconds(200);
  Start(limits,
        [](const Parameters&, const server::PieceOrigin&)
            -> absl::StatusOr<std::unique_ptr<server::PieceBuilder>> { return std::make_unique<Endless>(); });
  const auto context = Context();
  v1::ExportPieceRequest request;
  request.set_map("m");
  auto reader = stub_->ExportPiece(context.get(), request);
  reader->WaitForInitialMetadata();
  grpc::Status status = Beta();
  ExpectRefused(status, "--max-queries");
  const absl::Time patience = absl::Now() + absl::Seconds(60);
  while (!status.ok() && absl::Now() < patience) status = Beta();
  ExpectOk(status);
  // What was on its way is still read before the end is heard of.
  v1::ExportPieceResponse part;
  while (reader->Read(&part)) EXPECT_FALSE(part.has_summary());
  EXPECT_EQ(reader->Finish().error_code(), StatusCode::CANCELLED);
}

}  // namespace
}  // namespace ndmap

// SPDX-License-Identifier: Apache-2.0
// The SDK against services that say what a test wants them to say.
#include "client/sdk/client.h"

#include <gmock/gmock.h>
#include <grpcpp/server.h>
#include <grpcpp/server_builder.h>
#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "client/sdk/channel.h"
#include "client/sdk/connection.h"
#include "ndmap/v1/block_service.grpc.pb.h"
#include "ndmap/v1/coordinator.grpc.pb.h"

namespace ndmap {
namespace {

using ::testing::HasSubstr;

class FakeCoordinator final : public v1::Coordinator::Service {
 public:
  grpc::Status GetVersion(grpc::ServerContext*, const v1::GetVersionRequest*,
                          v1::GetVersionResponse* response) override {
    *response->mutable_version() = internal::SdkVersion();
    if (protocol > 0) response->mutable_version()->set_protocol(protocol);
    return grpc::Status::OK;
  }
  grpc::Status ListMaps(grpc::ServerContext*, const v1::ListMapsRequest*,
                        v1::ListMapsResponse* response) override {
    if (++list_calls <= failures) return {grpc::StatusCode::UNAVAILABLE, "a server is gone"};
    response->add_maps()->set_map("bunny");
    return grpc::Status::OK;
  }
  grpc::Status DeleteMap(grpc::ServerContext*, const v1::DeleteMapRequest*, v1::DeleteMapResponse*) override {
    ++delete_calls;
    return {grpc::StatusCode::UNAVAILABLE, "a server is gone"};
  }
  grpc::Status GetMap(grpc::ServerContext*, const v1::GetMapRequest* request,
                      v1::GetMapResponse* response) override {
    if (request->map() != map.map())
      return {grpc::StatusCode::NOT_FOUND, absl::StrCat("no map '", request->map(), "'")};
    *response->mutable_map() = map;
    return grpc::Status::OK;
  }
  grpc::Status UploadSurface(grpc::ServerContext*, grpc::ServerReader<v1::SurfaceChunk>* reader,
                             v1::UploadSurfaceResponse* response) override {
    v1::SurfaceChunk chunk;
    received.clear();
    while (reader->Read(&chunk)) {
      if (chunk.has_header()) header = chunk.header();
      received += chunk.data();
      chunk_sizes.push_back(chunk.data().size());
    }
    response->set_surface_id(header.surface_id());
    return grpc::Status::OK;
  }
  grpc::Status WatchJob(grpc::ServerContext*, const v1::WatchJobRequest* request,
                        grpc::ServerWriter<v1::WatchJobResponse>* writer) override {
    v1::WatchJobResponse response;
    response.mutable_progress()->set_job(request->job());
    response.mutable_progress()->set_state(v1::JOB_STATE_RUNNING);
    writer->Write(response);
    // The first watch breaks off.
    if (++watch_calls == 1) return {grpc::StatusCode::UNAVAILABLE, "restarted"};
    response.mutable_progress()->set_state(final_state);
    writer->Write(response);
    return grpc::Status::OK;
  }
  grpc::Status GetJob(grpc::ServerContext*, const v1::GetJobRequest* request,
                      v1::GetJobResponse* response) override {
    response->mutable_job()->set_job(request->job());
    response->mutable_job()->set_kind("refine");
    response->mutable_job()->set_state(final_state);
    response->mutable_job()->set_error("it broke");
    return grpc::Status::OK;
  }

  uint32_t protocol = 0;
  int failures = 0;
  v1::JobState final_state = v1::JOB_STATE_DONE;
  v1::Map map;
  std::atomic<int> list_calls{0}, delete_calls{0}, watch_calls{0};
  v1::SurfaceHeader header;
  std::string received;
  std::vector<size_t> chunk_sizes;
};

// Blocks whose darts lie on one line: beta 1 leads from dart d to d + 1, beta 3 of dart 9 to dart 0 of the
// next block.
class FakeBlocks final : public v1::BlockService::Service {
 public:
  static constexpr uint32_t kDarts = 10;

  FakeBlocks(uint32_t block, uint32_t blocks, bool direct)
      : block_(block), blocks_(blocks), direct_(direct) {}

  grpc::Status GetVersion(grpc::ServerContext*, const v1::GetVersionRequest*,
                          v1::GetVersionResponse* response) override {
    *response->mutable_version() = internal::SdkVersion();
    return grpc::Status::OK;
  }
  grpc::Status Beta(grpc::ServerContext*, const v1::BetaRequest* request,
                    v1::BetaResponse* response) override {
    ++calls;
    EXPECT_EQ(request->block(), block_);
    EXPECT_TRUE(request->stay());
    for (const v1::BetaStart& start : request->starts())
      Walk(start, request->word(), response->add_results());
    return grpc::Status::OK;
  }
  grpc::Status ExportPiece(grpc::ServerContext*, const v1::ExportPieceRequest*,
                           grpc::ServerWriter<v1::ExportPieceResponse>* writer) override {
    v1::ExportPieceResponse response;
    response.set_data("<VTKFile/>");
    writer->Write(response);
    response.mutable_summary()->set_bytes(10);
    response.mutable_summary()->set_checksum(checksum);
    writer->Write(response);
    return grpc::Status::OK;
  }

  int calls = 0;
  uint64_t checksum = 0;

 private:
  void Walk(const v1::BetaStart& start, const std::string& word, v1::BetaResult* result) {
    uint32_t dart = start.dart().dart();
    if (start.has_label()) {
      // Block b's dart 0 has label b.
      if (start.label().root() != block_) {
        result->set_end(v1::WALK_END_NO_LABEL);
        return;
      }
      dart = 0;
    }
    result->set_end(v1::WALK_END_ARRIVED);
    for (char letter : word) {
      if (letter == 1 && dart + 1 < kDarts) {
        ++dart;
      } else if (letter == 3 && dart + 1 == kDarts && block_ + 1 < blocks_) {
        result->set_end(v1::WALK_END_CROSSING);
        result->mutable_label()->set_root(block_ + 1);
        result->set_has_peer(direct_);
        result->set_peer(block_ + 1);
        break;
      } else {
        result->set_end(v1::WALK_END_FREE);
        break;
      }
      result->set_used(result->used() + 1);
    }
    result->mutable_at()->mutable_dart()->set_block(block_);
    result->mutable_at()->mutable_dart()->set_dart(dart);
  }

  const uint32_t block_, blocks_;
  const bool direct_;
};

class ClientTest : public ::testing::Test {
 protected:
  std::string Serve(grpc::Service* service) {
    grpc::ServerBuilder builder;
    int port = 0;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
    builder.SetMaxReceiveMessageSize(internal::kMaxMessageBytes);
    builder.RegisterService(service);
    servers_.push_back(builder.BuildAndStart());
    return absl::StrCat("127.0.0.1:", port);
  }
  absl::StatusOr<Client> Connect() {
    ClientOptions options;
    options.first_pause = absl::Milliseconds(1);
    return Client::Connect(Serve(&coordinator_), options);
  }
  // A map of three blocks, each on its own server.
  void ServeBlocks(bool direct) {
    coordinator_.map.set_map("line");
    coordinator_.map.set_block_count(3);
    for (uint32_t block = 0; block < 3; ++block) {
      blocks_.push_back(std::make_unique<FakeBlocks>(block, 3, direct));
      v1::BlockPlacement* placement = coordinator_.map.add_blocks();
      placement->set_block(block);
      placement->set_address(Serve(blocks_.back().get()));
    }
  }

  FakeCoordinator coordinator_;
  std::vector<std::unique_ptr<FakeBlocks>> blocks_;
  std::vector<std::unique_ptr<grpc::Server>> servers_;
};

v1::DartRef Dart(uint32_t block, uint32_t dart) {
  v1::DartRef ref;
  ref.set_block(block);
  ref.set_dart(dart);
  return ref;
}

TEST_F(ClientTest, TargetsThatAreNone) {
  for (const char* target : {"", "host", "host:", ":70", "host:0", "host:70000", "host:x", "::1:70"}) {
    EXPECT_EQ(Client::Connect(target).status().code(), absl::StatusCode::kInvalidArgument) << target;
  }
  EXPECT_TRUE(internal::CheckTarget("[::1]:7000").ok());
}

TEST_F(ClientTest, NobodyThereIsOneSentenceAtOnce) {
  const absl::Time begin = absl::Now();
  const absl::Status status = Client::Connect("127.0.0.1:1").status();
  EXPECT_LT(absl::Now() - begin, absl::Seconds(5));
  EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(status.message(), "the coordinator at 127.0.0.1:1 cannot be reached: Connection refused");
}

TEST(FromGrpcTest, WhatTheOneWhoWasAskedSaysOfAnotherIsNotSaidOfIt) {
  const auto said = [](grpc::StatusCode code, const std::string& message) {
    return std::string(internal::FromGrpc(grpc::Status(code, message), "the block server at A:1").message());
  };
  const auto unavailable = grpc::StatusCode::UNAVAILABLE, late = grpc::StatusCode::DEADLINE_EXCEEDED;
  const std::string grpc_says =
      "failed to connect to all addresses; last error: UNKNOWN: ipv4:1.2.3.4:5: Failed to connect to remote "
      "host: "
      "Connection refused";
  EXPECT_EQ(said(unavailable, grpc_says), "the block server at A:1 cannot be reached: Connection refused");
  EXPECT_EQ(said(unavailable, "the block server at B:2 does not answer: " + grpc_says),
            "the block server at A:1: the block server at B:2 does not answer: " + grpc_says);
  EXPECT_EQ(said(unavailable, "DNS resolution failed for nowhere:1: no such name"),
            "the block server at A:1 cannot be reached: no such name");
  EXPECT_EQ(said(late, "Deadline Exceeded"), "the block server at A:1 did not answer in time");
  EXPECT_EQ(said(late, "the block server at B:2 does not answer: Deadline Exceeded"),
            "the block server at A:1: the block server at B:2 does not answer: Deadline Exceeded");
}

TEST_F(ClientTest, AnotherProtocolIsRefusedNamingBoth) {
  coordinator_.protocol = 77;
  const absl::Status status = Connect().status();
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(status.message(), HasSubstr("speaks protocol 77, this client 1"));
}

TEST_F(ClientTest, QuestionsAreAskedAgain) {
  coordinator_.failures = 2;
  const auto maps = Connect()->ListMaps();
  ASSERT_TRUE(maps.ok()) << maps.status();
  EXPECT_EQ(maps->front().map(), "bunny");
  EXPECT_EQ(coordinator_.list_calls, 3);
}

TEST_F(ClientTest, QuestionsAreNotAskedForEver) {
  coordinator_.failures = 1000;
  EXPECT_EQ(Connect()->ListMaps().status().code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(coordinator_.list_calls, 3);
}

TEST_F(ClientTest, WhatMayNotBeDoneTwiceIsDoneOnce) {
  EXPECT_EQ(Connect()->DeleteMap("bunny").code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(coordinator_.delete_calls, 1);
}

TEST_F(ClientTest, ErrorsKeepTheServicesSentence) {
  const absl::Status status = Connect()->OpenMap("cow").status();
  EXPECT_EQ(status.code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(status.message(), "no map 'cow'");
}

TEST_F(ClientTest, SurfacesGoUpInChunks) {
  const std::vector<std::array<double, 3>> points(100000, {1, 2, 3});
  const std::vector<std::array<uint32_t, 3>> triangles(5, {0, 1, 2});
  const SurfaceView view{"many.off", points, triangles};
  uint64_t last = 0;
  const auto id = Connect()->UploadSurface(view, [&](uint64_t sent, uint64_t) { last = sent; });
  ASSERT_TRUE(id.ok()) << id.status();
  EXPECT_EQ(*id, SurfaceId(view));
  EXPECT_EQ(id->size(), 32u);
  EXPECT_EQ(coordinator_.header.points(), 100000u);
  EXPECT_EQ(coordinator_.header.triangles(), 5u);
  EXPECT_EQ(coordinator_.received.size(), 100000u * 24 + 5 * 12);
  EXPECT_EQ(last, coordinator_.received.size());
  for (size_t size : coordinator_.chunk_sizes) EXPECT_LE(size, 1u << 20);
}

TEST_F(ClientTest, TheIdFollowsFromTheContentAlone) {
  std::vector<std::array<double, 3>> points(3, {1, 2, 3});
  const std::vector<std::array<uint32_t, 3>> triangles(1, {0, 1, 2});
  const std::string id = SurfaceId({"a", points, triangles});
  EXPECT_EQ(SurfaceId({"b", points, triangles}), id);
  points[2][1] = 2.5;
  EXPECT_NE(SurfaceId({"a", points, triangles}), id);
}

TEST_F(ClientTest, AWatchThatBreaksOffGoesOn) {
  int heard = 0;
  const auto job = Connect()->Job(7).Wait([&](const v1::JobProgress& progress) {
    EXPECT_EQ(progress.job(), 7u);
    ++heard;
  });
  ASSERT_TRUE(job.ok()) << job.status();
  EXPECT_EQ(job->state(), v1::JOB_STATE_DONE);
  EXPECT_EQ(coordinator_.watch_calls, 2);
  EXPECT_EQ(heard, 3);
  EXPECT_TRUE(StatusOf(*job).ok());
}

TEST_F(ClientTest, AJobThatFailedSaysSo) {
  coordinator_.final_state = v1::JOB_STATE_FAILED;
  const auto job = Connect()->Job(7).Wait();
  ASSERT_TRUE(job.ok()) << job.status();
  EXPECT_EQ(StatusOf(*job).message(), "job 7 (refine) failed: it broke");
}

TEST_F(ClientTest, WalksCrossServicesInBatches) {
  for (bool direct : {true, false}) {
    blocks_.clear();
    coordinator_.map.Clear();
    ServeBlocks(direct);
    const auto map = Connect()->OpenMap("line");
    ASSERT_TRUE(map.ok()) << map.status();
    // From darts 8 and 9 of block 0: the first needs one more step.
    const std::vector<uint8_t> word = {1, 3, 1, 1};
    const std::vector<v1::DartRef> starts = {Dart(0, 8), Dart(0, 0), Dart(1, 8)};
    const auto walked = map->Beta(starts, word);
    ASSERT_TRUE(walked.ok()) << walked.status();
    EXPECT_EQ((*walked)[0].at.dart().block(), 1u);
    EXPECT_EQ((*walked)[0].at.dart().dart(), 2u);
    EXPECT_EQ((*walked)[0].used, 4u);
    EXPECT_FALSE((*walked)[0].free);
    EXPECT_EQ((*walked)[0].block_crossings, 1u);
    EXPECT_EQ((*walked)[0].server_crossings, 1u);
    // Beta 3 of a dart in the middle is free.
    EXPECT_TRUE((*walked)[1].free);
    EXPECT_EQ((*walked)[1].used, 1u);
    EXPECT_EQ((*walked)[1].at.dart().dart(), 1u);
    EXPECT_EQ((*walked)[2].at.dart().block(), 2u);
    if (direct) {
      // Two starts of block 0 went in one call.
      EXPECT_EQ(blocks_[0]->calls, 1);
    }
  }
}

TEST_F(ClientTest, WrongWalksAreRefused) {
  ServeBlocks(true);
  const auto map = Connect()->OpenMap("line");
  const std::vector<v1::DartRef> start = {Dart(0, 0)};
  const std::vector<uint8_t> four = {4}, one = {1};
  EXPECT_EQ(map->Beta(start, four).status().code(), absl::StatusCode::kInvalidArgument);
  const std::vector<v1::DartRef> nowhere = {Dart(3, 0)};
  const absl::Status status = map->Beta(nowhere, one).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(status.message(), "map 'line' has no block 3, it has 3 blocks");
}

TEST_F(ClientTest, APieceThatDoesNotMatchItsChecksumIsRefused) {
  ServeBlocks(true);
  const auto map = Connect()->OpenMap("line");
  const std::string path = ::testing::TempDir() + "/ndmap_client_test_piece.vtu";
  const auto summary = map->ExportPieceToFile(0, {}, path);
  EXPECT_EQ(summary.status().code(), absl::StatusCode::kDataLoss);
  EXPECT_EQ(std::fopen(path.c_str(), "r"), nullptr);
  EXPECT_EQ(std::fopen((path + ".part").c_str(), "r"), nullptr);
}

}  // namespace
}  // namespace ndmap

// SPDX-License-Identifier: Apache-2.0
// Questions about cells: how they are made, which server gets them, and what is asked again.
#include "client/sdk/explore.h"

#include <gmock/gmock.h>
#include <grpcpp/server.h>
#include <grpcpp/server_builder.h>
#include <gtest/gtest.h>

#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/sdk/client.h"
#include "client/sdk/connection.h"
#include "ndmap/v1/block_service.grpc.pb.h"
#include "ndmap/v1/coordinator.grpc.pb.h"

namespace ndmap {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::vector<uint32_t> Closures(const v1::ExploreRequest& request) {
  return {request.close().begin(), request.close().end()};
}

TEST(ExploreQuestions, Anchors) {
  EXPECT_EQ(CellAnchor("h12/0.3").text(), "h12/0.3");
  v1::CellId id;
  id.set_hi(1);
  id.set_lo(2);
  EXPECT_EQ(CellAnchor(id).cell().lo(), 2u);
  const v1::DartRef dart = DartAnchor(3, 17, 5).dart();
  EXPECT_EQ(dart.block(), 3u);
  EXPECT_EQ(dart.dart(), 17u);
  EXPECT_EQ(dart.version(), 5u);
  EXPECT_EQ(DartAnchor(dart).dart().dart(), 17u);
  EXPECT_EQ(PointAnchor({1, 2, 3}).point().y(), 2);
  EXPECT_EQ(NearestVertexAnchor({1, 2, 3}).nearest_vertex().z(), 3);
  const v1::Box box = BoxAnchor({1, 2, 3}, {4, 5, 6}).box();
  EXPECT_EQ(box.lo().x(), 1);
  EXPECT_EQ(box.hi().z(), 6);
  EXPECT_EQ(BlockAnchor(0).at_case(), v1::Anchor::kBlock);
}

TEST(ExploreQuestions, NamedQuestions) {
  const v1::Anchor anchor = CellAnchor("h1");
  EXPECT_THAT(Closures(Orbit(anchor, 0)), ElementsAre(0));
  EXPECT_EQ(Orbit(anchor, 0).give(), v1::GIVE_DARTS);
  const v1::ExploreRequest vertices = IncidentCells(anchor, 3, 0);
  EXPECT_THAT(Closures(vertices), ElementsAre(3));
  EXPECT_EQ(vertices.dimension(), 0u);
  EXPECT_FALSE(vertices.without_anchors());
  const v1::ExploreRequest adjacent = AdjacentCells(anchor, 3, 2);
  EXPECT_THAT(Closures(adjacent), ElementsAre(3, 2));
  EXPECT_EQ(adjacent.dimension(), 3u);
  EXPECT_TRUE(adjacent.without_anchors());
  EXPECT_THAT(Closures(Ring(anchor, 3, 2, 0)), ElementsAre(3, 0, 3, 0));
  EXPECT_EQ(Closures(Ring(anchor, 3, kMaxRing, 0)).size(), 64u);
  // Refused by the service, not made by us.
  EXPECT_EQ(Closures(Ring(anchor, 3, 4000000000u, 0)).size(), 66u);
  EXPECT_TRUE(Closures(CellsAt(anchor, 3)).empty());
}

class FakeExploreCoordinator final : public v1::Coordinator::Service {
 public:
  grpc::Status GetVersion(grpc::ServerContext*, const v1::GetVersionRequest*,
                          v1::GetVersionResponse* response) override {
    *response->mutable_version() = internal::SdkVersion();
    return grpc::Status::OK;
  }
  grpc::Status GetMap(grpc::ServerContext*, const v1::GetMapRequest*, v1::GetMapResponse* response) override {
    *response->mutable_map() = map;
    return grpc::Status::OK;
  }
  v1::Map map;
};

// Says `parts` parts and then `end`, unavailable ones only the first `failures` times.
class FakeExploreBlocks final : public v1::BlockService::Service {
 public:
  grpc::Status GetVersion(grpc::ServerContext*, const v1::GetVersionRequest*,
                          v1::GetVersionResponse* response) override {
    *response->mutable_version() = internal::SdkVersion();
    return grpc::Status::OK;
  }
  grpc::Status Explore(grpc::ServerContext*, const v1::ExploreRequest* request,
                       grpc::ServerWriter<v1::ExploreResponse>* writer) override {
    const std::lock_guard<std::mutex> lock(mutex);
    ++calls;
    asked = *request;
    const bool fails = calls <= failures;
    for (int i = 0; i < (fails ? parts_before_failure : 3); ++i) {
      v1::ExploreResponse part;
      if (i == 0) part.add_versions(7);
      part.add_darts(static_cast<uint32_t>(i));
      writer->Write(part);
    }
    return fails ? end : grpc::Status::OK;
  }

  std::mutex mutex;
  int calls = 0, failures = 0, parts_before_failure = 0;
  grpc::Status end{grpc::StatusCode::UNAVAILABLE, "a server is gone"};
  v1::ExploreRequest asked;
};

class ExploreCallTest : public ::testing::Test {
 protected:
  ExploreCallTest() {
    coordinator_.map.set_map("m");
    coordinator_.map.set_block_count(3);
    for (uint32_t block = 0; block < 3; ++block) {
      v1::BlockPlacement* placement = coordinator_.map.add_blocks();
      placement->set_block(block);
      placement->set_address(Serve(&blocks_[block]));
    }
    ClientOptions options;
    options.first_pause = absl::Milliseconds(1);
    map_ = std::make_unique<MapHandle>(Client::Connect(Serve(&coordinator_), options)->OpenMap("m").value());
  }
  std::string Serve(grpc::Service* service) {
    grpc::ServerBuilder builder;
    int port = 0;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
    builder.RegisterService(service);
    servers_.push_back(builder.BuildAndStart());
    return absl::StrCat("127.0.0.1:", port);
  }
  int Calls() const { return blocks_[0].calls + blocks_[1].calls + blocks_[2].calls; }

  FakeExploreCoordinator coordinator_;
  FakeExploreBlocks blocks_[3];
  std::vector<std::unique_ptr<grpc::Server>> servers_;
  std::unique_ptr<MapHandle> map_;
};

TEST_F(ExploreCallTest, PartsAreConcatenatedAndTheMapIsNamed) {
  const auto answer = map_->Explore(Orbit(DartAnchor(1, 5), 2));
  ASSERT_TRUE(answer.ok()) << answer.status();
  EXPECT_THAT(answer->darts(), ElementsAre(0, 1, 2));
  EXPECT_THAT(answer->versions(), ElementsAre(7));
  EXPECT_EQ(blocks_[1].asked.map(), "m");
  EXPECT_THAT(Closures(blocks_[1].asked), ElementsAre(2));
}

TEST_F(ExploreCallTest, TheServerOfTheFirstDartOrBlockIsAsked) {
  v1::ExploreRequest request = CellsAt(CellAnchor("h1"), 3);
  *request.add_anchors() = DartAnchor(2, 0);
  *request.add_anchors() = DartAnchor(0, 0);
  EXPECT_TRUE(map_->Explore(request).ok());
  EXPECT_TRUE(map_->Explore(CellsAt(BlockAnchor(1), 3)).ok());
  EXPECT_EQ(blocks_[0].calls, 0);
  EXPECT_EQ(blocks_[1].calls, 1);
  EXPECT_EQ(blocks_[2].calls, 1);
  const absl::Status status = map_->Explore(Orbit(DartAnchor(3, 0), 0)).status();
  EXPECT_EQ(status.message(), "map 'm' has no block 3, it has 3 blocks");
}

TEST_F(ExploreCallTest, OtherQuestionsAreSpreadOverServers) {
  for (int i = 0; i < 6; ++i) EXPECT_TRUE(map_->Explore(CellsAt(CellAnchor("h1"), 3)).ok());
  for (const FakeExploreBlocks& blocks : blocks_) EXPECT_EQ(blocks.calls, 2);
}

TEST_F(ExploreCallTest, QuestionsAreAskedAgainWhenNobodyAnswers) {
  blocks_[1].failures = 2;
  // Half an answer of the try that failed is forgotten.
  blocks_[1].parts_before_failure = 2;
  const auto answer = map_->Explore(Orbit(DartAnchor(1, 5), 2));
  ASSERT_TRUE(answer.ok()) << answer.status();
  EXPECT_THAT(answer->darts(), ElementsAre(0, 1, 2));
  EXPECT_EQ(Calls(), 3);
}

TEST_F(ExploreCallTest, OtherErrorsAreNot) {
  blocks_[1].failures = 1;
  blocks_[1].end = {grpc::StatusCode::RESOURCE_EXHAUSTED, "more than 3 darts"};
  const absl::Status status = map_->Explore(Orbit(DartAnchor(1, 5), 2)).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(status.message(), "more than 3 darts");
  EXPECT_EQ(Calls(), 1);
}

TEST_F(ExploreCallTest, AStreamIsAskedAgainUntilAPartWasTaken) {
  std::vector<uint32_t> darts;
  const auto take = [&](const v1::ExploreResponse& part) {
    darts.insert(darts.end(), part.darts().begin(), part.darts().end());
    return absl::OkStatus();
  };
  blocks_[0].failures = 2;
  EXPECT_TRUE(map_->Explore(Orbit(DartAnchor(0, 5), 2), take).ok());
  EXPECT_THAT(darts, ElementsAre(0, 1, 2));
  EXPECT_EQ(blocks_[0].calls, 3);

  darts.clear();
  blocks_[1].failures = 1;
  blocks_[1].parts_before_failure = 1;
  const absl::Status status = map_->Explore(Orbit(DartAnchor(1, 5), 2), take);
  EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(status.message(), HasSubstr("a server is gone"));
  EXPECT_THAT(darts, ElementsAre(0));
  EXPECT_EQ(blocks_[1].calls, 1);
}

TEST_F(ExploreCallTest, TheTakersErrorEndsTheStream) {
  int taken = 0;
  const absl::Status status =
      map_->Explore(Orbit(DartAnchor(0, 5), 2), [&](const v1::ExploreResponse&) -> absl::Status {
        return ++taken == 2 ? absl::UnavailableError("the disk is full") : absl::OkStatus();
      });
  EXPECT_EQ(status.message(), "the disk is full");
  EXPECT_EQ(taken, 2);
  EXPECT_EQ(blocks_[0].calls, 1);
}

}  // namespace
}  // namespace ndmap

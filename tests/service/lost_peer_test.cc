// SPDX-License-Identifier: GPL-3.0-or-later
// Block servers that are not there any more: who is told of them, and in which words.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/sdk/client.h"
#include "client/sdk/explore.h"
#include "tests/service/cluster.h"

namespace ndmap {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

// The client asks the server that lives, which cannot reach the other one.
TEST(LostPeerTest, AClientLearnsWhichServerIsGoneNotWhichOneItAsked) {
  Cluster cluster(2);
  ASSERT_EQ(cluster.Create(Cluster::GridRequest("m", 2)).state(), v1::JOB_STATE_DONE);
  ClientOptions options;
  options.attempts = 1;
  const Client client = Client::Connect(cluster.coordinator().address(), options).value();
  const MapHandle map = client.OpenMap("m").value();
  const std::string lives = map.info().blocks(0).address(), gone = map.info().blocks(1).address();
  v1::ExploreRequest request;
  request.set_dimension(3);
  request.set_give(v1::GIVE_CELLS);
  *request.add_anchors() = DartAnchor(map.AnyDart(0)->dart());
  for (int i = 0; i < 8; ++i) *request.add_anchors() = CellAnchor(absl::StrCat("h", i));
  ASSERT_TRUE(map.Explore(request).ok());
  cluster.server(cluster.server(0).address() == gone ? 0 : 1).Stop();

  const absl::Status status = map.Explore(request).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable);
  const std::string message(status.message());
  EXPECT_THAT(message, HasSubstr(absl::StrCat("the block server at ", gone, " does not answer: ")));
  EXPECT_THAT(message, Not(HasSubstr(absl::StrCat(lives, " cannot be reached"))));
  // gRPC's way of saying it is not for people.
  EXPECT_THAT(message, Not(HasSubstr("last error")));

  // Nor does a walk that comes to the end of its server's blocks: one of each dart of its first hexahedron.
  v1::BetaRequest walk;
  walk.set_map("m");
  for (uint32_t dart = 1; dart <= 24; ++dart) walk.add_starts()->mutable_dart()->set_dart(dart);
  walk.set_word(std::string(1, 3));
  v1::BetaResponse ends;
  grpc::ClientContext context;
  const grpc::Status beta =
      v1::BlockService::NewStub(service::MakeChannel(lives))->Beta(&context, walk, &ends);
  EXPECT_EQ(beta.error_code(), grpc::StatusCode::UNAVAILABLE) << beta.error_message();
  EXPECT_THAT(beta.error_message(),
              HasSubstr(absl::StrCat("the block server at ", gone, " does not answer: ")));
}

}  // namespace
}  // namespace ndmap

// SPDX-License-Identifier: GPL-3.0-or-later
// Block servers come and go: whose an address is.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "tests/service/cluster.h"

namespace ndmap {
namespace {

using ::testing::HasSubstr;

coordinator::CoordinatorOptions Lease(absl::Duration lease) {
  coordinator::CoordinatorOptions options;
  options.state.lease = lease;
  return options;
}

// As a server of whom nothing is heard after it has registered.
grpc::Status Register(Cluster& cluster, absl::Duration patience, v1::RegisterServerResponse& response) {
  grpc::ClientContext context;
  context.set_deadline(absl::ToChronoTime(absl::Now() + patience));
  v1::RegisterServerRequest request;
  request.set_address("127.0.0.1:5");
  *request.mutable_version() = service::MakeVersion("ndmap-server");
  return cluster.stub().RegisterServer(&context, request, &response);
}

TEST(RegistrationTest, TheAddressOfAServerThatIsAliveIsRefusedAndItLosesNothing) {
  Cluster cluster(1, Lease(absl::Seconds(8)));
  ASSERT_EQ(cluster.Create(Cluster::GridRequest("m", 2)).state(), v1::JOB_STATE_DONE);
  server::BlockServerOptions second;
  second.coordinator = cluster.coordinator().address();
  second.advertise = cluster.server(0).address();
  second.host.factory = MakeTestAlgorithm;
  second.host.threads = 1;
  // It waits for half of this, less than it takes until the first is heard of, and asks again.
  second.coordinator_timeout = absl::Seconds(2);
  const auto refused = server::BlockServer::Start(std::move(second));
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kAlreadyExists) << refused.status();
  EXPECT_EQ(refused.status().message(),
            absl::StrCat(cluster.server(0).address(),
                         " is the address of server 1, which is alive: take another "
                         "--advertise or --listen, or stop that server first"));
  EXPECT_EQ(cluster.server(0).host().map_count(), 1u);
  EXPECT_EQ(cluster.Run("m", {{"count", {}}}).state(), v1::JOB_STATE_DONE);
  EXPECT_EQ(cluster.server(0).host().map_count(), 1u);
}

TEST(RegistrationTest, AServerThatWasKilledComesBackAtItsAddressWhenItsLeaseHasEnded) {
  Cluster cluster(0, Lease(absl::Milliseconds(700)));
  v1::RegisterServerResponse killed, back;
  ASSERT_TRUE(Register(cluster, absl::Seconds(60), killed).ok());
  const grpc::Status status = Register(cluster, absl::Seconds(60), back);
  ASSERT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(back.server_id(), killed.server_id());
  EXPECT_NE(back.incarnation(), killed.incarnation());
}

TEST(RegistrationTest, WhileNobodyKnowsWhetherItIsAliveOneMayAskAgain) {
  Cluster cluster(0, Lease(absl::Seconds(1000)));
  v1::RegisterServerResponse response;
  ASSERT_TRUE(Register(cluster, absl::Seconds(60), response).ok());
  const grpc::Status status = Register(cluster, absl::Seconds(2), response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::ABORTED) << status.error_message();
  EXPECT_THAT(status.error_message(), HasSubstr("127.0.0.1:5 is the address of server 1, which was alive"));
  EXPECT_THAT(status.error_message(), HasSubstr("end of its lease in 16m"));
}

TEST(RegistrationTest, AServerThatWasStoppedIsGoneAtOnceAndItsAddressIsFree) {
  coordinator::State state({});
  v1::RegisterServerRequest request;
  request.set_address("127.0.0.1:5");
  const v1::RegisterServerResponse server = state.Register(request);
  v1::Map map;
  map.set_map("m");
  v1::BlockPlacement& block = *map.add_blocks();
  block.set_server_id(server.server_id());
  block.set_incarnation(server.incarnation());
  state.EndJob(state.AddMap(map, {}).value().job(), absl::OkStatus(), false);
  EXPECT_EQ(state.Maps()[0].error(), "");
  EXPECT_EQ(state.Unregister(server.server_id(), server.incarnation() + 1).code(),
            absl::StatusCode::kNotFound);
  EXPECT_TRUE(state.Servers()[0].alive());

  ASSERT_TRUE(state.Unregister(server.server_id(), server.incarnation()).ok());
  EXPECT_FALSE(state.Servers()[0].alive());
  const std::string gone = "server 1 (127.0.0.1:5) was stopped and has lost its blocks";
  EXPECT_EQ(state.CheckServer(server.server_id(), server.incarnation()).message(), gone);
  // The map is known to be lost, and not only when a job runs on it.
  EXPECT_EQ(state.Maps()[0].state(), v1::MAP_STATE_READY);
  EXPECT_EQ(state.Maps()[0].error(), gone);
  // A heartbeat that was on its way does not bring it back.
  v1::HeartbeatRequest late;
  late.set_server_id(server.server_id());
  late.set_incarnation(server.incarnation());
  EXPECT_EQ(state.Heartbeat(late).code(), absl::StatusCode::kNotFound);
  EXPECT_FALSE(state.Servers()[0].alive());
  // Nobody waits for the end of its lease.
  const auto next = state.RegisterWhenFree(request, absl::Now(), [] { return false; });
  ASSERT_TRUE(next.ok()) << next.status();
  EXPECT_EQ(next->server_id(), server.server_id());
  EXPECT_TRUE(state.Servers()[0].alive());
}

TEST(RegistrationTest, AServerThatStopsSaysSo) {
  Cluster cluster(2, Lease(absl::Seconds(1000)));
  ASSERT_EQ(cluster.Create(Cluster::GridRequest("m", 2)).state(), v1::JOB_STATE_DONE);
  const std::string stopped = cluster.server(1).address();
  cluster.server(1).Stop();
  grpc::ClientContext context;
  v1::ListServersResponse servers;
  ASSERT_TRUE(cluster.stub().ListServers(&context, {}, &servers).ok());
  ASSERT_EQ(servers.servers_size(), 2);
  for (const v1::Server& server : servers.servers()) EXPECT_EQ(server.alive(), server.address() != stopped);
  const std::string gone = absl::StrCat("(", stopped, ") was stopped and has lost its blocks");
  grpc::ClientContext maps_context;
  v1::ListMapsResponse maps;
  ASSERT_TRUE(cluster.stub().ListMaps(&maps_context, {}, &maps).ok());
  EXPECT_THAT(maps.maps(0).error(), HasSubstr(gone));
  EXPECT_THAT(cluster.Run("m", {{"peek", {}}}).error(), HasSubstr(gone));
  // New maps are placed on those that are there.
  EXPECT_EQ(cluster.Create(Cluster::GridRequest("n", 2)).state(), v1::JOB_STATE_DONE);
  // And another server may have its address at once.
  server::BlockServerOptions next;
  next.coordinator = cluster.coordinator().address();
  next.listen = stopped;
  next.host.factory = MakeTestAlgorithm;
  next.host.threads = 1;
  const auto back = server::BlockServer::Start(std::move(next));
  EXPECT_TRUE(back.ok()) << back.status();
}

}  // namespace
}  // namespace ndmap

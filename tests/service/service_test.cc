// SPDX-License-Identifier: GPL-3.0-or-later
// Servers, surfaces, maps and queries on real services.
#include <gmock/gmock.h>
#include <grpcpp/generic/generic_stub.h>
#include <gtest/gtest.h>

#include <unistd.h>

#include <filesystem>

#include "absl/synchronization/notification.h"
#include "server/export.h"
#include "tests/service/cluster.h"

namespace ndmap {
namespace {

using ::testing::HasSubstr;

TEST(ServerTest, AServerOfAnotherProtocolIsRefusedInOneSentence) {
  Cluster cluster(0);
  server::BlockServerOptions options;
  options.coordinator = cluster.coordinator().address();
  options.host.factory = MakeTestAlgorithm;
  options.version.set_protocol(99);
  options.version.set_release("9.9");
  auto server = server::BlockServer::Start(std::move(options));
  ASSERT_EQ(server.status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(server.status().message()), HasSubstr("ndmap-server 9.9 speaks protocol 99"));
  grpc::ClientContext context;
  v1::GetVersionRequest request;
  request.mutable_caller()->set_protocol(98);
  v1::GetVersionResponse response;
  EXPECT_EQ(cluster.stub().GetVersion(&context, request, &response).error_code(),
            grpc::StatusCode::FAILED_PRECONDITION);
}

TEST(ServerTest, APortInUseAndAMissingCoordinatorAreOneSentence) {
  Cluster cluster(0);
  coordinator::CoordinatorOptions options;
  options.listen = cluster.coordinator().address();
  auto second = coordinator::CoordinatorServer::Start(std::move(options));
  ASSERT_FALSE(second.ok());
  EXPECT_EQ(second.status().message(),
            absl::StrCat("cannot listen on ", cluster.coordinator().address(),
                         ": the port is in use, or the address is not this machine's"));
  server::BlockServerOptions lonely;
  lonely.host.factory = MakeTestAlgorithm;
  const std::string address = cluster.coordinator().address();
  cluster.coordinator().Stop();
  lonely.coordinator = address;
  lonely.coordinator_timeout = absl::Milliseconds(300);
  auto server = server::BlockServer::Start(std::move(lonely));
  ASSERT_FALSE(server.ok());
  EXPECT_EQ(server.status().message(), absl::StrCat("no coordinator answers at ", address));
}

TEST(ServerTest, AServerRegistersAgainWithACoordinatorThatForgotIt) {
  coordinator::StateOptions state;
  coordinator::State first(state);
  v1::RegisterServerRequest request;
  request.set_address("127.0.0.1:1");
  const auto registered = first.Register(request);
  v1::HeartbeatRequest heartbeat;
  heartbeat.set_server_id(registered.server_id());
  heartbeat.set_incarnation(registered.incarnation());
  EXPECT_TRUE(first.Heartbeat(heartbeat).ok());
  coordinator::State restarted(state);
  EXPECT_EQ(restarted.Heartbeat(heartbeat).code(), absl::StatusCode::kNotFound);
  // The same address again: the same number, another incarnation.
  const auto again = first.Register(request);
  EXPECT_EQ(again.server_id(), registered.server_id());
  EXPECT_NE(again.incarnation(), registered.incarnation());
  EXPECT_EQ(first.Heartbeat(heartbeat).code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(std::string(first.CheckServer(registered.server_id(), registered.incarnation()).message()),
              HasSubstr("was restarted"));
}

TEST(ServerTest, HealthIsServed) {
  Cluster cluster(1);
  for (const std::string& address : {cluster.coordinator().address(), cluster.server(0).address()}) {
    grpc::GenericStub stub(service::MakeChannel(address));
    grpc::ClientContext context;
    grpc::ByteBuffer request, response;
    // An empty HealthCheckRequest asks for the whole server.
    grpc::Slice nothing;
    request = grpc::ByteBuffer(&nothing, 1);
    absl::Notification done;
    grpc::Status status;
    stub.UnaryCall(&context, "/grpc.health.v1.Health/Check", {}, &request, &response, [&](grpc::Status s) {
      status = s;
      done.Notify();
    });
    done.WaitForNotification();
    ASSERT_TRUE(status.ok()) << status.error_message();
    grpc::Slice bytes;
    ASSERT_TRUE(response.DumpToSingleSlice(&bytes).ok());
    // Field 1, SERVING.
    EXPECT_EQ(std::string(reinterpret_cast<const char*>(bytes.begin()), bytes.size()),
              std::string("\x08\x01"));
  }
}

TEST(SurfaceTest, ASurfaceIsCheckedOnArrival) {
  coordinator::CoordinatorOptions options;
  options.state.max_surface_bytes = 1 << 20;
  Cluster cluster(0, std::move(options));
  const TriangleSurface good = MakeSample("sphere", {200, 1}).value();
  const std::string id = service::SurfaceId(good);
  EXPECT_TRUE(cluster.Upload(good, id).ok());
  EXPECT_TRUE(cluster.Upload(good, id).ok());
  EXPECT_EQ(cluster.Upload(good, std::string(32, '0')).error_code(), grpc::StatusCode::DATA_LOSS);
  grpc::Status status = cluster.Upload(good, id, [](v1::SurfaceChunk& chunk) {
    if (chunk.has_data()) chunk.mutable_data()->pop_back();
  });
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(status.error_message(), HasSubstr("ended after"));
  status = cluster.Upload(good, id, [](v1::SurfaceChunk& chunk) {
    if (chunk.has_header()) chunk.mutable_header()->set_points(uint64_t{1} << 60);
  });
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  TriangleSurface open = good;
  open.triangles.pop_back();
  EXPECT_EQ(cluster.Upload(open, service::SurfaceId(open)).error_code(), grpc::StatusCode::INVALID_ARGUMENT);
}

TEST(MapTest, AMapIsMadeListedAndDeletedAndNothingIsLeft) {
  Cluster cluster(2);
  const TriangleSurface surface = MakeSample("sphere", {200, 1}).value();
  const std::string id = service::SurfaceId(surface);
  ASSERT_TRUE(cluster.Upload(surface, id).ok());
  v1::CreateMapRequest request = Cluster::GridRequest("m", 3, 4);
  request.set_surface_id(id);
  const v1::Job job = cluster.Create(request);
  ASSERT_EQ(job.state(), v1::JOB_STATE_DONE) << job.error();
  EXPECT_EQ(job.results(0).report().counts().at("hexahedra"), 64);
  {
    grpc::ClientContext context;
    v1::CreateMapResponse response;
    EXPECT_EQ(cluster.stub().CreateMap(&context, request, &response).error_code(),
              grpc::StatusCode::ALREADY_EXISTS);
  }
  {
    grpc::ClientContext context;
    v1::ListMapsResponse response;
    ASSERT_TRUE(cluster.stub().ListMaps(&context, {}, &response).ok());
    ASSERT_EQ(response.maps_size(), 1);
    EXPECT_EQ(response.maps(0).state(), v1::MAP_STATE_READY);
  }
  {
    grpc::ClientContext context;
    v1::DeleteSurfaceRequest delete_surface;
    delete_surface.set_surface_id(id);
    v1::DeleteSurfaceResponse response;
    EXPECT_EQ(cluster.stub().DeleteSurface(&context, delete_surface, &response).error_code(),
              grpc::StatusCode::FAILED_PRECONDITION);
  }
  EXPECT_EQ(cluster.server(0).host().map_count(), 1u);
  grpc::ClientContext context;
  v1::DeleteMapRequest delete_map;
  delete_map.set_map("m");
  v1::DeleteMapResponse response;
  EXPECT_TRUE(cluster.stub().DeleteMap(&context, delete_map, &response).ok());
  EXPECT_EQ(cluster.server(0).host().map_count(), 0u);
  EXPECT_EQ(cluster.server(1).host().map_count(), 0u);
}

TEST(MapTest, UnknownAndMalformedNamesAreNamed) {
  Cluster cluster(1);
  uint64_t number = 0;
  grpc::Status status = cluster.Start("nowhere", {{"peek", {}}}, &number);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_THAT(status.error_message(), HasSubstr("nowhere"));
  for (const std::string& bad : {std::string(), std::string("../etc"), std::string("a b"),
                                 std::string(200, 'x'), std::string("a\0b", 3)}) {
    EXPECT_EQ(cluster.Start(bad, {{"peek", {}}}, &number).error_code(), grpc::StatusCode::INVALID_ARGUMENT)
        << bad;
  }
  grpc::ClientContext context;
  v1::GetJobRequest request;
  request.set_job(77);
  v1::GetJobResponse response;
  status = cluster.stub().GetJob(&context, request, &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_THAT(status.error_message(), HasSubstr("77"));
  v1::CreateMapRequest create = Cluster::GridRequest("m", 1);
  create.set_surface_id("0123");
  grpc::ClientContext create_context;
  v1::CreateMapResponse created;
  EXPECT_EQ(cluster.stub().CreateMap(&create_context, create, &created).error_code(),
            grpc::StatusCode::NOT_FOUND);
  create = Cluster::GridRequest("m", 0);
  grpc::ClientContext none_context;
  EXPECT_EQ(cluster.stub().CreateMap(&none_context, create, &created).error_code(),
            grpc::StatusCode::INVALID_ARGUMENT);
}

TEST(MapTest, WithoutServersAMapIsRefused) {
  Cluster cluster(0);
  grpc::ClientContext context;
  v1::CreateMapResponse response;
  const grpc::Status status = cluster.stub().CreateMap(&context, Cluster::GridRequest("m", 1), &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_THAT(status.error_message(), HasSubstr("no block server"));
}

class BetaTest : public ::testing::TestWithParam<v1::Routing> {
 protected:
  grpc::Status Beta(Cluster& cluster, uint32_t block, const v1::BetaStart& start, const std::string& word,
                    v1::BetaResult* result) {
    auto stub = cluster.ServerOf("m", block);
    grpc::ClientContext context;
    v1::BetaRequest request;
    request.set_map("m");
    request.set_block(block);
    *request.add_starts() = start;
    request.set_word(word);
    v1::BetaResponse response;
    const grpc::Status status = stub->Beta(&context, request, &response);
    if (status.ok()) *result = response.results(0);
    return status;
  }
};

// In a grid of 2 x 2 x 2 hexahedra, each in a block of its own, every dart is either on the boundary or
// crosses.
TEST_P(BetaTest, WalksCrossBlocksAndComeBack) {
  Cluster cluster(3);
  v1::CreateMapRequest request = Cluster::GridRequest("m", 8);
  request.set_routing(GetParam());
  ASSERT_EQ(cluster.Create(request).state(), v1::JOB_STATE_DONE);
  int crossed = 0, boundary = 0;
  for (uint32_t block = 0; block < 8; ++block) {
    v1::BetaStart any;
    any.set_any_dart(true);
    v1::BetaResult first;
    ASSERT_TRUE(Beta(cluster, block, any, "", &first).ok());
    // The darts of four faces around an edge-connected strip.
    for (const std::string& there :
         {std::string(), std::string("\2"), std::string("\1\2"), std::string("\1\1\2")}) {
      v1::BetaStart start;
      *start.mutable_dart() = first.at().dart();
      v1::BetaResult at, beyond, back;
      ASSERT_TRUE(Beta(cluster, block, start, there, &at).ok());
      ASSERT_EQ(at.end(), v1::WALK_END_ARRIVED);
      *start.mutable_dart() = at.at().dart();
      ASSERT_TRUE(Beta(cluster, block, start, "\3", &beyond).ok());
      if (beyond.end() == v1::WALK_END_FREE) {
        ++boundary;
        EXPECT_FALSE(at.at().critical());
        continue;
      }
      ++crossed;
      ASSERT_EQ(beyond.end(), v1::WALK_END_ARRIVED);
      EXPECT_NE(beyond.at().dart().block(), block);
      EXPECT_NE(beyond.at().cell(), at.at().cell());
      EXPECT_EQ(beyond.at().label().root(), at.at().label().root());
      // beta 3 is an involution, and so is beta 1 of beta 3 (axiom of maps): four letters lead home.
      for (const std::string& home : {std::string("\3\3"), std::string("\1\3\1\3")}) {
        ASSERT_TRUE(Beta(cluster, block, start, home, &back).ok());
        EXPECT_EQ(back.end(), v1::WALK_END_ARRIVED);
        EXPECT_EQ(back.used(), home.size());
        EXPECT_EQ(back.at().dart().block(), block);
        EXPECT_EQ(back.at().dart().dart(), at.at().dart().dart());
      }
    }
  }
  EXPECT_GT(crossed, 0);
  EXPECT_GT(boundary, 0);
}

TEST_P(BetaTest, StaleAndUnknownDartsAreRefused) {
  Cluster cluster(1);
  v1::CreateMapRequest request = Cluster::GridRequest("m", 2);
  request.set_routing(GetParam());
  ASSERT_EQ(cluster.Create(request).state(), v1::JOB_STATE_DONE);
  v1::BetaStart start;
  v1::BetaResult result;
  start.mutable_dart()->set_dart(4000000000u);
  EXPECT_EQ(Beta(cluster, 0, start, "\1", &result).error_code(), grpc::StatusCode::NOT_FOUND);
  start.mutable_dart()->set_dart(1);
  start.mutable_dart()->set_version(uint64_t{1} << 60);
  grpc::Status status = Beta(cluster, 0, start, "\1", &result);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_THAT(status.error_message(), HasSubstr("changed since"));
  start.mutable_dart()->set_version(0);
  EXPECT_EQ(Beta(cluster, 0, start, "\7", &result).error_code(), grpc::StatusCode::INVALID_ARGUMENT);
}

INSTANTIATE_TEST_SUITE_P(Routings, BetaTest, ::testing::Values(v1::ROUTING_DIRECT, v1::ROUTING_BROADCAST),
                         [](const auto& info) {
                           return info.param == v1::ROUTING_DIRECT ? "Direct" : "Broadcast";
                         });

TEST(ExportTest, AFileStaysBelowTheDataFolder) {
  namespace fs = std::filesystem;
  const fs::path root = fs::path(::testing::TempDir()) / absl::StrCat("ndmap_export_", getpid());
  fs::create_directories(root / "data");
  fs::create_directories(root / "outside");
  fs::create_directory_symlink(root / "outside", root / "data" / "link");
  const std::string data = (root / "data").string();
  v1::ExportPieceRequest request;
  request.set_map("m");
  request.set_folder("a/b");
  EXPECT_EQ(server::FileInDataFolder(data, request).value(), (root / "data/a/b/m_0.vtu").string());
  for (const char* folder : {"/etc", "../outside", "a/../../outside", "link", "link/deeper", "a//b"}) {
    request.set_folder(folder);
    EXPECT_EQ(server::FileInDataFolder(data, request).status().code(), absl::StatusCode::kPermissionDenied)
        << folder;
  }
  request.set_folder("a");
  request.set_file("../x");
  EXPECT_EQ(server::FileInDataFolder(data, request).status().code(), absl::StatusCode::kInvalidArgument);
  request.set_file("x.vtu");
  EXPECT_EQ(server::FileInDataFolder("", request).status().code(), absl::StatusCode::kFailedPrecondition);
  fs::remove_all(root);
}

}  // namespace
}  // namespace ndmap

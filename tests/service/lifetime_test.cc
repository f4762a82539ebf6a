// SPDX-License-Identifier: GPL-3.0-or-later
// What stays and what goes: blocks of deleted maps, surfaces that nobody uses, maps that were never made,
// long parameters of jobs that have ended.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "tests/service/cluster.h"

namespace ndmap {
namespace {

using ::testing::HasSubstr;
using ::testing::SizeIs;

v1::Map NamedMap(const std::string& name, const std::string& surface = "") {
  v1::Map map;
  map.set_map(name);
  map.set_surface_id(surface);
  return map;
}

v1::HeartbeatRequest Heartbeat(const v1::RegisterServerResponse& server) {
  v1::HeartbeatRequest request;
  request.set_server_id(server.server_id());
  request.set_incarnation(server.incarnation());
  return request;
}

v1::RegisterServerRequest ServerAt(const std::string& address) {
  v1::RegisterServerRequest request;
  request.set_address(address);
  return request;
}

// A map of the coordinator, made and at rest.
v1::Map AddMap(coordinator::State& state, const std::string& name, const std::string& surface = "") {
  const auto job = state.AddMap(NamedMap(name, surface), {});
  EXPECT_TRUE(job.ok()) << job.status();
  if (job.ok()) state.EndJob(job->job(), absl::OkStatus(), false);
  return state.FindMap(name).value();
}

TEST(LifetimeTest, AServerIsToldWhichOfItsMapsWereDeletedAlsoWhenTheNameIsInUseAgain) {
  coordinator::State state({});
  v1::HeartbeatRequest request = Heartbeat(state.Register(ServerAt("127.0.0.1:1")));
  AddMap(state, "stays");
  AddMap(state, "again");
  for (const v1::Map& map : state.Maps()) {
    v1::MapNumber& here = *request.add_maps();
    here.set_map(map.map());
    here.set_number(map.number());
  }
  v1::HeartbeatResponse response;
  ASSERT_TRUE(state.Heartbeat(request, &response).ok());
  EXPECT_THAT(response.drop(), SizeIs(0));
  const v1::Map old = state.RemoveMap("again").value();
  state.FreeName("again");
  EXPECT_NE(AddMap(state, "again").number(), old.number());
  ASSERT_TRUE(state.Heartbeat(request, &response).ok());
  ASSERT_THAT(response.drop(), SizeIs(1));
  EXPECT_EQ(response.drop(0).map(), "again");
  EXPECT_EQ(response.drop(0).number(), old.number());
}

TEST(LifetimeTest, ANameIsFreeWhenItsBlocksAreDropped) {
  coordinator::State state({});
  AddMap(state, "m");
  ASSERT_TRUE(state.RemoveMap("m").ok());
  EXPECT_EQ(state.FindMap("m").status().code(), absl::StatusCode::kNotFound);
  const auto refused = state.AddMap(NamedMap("m"), {});
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(refused.status().message()), HasSubstr("still being deleted"));
  state.FreeName("m");
  AddMap(state, "m");
}

v1::CreateBlocksRequest Blocks(const std::string& map, uint64_t number, const std::string& surface = "") {
  v1::CreateBlocksRequest request;
  request.set_map(map);
  request.set_map_number(number);
  request.set_block_count(1);
  request.add_blocks(0);
  request.set_surface_id(surface);
  return request;
}

TEST(LifetimeTest, BlocksOfAMapThatTheCoordinatorDoesNotKnowAreDropped) {
  coordinator::CoordinatorOptions options;
  options.state.lease = absl::Milliseconds(300);
  Cluster cluster(1, std::move(options));
  ASSERT_EQ(cluster.Create(Cluster::GridRequest("kept", 1)).state(), v1::JOB_STATE_DONE);
  ASSERT_TRUE(cluster.server(0).host().CreateBlocks(Blocks("deleted", 77)).ok());
  const absl::Time end = absl::Now() + absl::Seconds(30);
  while (cluster.server(0).host().map_count() > 1 && absl::Now() < end) {
    grpc::ClientContext context;
    v1::ListServersResponse response;
    ASSERT_TRUE(cluster.stub().ListServers(&context, {}, &response).ok());
  }
  EXPECT_EQ(cluster.server(0).host().map_count(), 1u);
  EXPECT_TRUE(cluster.server(0).host().Info("kept").ok());
}

TEST(LifetimeTest, AnOldDropLeavesTheNewMapOfThatName) {
  server::HostOptions options;
  options.factory = MakeTestAlgorithm;
  server::BlockHost host(std::move(options));
  ASSERT_TRUE(host.CreateBlocks(Blocks("m", 2)).ok());
  EXPECT_EQ(host.DropMap("m", 1).code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(host.map_count(), 1u);
  EXPECT_TRUE(host.DropMap("m", 2).ok());
  EXPECT_EQ(host.map_count(), 0u);
}

TEST(LifetimeTest, MapsOnOneSurfaceShareOneCopyOnTheirServer) {
  server::HostOptions options;
  std::vector<const TriangleSurface*> seen;
  options.factory = [&seen](absl::string_view name, const Parameters& parameters,
                            const Environment& environment, Block3& block) {
    seen.push_back(environment.surface.get());
    return MakeTestAlgorithm(name, parameters, environment, block);
  };
  server::BlockHost host(std::move(options));
  const TriangleSurface surface = MakeSample("sphere", {200, 1}).value();
  const std::string id = service::SurfaceId(surface);
  for (const char* map : {"a", "b"}) {
    ASSERT_TRUE(host.PutSurface(id, surface, 1 << 20).ok());
    ASSERT_TRUE(host.CreateBlocks(Blocks(map, 1, id)).ok());
    v1::StartPhaseRequest start;
    start.mutable_key()->set_map(map);
    start.mutable_phase()->set_algorithm("peek");
    start.add_placement()->set_address(host.address());
    ASSERT_TRUE(host.StartPhase(start).ok());
  }
  ASSERT_THAT(seen, SizeIs(2));
  EXPECT_NE(seen[0], nullptr);
  EXPECT_EQ(seen[0], seen[1]);
}

TEST(LifetimeTest, UnusedSurfacesMakeRoomOldestFirstAndUsedOnesStay) {
  const TriangleSurface surface = MakeSample("sphere", {200, 1}).value();
  const uint64_t bytes = service::SurfaceBytes(surface.points.size(), surface.triangles.size());
  coordinator::StateOptions options;
  options.max_surface_bytes = 3 * bytes;
  coordinator::State state(options);
  for (const char* id : {"used", "oldest", "older"}) ASSERT_TRUE(state.AddSurface(id, "", surface).ok());
  AddMap(state, "m", "used");
  // Sent again, it is not the oldest any more.
  ASSERT_TRUE(state.AddSurface("oldest", "", surface).ok());
  ASSERT_TRUE(state.AddSurface("new", "", surface).ok());
  EXPECT_TRUE(state.FindSurface("used").ok());
  EXPECT_TRUE(state.FindSurface("oldest").ok());
  EXPECT_FALSE(state.FindSurface("older").ok());
  AddMap(state, "n", "oldest");
  AddMap(state, "o", "new");
  const absl::Status full = state.AddSurface("one more", "", surface);
  EXPECT_EQ(full.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(full.message()), HasSubstr("--max-surface-bytes"));
  // A map that comes too late says so.
  EXPECT_EQ(state.AddMap(NamedMap("p", "older"), {}).status().code(), absl::StatusCode::kNotFound);

  // A server does the same.
  server::BlockHost host{server::HostOptions()};
  ASSERT_TRUE(host.PutSurface("used", surface, 2 * bytes).ok());
  ASSERT_TRUE(host.CreateBlocks(Blocks("m", 1, "used")).ok());
  for (const char* id : {"unused", "new"}) ASSERT_TRUE(host.PutSurface(id, surface, 2 * bytes).ok());
  EXPECT_EQ(host.CreateBlocks(Blocks("n", 2, "unused")).code(), absl::StatusCode::kNotFound);
  EXPECT_TRUE(host.CreateBlocks(Blocks("n", 2, "new")).ok());
  EXPECT_EQ(host.PutSurface("more", surface, 2 * bytes).code(), absl::StatusCode::kResourceExhausted);
}

TEST(LifetimeTest, UnusedSurfacesAreBoundedInNumberToo) {
  coordinator::State state({});
  const TriangleSurface surface = MakeSample("sphere", {100, 1}).value();
  for (int i = 0; i < 200; ++i) ASSERT_TRUE(state.AddSurface(absl::StrCat(i), "", surface).ok());
  EXPECT_FALSE(state.FindSurface("0").ok());
  EXPECT_TRUE(state.FindSurface("199").ok());
}

TEST(LifetimeTest, AMapThatWasNeverMadeRefusesEveryJobAndSaysToDeleteIt) {
  Cluster cluster(1);
  v1::CreateMapRequest request = Cluster::GridRequest("m", 1);
  (*request.mutable_parameters())["corners"] = "none";
  EXPECT_EQ(cluster.Create(request).state(), v1::JOB_STATE_FAILED);
  uint64_t job = 0;
  for (const char* algorithm : {"peek", "token"}) {
    const grpc::Status status = cluster.Start("m", {{algorithm, {}}}, &job);
    EXPECT_EQ(status.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
    EXPECT_THAT(status.error_message(), HasSubstr("map \"m\" was never made"));
    EXPECT_THAT(status.error_message(), HasSubstr("delete it"));
  }
  grpc::ClientContext context;
  v1::DeleteMapRequest remove;
  remove.set_map("m");
  v1::DeleteMapResponse response;
  EXPECT_TRUE(cluster.stub().DeleteMap(&context, remove, &response).ok());
  EXPECT_EQ(cluster.Create(Cluster::GridRequest("m", 1)).state(), v1::JOB_STATE_DONE);
}

TEST(LifetimeTest, AWrongParameterOfAPhaseLeavesTheMapUsable) {
  Cluster cluster(1);
  ASSERT_EQ(cluster.Create(Cluster::GridRequest("m", 2)).state(), v1::JOB_STATE_DONE);
  EXPECT_EQ(cluster.Run("m", {{"refine", {{"depth", "deep"}}}}).state(), v1::JOB_STATE_FAILED);
  EXPECT_EQ(cluster.Run("m", {{"token", {}}}).state(), v1::JOB_STATE_DONE);
}

TEST(LifetimeTest, LongParametersOfEndedJobsAreForgotten) {
  Cluster cluster(1);
  ASSERT_EQ(cluster.Create(Cluster::GridRequest("m", 1)).state(), v1::JOB_STATE_DONE);
  const v1::Job job = cluster.Run("m", {{"peek", {{"long", std::string(1 << 20, 'x')}, {"hops", "2"}}}});
  ASSERT_EQ(job.state(), v1::JOB_STATE_DONE) << job.error();
  for (const v1::Phase& phase : {job.phases(0), job.results(0).phase()}) {
    EXPECT_EQ(phase.parameters().at("long"), "(1048576 bytes)");
    EXPECT_EQ(phase.parameters().at("hops"), "2");
  }
}

TEST(LifetimeTest, NoIncarnationIsUsedAgainWhenTheCoordinatorIsRestarted) {
  std::set<uint64_t> incarnations;
  for (int life = 0; life < 3; ++life) {
    coordinator::State state({});
    for (int i = 0; i < 2; ++i) incarnations.insert(state.Register(ServerAt("127.0.0.1:1")).incarnation());
  }
  EXPECT_THAT(incarnations, SizeIs(6));
}

// Exports from a cluster of this process's own while its files cannot grow, and once more when they can
// again. Exits with 0 if that went as it should; otherwise standard error says what did not.
[[noreturn]] void ExportOntoAFullDisk() {
  namespace fs = std::filesystem;
  const fs::path data = fs::path(::testing::TempDir()) / absl::StrCat("ndmap_full_", getpid());
  fs::create_directories(data);
  server::ServiceOptions service;
  service.data_folder = data.string();
  Cluster cluster(1, {}, {}, service);
  const v1::Job job = cluster.Create(Cluster::GridRequest("m", 1, 4));
  auto stub = cluster.ServerOf("m", 0);
  const auto export_piece = [&] {
    grpc::ClientContext context;
    v1::ExportPieceRequest request;
    request.set_map("m");
    request.set_folder("out");
    auto reader = stub->ExportPiece(&context, request);
    v1::ExportPieceResponse response;
    while (reader->Read(&response)) {
    }
    return reader->Finish();
  };
  const auto expect = [](bool holds, absl::string_view what) {
    if (holds) return;
    std::cerr << "not so: " << what << std::endl;
    std::_Exit(1);
  };
  expect(job.state() == v1::JOB_STATE_DONE, "the map was made");
  rlimit limit{};
  expect(getrlimit(RLIMIT_FSIZE, &limit) == 0, "there is a limit");
  const rlim_t before = std::exchange(limit.rlim_cur, 100);
  signal(SIGXFSZ, SIG_IGN);
  expect(setrlimit(RLIMIT_FSIZE, &limit) == 0, "the limit is set");
  const grpc::Status status = export_piece();
  limit.rlim_cur = before;
  expect(setrlimit(RLIMIT_FSIZE, &limit) == 0, "the limit is raised");
  expect(status.error_code() == grpc::StatusCode::UNAVAILABLE, "the export is UNAVAILABLE");
  expect(absl::StrContains(status.error_message(), "cannot write"), status.error_message());
  expect(fs::is_empty(data / "out"), "nothing is left");
  expect(export_piece().ok() && !fs::is_empty(data / "out"), "with room it is written");
  fs::remove_all(data);
  std::_Exit(0);
}

// As on a full disk: files cannot grow. In a process of its own, because the limit is the process's.
TEST(LifetimeDeathTest, AnExportWithoutRoomOnTheDiskIsUnavailableAndLeavesNothing) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(ExportOntoAFullDisk(), ::testing::ExitedWithCode(0), "");
}

}  // namespace
}  // namespace ndmap

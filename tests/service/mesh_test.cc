// SPDX-License-Identifier: GPL-3.0-or-later
// The main job on real services: the mesh is the same whatever the number of blocks, servers and the routing.
#include <xxhash.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "tests/service/cluster.h"

namespace ndmap {
namespace {

constexpr int kDepth = 3;

std::string ReadAll(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

struct Mesh {
  std::string hash;
  int64_t made = 0, kept = 0;
};

// Creates map `name` and does refine, trim, check, hash.
Mesh MakeMesh(Cluster& cluster, const std::string& name, uint32_t blocks, v1::Routing routing,
              const std::string& surface_id) {
  v1::CreateMapRequest request;
  request.set_map(name);
  request.set_surface_id(surface_id);
  request.set_block_count(blocks);
  request.set_routing(routing);
  request.set_depth(kDepth);
  for (int i = 0; i < 3; ++i) {
    request.mutable_grid()->add_cells(3);
    request.mutable_grid()->add_lo(-1.5);
    request.mutable_grid()->add_hi(1.5);
  }
  EXPECT_EQ(cluster.Create(request).state(), v1::JOB_STATE_DONE);
  std::vector<std::pair<std::string, Cluster::Values>> phases;
  for (int level = 0; level < kDepth; ++level) {
    phases.push_back({"refine", {{"depth", absl::StrCat(kDepth)}, {"level", absl::StrCat(level)}}});
  }
  phases.insert(phases.end(),
                {{"classify", {}}, {"count", {}}, {"trim", {}}, {"count", {}}, {"check", {}}, {"hash", {}}});
  const v1::Job job = cluster.Run(name, phases);
  EXPECT_EQ(job.state(), v1::JOB_STATE_DONE) << job.error();
  if (job.state() != v1::JOB_STATE_DONE) return {};
  auto result = [&](int i) -> const v1::Report& { return job.results(kDepth + i).report(); };
  EXPECT_EQ(result(4).counts().at("findings"), 0) << result(4).DebugString();
  if (routing == v1::ROUTING_DIRECT) {
    for (int level = 0; level < kDepth; ++level) {
      EXPECT_EQ(job.results(level).report().counts().at("messages_kept"), 0);
    }
  }
  return {absl::StrCat(absl::Hex(result(5).digest_hi()), ":", absl::Hex(result(5).digest_lo())),
          result(1).counts().at("hexahedra"), result(3).counts().at("hexahedra")};
}

TEST(MeshTest, IsTheSameForAnyNumberOfBlocksServersAndBothRoutingsAndIsExported) {
  namespace fs = std::filesystem;
  const fs::path data = fs::path(::testing::TempDir()) / absl::StrCat("ndmap_mesh_", getpid());
  fs::create_directories(data);
  server::ServiceOptions service;
  service.data_folder = data.string();
  Cluster cluster(3, {}, {}, service);
  const TriangleSurface surface = MakeSample("torus", {2000, 1}).value();
  const std::string id = service::SurfaceId(surface);
  ASSERT_TRUE(cluster.Upload(surface, id).ok());
  const Mesh one = MakeMesh(cluster, "one", 1, v1::ROUTING_DIRECT, id);
  const Mesh many = MakeMesh(cluster, "many", 7, v1::ROUTING_DIRECT, id);
  const Mesh broadcast = MakeMesh(cluster, "broadcast", 5, v1::ROUTING_BROADCAST, id);
  EXPECT_GT(one.kept, 0);
  EXPECT_LT(one.kept, one.made);
  for (const Mesh& mesh : {many, broadcast}) {
    EXPECT_EQ(mesh.hash, one.hash);
    EXPECT_EQ(mesh.made, one.made);
    EXPECT_EQ(mesh.kept, one.kept);
  }

  int64_t cells = 0;
  for (uint32_t b = 0; b < 7; ++b) {
    auto stub = cluster.ServerOf("many", b);
    v1::ExportPieceRequest request;
    request.set_map("many");
    request.set_block(b);
    std::string streamed;
    v1::ExportPieceResponse response;
    {
      grpc::ClientContext context;
      auto reader = stub->ExportPiece(&context, request);
      while (reader->Read(&response)) streamed += response.data();
      ASSERT_TRUE(reader->Finish().ok());
    }
    ASSERT_TRUE(response.has_summary());
    cells += response.summary().counts().at("cells");
    EXPECT_EQ(response.summary().bytes(), streamed.size());
    EXPECT_EQ(response.summary().checksum(), XXH3_64bits(streamed.data(), streamed.size()));
    request.set_folder("out");
    grpc::ClientContext context;
    auto reader = stub->ExportPiece(&context, request);
    while (reader->Read(&response)) {
    }
    ASSERT_TRUE(reader->Finish().ok());
    EXPECT_EQ(response.summary().file(), absl::StrCat("out/many_", b, ".vtu"));
    EXPECT_EQ(ReadAll(data / response.summary().file()), streamed);
  }
  EXPECT_EQ(cells, many.kept);
  fs::remove_all(data);
}

}  // namespace
}  // namespace ndmap

// SPDX-License-Identifier: GPL-3.0-or-later
// Maps of meshes through the real services: the same whatever the blocks, and nothing is left of what went
// wrong.
#include <gtest/gtest.h>

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <set>

#include "absl/strings/str_join.h"
#include "core/io/vtu_values.h"
#include "tests/service/mesh_cluster.h"

namespace ndmap {
namespace {

Made Create(Cluster& cluster, const std::string& map, const VolumeMesh& mesh, uint32_t blocks,
            v1::Routing routing = v1::ROUTING_DIRECT) {
  v1::CreateMapRequest request = PutMesh(cluster, map, mesh, Assigned(mesh, blocks), blocks);
  request.set_routing(routing);
  const v1::Job job = cluster.Create(request);
  EXPECT_EQ(job.state(), v1::JOB_STATE_DONE) << job.error();
  return Look(cluster, map);
}

void Refine(Cluster& cluster, const std::string& map, const Cluster::Values& values) {
  const v1::Job job = cluster.Run(map, {{"refine", values}});
  ASSERT_EQ(job.state(), v1::JOB_STATE_DONE) << job.error();
}

TEST(MeshMap, IsTheSameForAnyNumberOfBlocksAlsoRefinedBesideOtherCells) {
  for (uint64_t seed : {1u, 3u, 8u, 20u, 40u}) {
    const reference::MeshCase c = seed < 10 ? reference::MakeMeshCase(seed) : Large(seed);
    SCOPED_TRACE(c.Describe());
    Cluster cluster(3);
    Made initial, everything, listed;
    for (uint32_t blocks : {1u, 2u, 8u}) {
      if (blocks > c.mesh.cells()) continue;
      SCOPED_TRACE(blocks);
      const std::string map = absl::StrCat("m", blocks);
      const v1::Routing routing = blocks == 8 ? v1::ROUTING_BROADCAST : v1::ROUTING_DIRECT;
      const Made made = Create(cluster, map, c.mesh, blocks, routing);
      if (blocks == 1) initial = made;
      EXPECT_EQ(made.hash, initial.hash);
      EXPECT_EQ(made.counts, initial.counts);
      const v1::MeshSummary summary = SummaryOf(c.mesh);
      EXPECT_EQ(made.counts.at("hexahedra"), static_cast<int64_t>(summary.hexahedra()));
      Refine(cluster, map, {{"oracle", "everything"}, {"depth", "1"}});
      const Made refined = Look(cluster, map);
      if (blocks == 1) everything = refined;
      EXPECT_EQ(refined.hash, everything.hash);
      EXPECT_EQ(refined.counts, everything.counts);
      EXPECT_EQ(refined.counts.at("hexahedra"), static_cast<int64_t>(8 * summary.hexahedra()));
      EXPECT_TRUE(Delete(cluster, map).ok());
      // The case's own list, of mixed depths.
      Create(cluster, map, c.mesh, blocks, routing);
      if (!c.refined.empty()) {
        const std::string cells = absl::StrJoin(
            c.refined, " ", [](std::string* out, const CellId& id) { absl::StrAppend(out, id.ToString()); });
        Refine(cluster, map, {{"oracle", "list"}, {"depth", "3"}, {"cells", cells}});
      }
      const Made by_list = Look(cluster, map);
      if (blocks == 1) listed = by_list;
      EXPECT_EQ(by_list.hash, listed.hash);
      EXPECT_TRUE(Delete(cluster, map).ok());
    }
    EXPECT_EQ(PieceBytes(cluster), 0u);
  }
}

TEST(MeshMap, IsRefinedInABoxAndASphereAndTrimmedByCell) {
  const reference::MeshCase c = Large(4);
  Cluster cluster(2);
  std::string hash;
  for (uint32_t blocks : {1u, 3u}) {
    const std::string map = absl::StrCat("m", blocks);
    Create(cluster, map, c.mesh, blocks);
    Refine(cluster, map, {{"oracle", "box"}, {"depth", "2"}, {"lo", "0,0,0"}, {"hi", "1.2,1.2,1.2"}});
    Refine(cluster, map, {{"oracle", "sphere"}, {"depth", "3"}, {"centre", "1,1,1"}, {"radius", "0.3"}});
    Refine(cluster, map, {{"oracle", "size"}, {"depth", "1"}, {"size", "0.1"}});
    const v1::Job job = cluster.Run(map, {{"trim", {{"keep", "all"}, {"cells", "h0"}}}});
    EXPECT_EQ(job.state(), v1::JOB_STATE_DONE) << job.error();
    const Made made = Look(cluster, map);
    if (hash.empty()) hash = made.hash;
    EXPECT_EQ(made.hash, hash);
  }
}

// A block as a VTU file.
std::string Export(Cluster& cluster, const std::string& map, uint32_t block,
                   const char* cells = "hexahedron") {
  v1::ExportPieceRequest request;
  request.set_map(map);
  request.set_block(block);
  (*request.mutable_options())["cells"] = cells;
  grpc::ClientContext context;
  auto reader = cluster.ServerOf(map, block)->ExportPiece(&context, request);
  std::string bytes;
  v1::ExportPieceResponse part;
  while (reader->Read(&part)) bytes += part.data();
  const grpc::Status status = reader->Finish();
  EXPECT_TRUE(status.ok()) << status.error_message();
  return bytes;
}

TEST(MeshMap, AnExportReadAgainIsTheSameMap) {
  for (uint64_t seed : {1u, 2u, 3u}) {
    const reference::MeshCase c = reference::MakeMeshCase(seed);
    SCOPED_TRACE(c.Describe());
    Cluster cluster(2);
    const Made made = Create(cluster, "m", c.mesh, 1);
    const auto file = ReadVolumeMeshFromBytes(Export(cluster, "m", 0));
    ASSERT_TRUE(file.ok()) << file.status();
    const auto glued = Glue(file->mesh, {.allow_concave = true});
    ASSERT_TRUE(glued.ok()) << glued.status();
    const Made again = Create(cluster, "again", glued->mesh, 2);
    EXPECT_EQ(again.hash, made.hash);
    EXPECT_EQ(again.counts, made.counts);
  }
}

TEST(MeshMap, PiecesAgreeOnTheNumbersOfPoints) {
  const reference::MeshCase c = Large(60);
  Cluster cluster(2);
  // Of one block, and of several put together.
  std::set<int64_t> one, cells;
  for (uint32_t blocks : {1u, 5u}) {
    const std::string map = absl::StrCat("m", blocks);
    Create(cluster, map, c.mesh, blocks);
    Refine(cluster, map, {{"oracle", "sphere"}, {"depth", "2"}, {"centre", "1,1,1"}, {"radius", "0.6"}});
    std::set<int64_t> points, numbers;
    for (uint32_t b = 0; b < blocks; ++b) {
      const std::string path = absl::StrCat(::testing::TempDir(), "/ndmap_mesh_", getpid(), ".vtu");
      std::ofstream(path, std::ios::binary) << Export(cluster, map, b, "polyhedron");
      const auto at = ReadVtuValues(path, VtuPart::kPoints, "id", VtuKind::kIntegers);
      const auto in = ReadVtuValues(path, VtuPart::kCells, "id", VtuKind::kIntegers);
      std::filesystem::remove(path);
      ASSERT_TRUE(at.ok()) << at.status();
      ASSERT_TRUE(in.ok()) << in.status();
      for (int64_t number : in->ids) EXPECT_TRUE(numbers.insert(number).second) << number;
      points.insert(at->ids.begin(), at->ids.end());
    }
    if (blocks == 1) one = points;
    if (blocks == 1) cells = numbers;
    EXPECT_EQ(points, one);
    EXPECT_EQ(numbers, cells);
    EXPECT_EQ(static_cast<int64_t>(points.size()), Look(cluster, map).counts.at("vertices"));
  }
}

#ifdef NDMAP_MESHES
TEST(MeshMap, RealMeshesAreTheSameForAnyNumberOfBlocks) {
  for (const char* name : {"mixed_all4.mfem.mesh", "fichera-mixed.mfem.mesh", "unstructured_hex_400.msh",
                           "hybrid_tet_prism_pyramid.msh", "sphere_hybrid_tet_prism.msh"}) {
    SCOPED_TRACE(name);
    const auto glued = ReadGluedMesh(std::string(NDMAP_MESHES) + "/volumes/" + name);
    ASSERT_TRUE(glued.ok()) << glued.status();
    Cluster cluster(3);
    Made initial, refined;
    for (uint32_t blocks : {1u, 2u, 8u}) {
      if (blocks > glued->mesh.cells()) continue;
      const std::string map = absl::StrCat("m", blocks);
      const Made made = Create(cluster, map, glued->mesh, blocks);
      if (blocks == 1) initial = made;
      EXPECT_EQ(made.hash, initial.hash);
      EXPECT_EQ(made.counts, initial.counts);
      EXPECT_EQ(made.counts.at("vertices"), static_cast<int64_t>(glued->mesh.points.size()));
      if (SummaryOf(glued->mesh).hexahedra() == 0) continue;
      Refine(cluster, map, {{"oracle", "everything"}, {"depth", "2"}});
      const Made finer = Look(cluster, map);
      if (blocks == 1) refined = finer;
      EXPECT_EQ(finer.hash, refined.hash);
      EXPECT_EQ(finer.counts, refined.counts);
    }
  }
}
#endif

}  // namespace
}  // namespace ndmap

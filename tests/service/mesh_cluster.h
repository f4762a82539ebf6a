// SPDX-License-Identifier: GPL-3.0-or-later
// Maps of meshes on the real services, for tests: pieces are put as any client would put them.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "core/algorithm/load/mesh_assignment.h"
#include "core/io/mesh_reader.h"
#include "core/mesh/mesh_piece.h"
#include "service/mesh.h"
#include "tests/reference/mesh_case.h"
#include "tests/service/cluster.h"

namespace ndmap {

// A random mesh of some cells.
inline reference::MeshCase Large(uint64_t seed) {
  reference::MeshCase c = reference::MakeMeshCase(seed);
  while (c.mesh.cells() < 30) c = reference::MakeMeshCase(++seed);
  return c;
}

inline v1::MeshSummary SummaryOf(const VolumeMesh& mesh) {
  v1::MeshSummary summary;
  for (CellKind kind : mesh.kinds) {
    if (kind == CellKind::kTetrahedron) summary.set_tetrahedra(summary.tetrahedra() + 1);
    if (kind == CellKind::kPyramid) summary.set_pyramids(summary.pyramids() + 1);
    if (kind == CellKind::kPrism) summary.set_prisms(summary.prisms() + 1);
    if (kind == CellKind::kHexahedron) summary.set_hexahedra(summary.hexahedra() + 1);
  }
  summary.set_points(mesh.points.size());
  return summary;
}

inline v1::PlaceBlocksResponse PlaceBlocks(Cluster& cluster, uint32_t blocks) {
  grpc::ClientContext context;
  v1::PlaceBlocksRequest request;
  request.set_block_count(blocks);
  v1::PlaceBlocksResponse response;
  const grpc::Status status = cluster.stub().PlaceBlocks(&context, request, &response);
  EXPECT_TRUE(status.ok()) << status.error_message();
  return response;
}

// `spoil` sees every chunk before it is sent.
inline grpc::Status PutPiece(const std::string& address, const MeshPiece& piece, uint64_t upload,
                             uint32_t block, uint32_t blocks,
                             const std::function<void(v1::PieceChunk&)>& spoil = nullptr) {
  auto stub = v1::BlockService::NewStub(service::MakeChannel(address));
  grpc::ClientContext context;
  v1::PutPieceResponse response;
  auto writer = stub->PutPiece(&context, &response);
  service::SendPiece(piece, upload, BlockId{block}, blocks, [&](const v1::PieceChunk& chunk) {
    v1::PieceChunk sent = chunk;
    if (spoil) spoil(sent);
    return writer->Write(sent);
  });
  writer->WritesDone();
  return writer->Finish();
}

// The request that makes a map of a mesh whose pieces have been put.
inline v1::CreateMapRequest PutMesh(Cluster& cluster, const std::string& map, const VolumeMesh& mesh,
                                    const std::vector<uint32_t>& block_of, uint32_t blocks) {
  const v1::PlaceBlocksResponse placed = PlaceBlocks(cluster, blocks);
  const MeshCutter cutter(mesh, block_of, blocks);
  for (uint32_t b = 0; b < blocks; ++b) {
    const grpc::Status status = PutPiece(placed.blocks(static_cast<int>(b)).address(),
                                         cutter.Piece(BlockId{b}), placed.upload(), b, blocks);
    EXPECT_TRUE(status.ok()) << status.error_message();
  }
  v1::CreateMapRequest request;
  request.set_map(map);
  request.set_block_count(blocks);
  *request.mutable_mesh()->mutable_mesh() = SummaryOf(mesh);
  request.mutable_mesh()->set_upload(placed.upload());
  *request.mutable_mesh()->mutable_blocks() = placed.blocks();
  return request;
}

inline std::vector<uint32_t> Assigned(const VolumeMesh& mesh, uint32_t blocks,
                                      const char* partition = "metis") {
  const auto glued = Glue(mesh, {.allow_concave = true});
  EXPECT_TRUE(glued.ok()) << glued.status();
  const auto block_of = AssignMesh(*glued, blocks, partition);
  EXPECT_TRUE(block_of.ok()) << block_of.status();
  return *block_of;
}

struct Made {
  std::string hash;
  std::map<std::string, int64_t> counts;
};

// What hash, count and check say of a map.
inline Made Look(Cluster& cluster, const std::string& map) {
  const v1::Job job = cluster.Run(map, {{"check", {}}, {"count", {}}, {"hash", {}}});
  EXPECT_EQ(job.state(), v1::JOB_STATE_DONE) << job.error();
  if (job.results_size() != 3) return {};
  const v1::Report& check = job.results(0).report();
  EXPECT_EQ(check.counts().at("findings"), 0) << check.DebugString();
  Made made;
  for (const auto& [name, count] : job.results(1).report().counts()) {
    if (name != "accounted_bytes" && name != "critical_darts") made.counts[name] = count;
  }
  const v1::Report& hash = job.results(2).report();
  made.hash = absl::StrCat(absl::Hex(hash.digest_hi()), ":", absl::Hex(hash.digest_lo()));
  return made;
}

// Bytes of pieces on all servers.
inline uint64_t PieceBytes(Cluster& cluster) {
  uint64_t bytes = 0;
  for (size_t i = 0; i < cluster.size(); ++i) bytes += cluster.server(i).host().pieces().bytes();
  return bytes;
}

inline grpc::Status Delete(Cluster& cluster, const std::string& map) {
  grpc::ClientContext context;
  v1::DeleteMapRequest request;
  request.set_map(map);
  v1::DeleteMapResponse response;
  return cluster.stub().DeleteMap(&context, request, &response);
}

}  // namespace ndmap

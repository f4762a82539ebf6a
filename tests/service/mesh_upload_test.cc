// SPDX-License-Identifier: GPL-3.0-or-later
// Pieces of meshes on their way in: what is no piece is refused, and nothing is left of what went wrong.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <thread>

#include "tests/service/mesh_cluster.h"

namespace ndmap {
namespace {

using ::testing::HasSubstr;

// A mesh of some cells in two blocks.
class MeshUpload : public ::testing::Test {
 protected:
  MeshUpload()
      : mesh_(reference::MakeMeshCase(1).mesh),
        block_of_(Assigned(mesh_, 2)),
        cutter_(mesh_, block_of_, 2),
        placed_(PlaceBlocks(cluster_, 2)) {}

  grpc::Status Put(uint32_t block, const std::function<void(v1::PieceChunk&)>& spoil = nullptr) {
    return PutPiece(placed_.blocks(static_cast<int>(block)).address(), cutter_.Piece(BlockId{block}),
                    placed_.upload(), block, 2, spoil);
  }
  static void Expect(const grpc::Status& status, grpc::StatusCode code, const char* says) {
    EXPECT_EQ(status.error_code(), code) << status.error_message();
    EXPECT_THAT(status.error_message(), HasSubstr(says));
  }
  v1::CreateMapRequest Request() {
    v1::CreateMapRequest request;
    request.set_map("m");
    request.set_block_count(2);
    *request.mutable_mesh()->mutable_mesh() = SummaryOf(mesh_);
    request.mutable_mesh()->set_upload(placed_.upload());
    *request.mutable_mesh()->mutable_blocks() = placed_.blocks();
    return request;
  }
  grpc::Status TryCreate(const v1::CreateMapRequest& request) {
    grpc::ClientContext context;
    v1::CreateMapResponse response;
    return cluster_.stub().CreateMap(&context, request, &response);
  }

  Cluster cluster_{2};
  const VolumeMesh mesh_;
  const std::vector<uint32_t> block_of_;
  const MeshCutter cutter_;
  const v1::PlaceBlocksResponse placed_;
};

TEST_F(MeshUpload, RefusesWhatIsNoPieceAndKeepsNothingOfIt) {
  using Code = grpc::StatusCode;
  const auto header = [](const std::function<void(v1::PieceHeader&)>& change) {
    return [change](v1::PieceChunk& chunk) {
      if (chunk.has_header()) change(*chunk.mutable_header());
    };
  };
  Expect(Put(0, header([](v1::PieceHeader& h) { h.set_checksum(h.checksum() + 1); })), Code::DATA_LOSS,
         "another checksum");
  Expect(Put(0, header([](v1::PieceHeader& h) { h.clear_piece(); })), Code::INVALID_ARGUMENT,
         "of a kind that this server does not know");
  Expect(Put(0, header([](v1::PieceHeader& h) { h.set_block(2); })), Code::INVALID_ARGUMENT,
         "the piece of block 2 of 2 blocks");
  Expect(Put(0, header([](v1::PieceHeader& h) { h.mutable_volume()->set_points(~uint64_t{0}); })),
         Code::INVALID_ARGUMENT, "nobody has so many");
  Expect(Put(0, header([](v1::PieceHeader& h) { h.mutable_volume()->set_points(1); })),
         Code::INVALID_ARGUMENT, "has more than that");
  Expect(Put(0, header([](v1::PieceHeader& h) { h.mutable_volume()->set_cells(1 << 20); })),
         Code::INVALID_ARGUMENT, "ended after");
  Expect(Put(0, header([](v1::PieceHeader& h) { h.set_block_count(1); })), Code::INVALID_ARGUMENT,
         "the piece of block 0: cell");
  Expect(Put(0, [](v1::PieceChunk& chunk) { chunk.set_data("x"); }), Code::INVALID_ARGUMENT,
         "begins with its header");
  Expect(Put(0,
             [](v1::PieceChunk& chunk) {
               if (chunk.has_data()) chunk.mutable_header();
             }),
         Code::INVALID_ARGUMENT, "comes its data");
  // A mesh that no map can be made from, by its numbers alone.
  MeshPiece piece = cutter_.Piece(BlockId{0});
  piece.mesh.corners[0] = piece.mesh.corners[1];
  Expect(PutPiece(placed_.blocks(0).address(), piece, placed_.upload(), 0, 2), Code::INVALID_ARGUMENT,
         "has a point twice");
  piece = cutter_.Piece(BlockId{0});
  piece.mesh.kinds[0] = static_cast<CellKind>(7);
  Expect(PutPiece(placed_.blocks(0).address(), piece, placed_.upload(), 0, 2), Code::INVALID_ARGUMENT,
         "a cell of kind 7");
  EXPECT_EQ(PieceBytes(cluster_), 0u);
}

TEST_F(MeshUpload, ABrokenStreamLeavesNothing) {
  const auto await = [&](const std::function<bool(uint64_t)>& enough) {
    const absl::Time deadline = absl::Now() + absl::Seconds(30);
    while (!enough(PieceBytes(cluster_)) && absl::Now() < deadline) std::this_thread::yield();
    return enough(PieceBytes(cluster_));
  };
  auto stub = v1::BlockService::NewStub(service::MakeChannel(placed_.blocks(0).address()));
  grpc::ClientContext context;
  v1::PutPieceResponse response;
  auto writer = stub->PutPiece(&context, &response);
  // Header and some of the data.
  int chunks = 0;
  service::SendPiece(cutter_.Piece(BlockId{0}), placed_.upload(), BlockId{0}, 2,
                     [&](const v1::PieceChunk& chunk) { return ++chunks <= 2 && writer->Write(chunk); });
  EXPECT_TRUE(await([](uint64_t bytes) { return bytes > 0; }));
  context.TryCancel();
  EXPECT_EQ(writer->Finish().error_code(), grpc::StatusCode::CANCELLED);
  EXPECT_TRUE(await([](uint64_t bytes) { return bytes == 0; }));
}

TEST_F(MeshUpload, WaitsOnlySoLongAndIsDropped) {
  ASSERT_TRUE(Put(0).ok());
  server::PieceStore& pieces = cluster_.server(0).host().pieces();
  const uint64_t bytes = PieceBytes(cluster_);
  EXPECT_GT(bytes, 0u);
  // Again: the piece is replaced.
  ASSERT_TRUE(Put(0).ok());
  EXPECT_EQ(PieceBytes(cluster_), bytes);
  for (size_t i = 0; i < cluster_.size(); ++i) {
    cluster_.server(i).host().pieces().DropOld(absl::Now() + absl::Minutes(9));
  }
  EXPECT_EQ(PieceBytes(cluster_), bytes);
  for (size_t i = 0; i < cluster_.size(); ++i) {
    cluster_.server(i).host().pieces().DropOld(absl::Now() + absl::Minutes(11));
  }
  EXPECT_EQ(PieceBytes(cluster_), 0u);
  ASSERT_TRUE(Put(0).ok());
  ASSERT_TRUE(Put(1).ok());
  for (const v1::BlockPlacement& block : placed_.blocks()) {
    auto stub = v1::BlockService::NewStub(service::MakeChannel(block.address()));
    grpc::ClientContext context;
    v1::DropPiecesRequest request;
    request.set_upload(placed_.upload());
    v1::DropPiecesResponse response;
    EXPECT_TRUE(stub->DropPieces(&context, request, &response).ok());
  }
  EXPECT_EQ(PieceBytes(cluster_), 0u);
  EXPECT_EQ(pieces.bytes(), 0u);
}

TEST_F(MeshUpload, AMapNeedsAllItsPieces) {
  ASSERT_TRUE(Put(0).ok());
  const v1::Job job = cluster_.Create(Request());
  EXPECT_EQ(job.state(), v1::JOB_STATE_FAILED);
  EXPECT_THAT(job.error(),
              HasSubstr("the piece of the mesh for block 1 is not here (any more): send the pieces again"));
  EXPECT_TRUE(Delete(cluster_, "m").ok());
  ASSERT_TRUE(Put(0).ok());
  ASSERT_TRUE(Put(1).ok());
  EXPECT_EQ(cluster_.Create(Request()).state(), v1::JOB_STATE_DONE);
  EXPECT_EQ(Look(cluster_, "m").counts.at("hexahedra"), static_cast<int64_t>(SummaryOf(mesh_).hexahedra()));
  // Pieces in maps count, and go with them.
  EXPECT_GT(PieceBytes(cluster_), 0u);
  EXPECT_TRUE(Delete(cluster_, "m").ok());
  EXPECT_EQ(PieceBytes(cluster_), 0u);
}

TEST_F(MeshUpload, RefusesRequestsThatDoNotFit) {
  using Code = grpc::StatusCode;
  ASSERT_TRUE(Put(0).ok());
  ASSERT_TRUE(Put(1).ok());
  v1::CreateMapRequest request = Request();
  request.mutable_grid()->add_cells(1);
  Expect(TryCreate(request), Code::INVALID_ARGUMENT, "from a grid or from a mesh, not from both");
  request = Request();
  request.mutable_mesh()->mutable_blocks()->RemoveLast();
  Expect(TryCreate(request), Code::INVALID_ARGUMENT, "places of 1 blocks for a map of 2");
  request = Request();
  request.mutable_mesh()->mutable_blocks(1)->set_block(0);
  Expect(TryCreate(request), Code::INVALID_ARGUMENT,
         "the place of block 0 where that of block 1 was expected");
  request = Request();
  request.mutable_mesh()->mutable_blocks(1)->set_incarnation(7);
  Expect(TryCreate(request), Code::UNAVAILABLE, "is gone or was restarted: send the mesh again");
  request = Request();
  request.mutable_mesh()->mutable_mesh()->Clear();
  Expect(TryCreate(request), Code::INVALID_ARGUMENT, "a mesh of 0 cells");
  request.mutable_mesh()->mutable_mesh()->set_prisms(1);
  Expect(TryCreate(request), Code::INVALID_ARGUMENT, "2 blocks of a mesh of 1 cells");
  request.mutable_mesh()->mutable_mesh()->set_prisms(~uint64_t{0});
  Expect(TryCreate(request), Code::INVALID_ARGUMENT, "cells can be numbered");
  request = Request();
  request.mutable_mesh()->mutable_mesh()->set_name(std::string(257, 'x'));
  Expect(TryCreate(request), Code::INVALID_ARGUMENT, "at most 256 bytes");
  // Fewer cells than the pieces have.
  request = Request();
  request.mutable_mesh()->mutable_mesh()->Clear();
  request.mutable_mesh()->mutable_mesh()->set_prisms(2);
  const v1::Job job = cluster_.Create(request);
  EXPECT_EQ(job.state(), v1::JOB_STATE_FAILED);
  EXPECT_THAT(job.error(), HasSubstr("the map of one of 2 blocks and 2 cells"));
  grpc::ClientContext context;
  v1::PlaceBlocksRequest place;
  v1::PlaceBlocksResponse response;
  Expect(cluster_.stub().PlaceBlocks(&context, place, &response), Code::INVALID_ARGUMENT,
         "a map of 0 blocks");
}

TEST(MeshLimits, PiecesHaveALimit) {
  const VolumeMesh mesh = reference::MakeMeshCase(1).mesh;
  server::HostOptions host;
  host.max_piece_bytes = 100;
  Cluster cluster(1, {}, host);
  const v1::PlaceBlocksResponse placed = PlaceBlocks(cluster, 1);
  const std::vector<uint32_t> block_of(mesh.cells(), 0);
  const grpc::Status status = PutPiece(
      placed.blocks(0).address(), MeshCutter(mesh, block_of, 1).Piece(BlockId{0}), placed.upload(), 0, 1);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED) << status.error_message();
  EXPECT_THAT(status.error_message(), HasSubstr("--max-piece-bytes"));
  EXPECT_EQ(PieceBytes(cluster), 0u);
}

}  // namespace
}  // namespace ndmap

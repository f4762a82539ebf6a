// SPDX-License-Identifier: Apache-2.0
// Meshes on their way up: a piece for each block, straight to the block's server.
#include <set>

#define XXH_INLINE_ALL
#include <xxhash.h>

#include "client/sdk/client.h"
#include "client/sdk/connection.h"
#include "client/sdk/upload_columns.h"

namespace ndmap {
namespace {

// One piece to its server. It is put there again when the server does not answer.
absl::Status PutPiece(internal::Connection& connection, const std::string& address, v1::PieceHeader header,
                      const PieceView& piece) {
  absl::StatusOr<std::shared_ptr<v1::BlockService::Stub>> stub = connection.BlockServer(address);
  if (!stub.ok()) return stub.status();
  const absl::string_view columns[] = {internal::BytesOf(piece.points), internal::BytesOf(piece.kinds),
                                       internal::BytesOf(piece.corners), internal::BytesOf(piece.numbers),
                                       internal::BytesOf(piece.blocks)};
  XXH3_state_t state;
  XXH3_INITSTATE(&state);
  XXH3_64bits_reset(&state);
  for (absl::string_view column : columns) {
    if (!column.empty()) XXH3_64bits_update(&state, column.data(), column.size());
  }
  header.set_checksum(XXH3_64bits_digest(&state));
  header.mutable_volume()->set_points(piece.points.size());
  header.mutable_volume()->set_cells(piece.kinds.size());
  header.mutable_volume()->set_corners(piece.corners.size());
  return internal::Retry(connection.options(), [&] {
    grpc::ClientContext context;
    internal::SetDeadline(context, connection.options().transfer_timeout);
    v1::PutPieceResponse response;
    auto stream = (*stub)->PutPiece(&context, &response);
    v1::PieceChunk begin;
    *begin.mutable_header() = header;
    if (stream->Write(begin)) internal::WriteColumns<v1::PieceChunk>(columns, *stream, [](size_t) {});
    stream->WritesDone();
    return internal::FromGrpc(stream->Finish(), internal::ServerName(address));
  });
}

// What came of an upload that failed is of no use to anybody. A server that does not answer forgets it by and
// by.
void DropPieces(internal::Connection& connection, const v1::PlacedMesh& mesh) {
  std::set<std::string> addresses;
  for (const v1::BlockPlacement& block : mesh.blocks()) addresses.insert(block.address());
  v1::DropPiecesRequest request;
  request.set_upload(mesh.upload());
  for (const std::string& address : addresses) {
    const auto stub = connection.BlockServer(address);
    if (!stub.ok()) continue;
    v1::DropPiecesResponse response;
    internal::CallOnce(**stub, &v1::BlockService::Stub::DropPieces, request, &response,
                       connection.options().connect_timeout, internal::ServerName(address))
        .IgnoreError();
  }
}

}  // namespace

absl::StatusOr<JobHandle> Client::CreateMapFromMesh(
    v1::CreateMapRequest request, absl::FunctionRef<absl::StatusOr<PieceView>(uint32_t block)> piece,
    const std::function<void(uint32_t, uint32_t)>& progress) const {
  v1::PlaceBlocksRequest place;
  place.set_block_count(request.block_count());
  v1::PlaceBlocksResponse placed;
  absl::Status status =
      internal::CallIdempotent(connection_->coordinator(), &v1::Coordinator::Stub::PlaceBlocks, place,
                               &placed, connection_->options(), connection_->coordinator_name());
  if (!status.ok()) return status;
  v1::PlacedMesh& mesh = *request.mutable_mesh();
  mesh.set_upload(placed.upload());
  *mesh.mutable_blocks() = placed.blocks();
  const auto upload = [&]() -> absl::Status {
    for (uint32_t b = 0; b < request.block_count(); ++b) {
      absl::StatusOr<PieceView> view = piece(b);
      if (!view.ok()) return view.status();
      v1::PieceHeader header;
      header.set_upload(mesh.upload());
      header.set_block(b);
      header.set_block_count(request.block_count());
      const std::string& address = mesh.blocks(static_cast<int>(b)).address();
      if (absl::Status s = PutPiece(*connection_, address, std::move(header), *view); !s.ok()) return s;
      if (progress) progress(b + 1, request.block_count());
    }
    return absl::OkStatus();
  };
  if (static_cast<uint32_t>(mesh.blocks_size()) != request.block_count()) {
    return absl::InternalError("the coordinator placed another number of blocks than it was asked for");
  }
  status = upload();
  absl::StatusOr<JobHandle> job = status.ok() ? CreateMap(request) : absl::StatusOr<JobHandle>(status);
  if (!job.ok()) DropPieces(*connection_, mesh);
  return job;
}

}  // namespace ndmap

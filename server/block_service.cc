// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/block_service.h"

#include <memory>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"

#include "core/names/mesh_cells.h"
#include "service/guarded.h"
#include "service/mesh.h"
#include "service/process_stats.h"
#include "service/status.h"
#include "service/surface_transfer.h"
#include "service/version.h"

namespace ndmap::server {

using service::ToGrpc;

namespace {

constexpr char kProgram[] = "ndmap-server";

}  // namespace

grpc::Status BlockServiceImpl::GetVersion(grpc::ServerContext*, const v1::GetVersionRequest* request,
                                          v1::GetVersionResponse* response) {
  *response->mutable_version() = service::MakeVersion(kProgram);
  if (!request->has_caller()) return grpc::Status::OK;
  return ToGrpc(service::CheckVersion(response->version(), request->caller()));
}

grpc::Status BlockServiceImpl::GetProcessStats(grpc::ServerContext*, const v1::GetProcessStatsRequest*,
                                               v1::GetProcessStatsResponse* response) {
  *response->mutable_stats() = service::ReadProcessStats(kProgram, host_->address());
  return grpc::Status::OK;
}

grpc::Status BlockServiceImpl::Walk(grpc::ServerContext* context, const v1::WalkRequest* request,
                                    v1::WalkResponse* response) {
  return ClientQuery(gate_, context).Run(*response, [&](const ClientQuery::Gone& gone) {
    return walks_.Walk(*request, gone, *response);
  });
}

grpc::Status BlockServiceImpl::Beta(grpc::ServerContext* context, const v1::BetaRequest* request,
                                    v1::BetaResponse* response) {
  // What servers ask each other.
  if (request->stay() && !request->trace()) {
    return ToGrpc(walker_.Beta(
        *request, [context] { return context->IsCancelled(); }, *response));
  }
  return ClientQuery(gate_, context).Run(*response, [&](const ClientQuery::Gone& gone) {
    return walker_.Beta(*request, gone, *response);
  });
}

grpc::Status BlockServiceImpl::Explore(grpc::ServerContext* context, const v1::ExploreRequest* request,
                                       grpc::ServerWriter<v1::ExploreResponse>* writer) {
  ClientQuery query(gate_, context);
  return query.Run(
      [&](const ClientQuery::Gone& gone) { return explorer_.Explore(*request, gone, query.Into(writer)); });
}

grpc::Status BlockServiceImpl::FetchCells(grpc::ServerContext* context, const v1::FetchCellsRequest* request,
                                          grpc::ServerWriter<v1::FetchCellsResponse>* writer) {
  ClientQuery query(gate_, context);
  return query.Run([&](const ClientQuery::Gone& gone) {
    return explorer_.FetchCells(*request, gone, query.Into(writer));
  });
}

grpc::Status BlockServiceImpl::AskBlock(grpc::ServerContext* context, const v1::AskBlockRequest* request,
                                        v1::AskBlockResponse* response) {
  return ToGrpc(explorer_.answers().Answer(
      *request, [context] { return context->IsCancelled(); }, *response));
}

grpc::Status BlockServiceImpl::ReadAttributes(grpc::ServerContext* context,
                                              const v1::ReadAttributesRequest* request,
                                              grpc::ServerWriter<v1::ReadAttributesResponse>* writer) {
  const bool all = request->select().has_all();
  ClientQuery query(gate_, context, all ? ClientQuery::Kind::kValues : ClientQuery::Kind::kQuestion);
  return query.Run([&](const ClientQuery::Gone& gone) {
    return attribute_reads_.Read(*request, Caller(context, gone, query.end()), query.Into(writer));
  });
}

grpc::Status BlockServiceImpl::WriteAttribute(grpc::ServerContext* context,
                                              grpc::ServerReader<v1::WriteAttributeRequest>* reader,
                                              v1::WriteAttributeResponse* response) {
  ClientQuery query(gate_, context, ClientQuery::Kind::kValues);
  return query.Run([&](const ClientQuery::Gone& gone) {
    return attribute_writes_.Write(query.From(reader), Caller(context, gone, query.end()), *response);
  });
}

grpc::Status BlockServiceImpl::Aggregate(grpc::ServerContext* context, const v1::AggregateRequest* request,
                                         v1::AggregateResponse* response) {
  ClientQuery query(gate_, context);
  return query.Run(*response, [&](const ClientQuery::Gone& gone) {
    return attribute_aggregates_.Aggregate(*request, Caller(context, gone, query.end()), *response);
  });
}

grpc::Status BlockServiceImpl::ReadBlocks(grpc::ServerContext* context, const v1::ReadBlocksRequest* request,
                                          grpc::ServerWriter<v1::ReadBlocksResponse>* writer) {
  return ToGrpc(attribute_rows_.Read(
      *request, [context] { return context->IsCancelled(); },
      [writer](v1::ReadBlocksResponse& part) { return writer->Write(part); }));
}

grpc::Status BlockServiceImpl::ApplyAttribute(grpc::ServerContext*, const v1::ApplyAttributeRequest* request,
                                              v1::ApplyAttributeResponse* response) {
  return ToGrpc(attribute_rows_.Apply(*request, *response));
}

grpc::Status BlockServiceImpl::AggregateBlocks(grpc::ServerContext* context,
                                               const v1::AggregateBlocksRequest* request,
                                               grpc::ServerWriter<v1::AggregateBlocksResponse>* writer) {
  return ToGrpc(attribute_aggregates_.AggregateBlocks(
      *request, Caller(context),
      [writer](const v1::AggregateBlocksResponse& part) { return writer->Write(part); }));
}

grpc::Status BlockServiceImpl::GetBlockStats(grpc::ServerContext* context,
                                             const v1::GetBlockStatsRequest* request,
                                             v1::GetBlockStatsResponse* response) {
  return ClientQuery(gate_, context).Run(*response, [&](const ClientQuery::Gone& gone) {
    return BlockStats(*request, gone, *response);
  });
}

absl::Status BlockServiceImpl::BlockStats(const v1::GetBlockStatsRequest& request,
                                          const ClientQuery::Gone& gone,
                                          v1::GetBlockStatsResponse& response) {
  std::vector<uint32_t> blocks(request.blocks().begin(), request.blocks().end());
  if (blocks.empty()) {
    absl::StatusOr<BlockHost::MapInfo> info = host_->Info(request.map());
    if (!info.ok()) return info.status();
    blocks = info->blocks;
  }
  for (uint32_t b : blocks) {
    if (gone()) return absl::CancelledError("the caller has gone");
    v1::BlockStats* stats = response.add_blocks();
    absl::Status status = host_->Query(
        request.map(), b,
        [&](Block3& block, AttributeStore& attributes) {
          stats->set_block(b);
          stats->set_darts(block.map().number_of_darts());
          stats->set_vertices(block.map().number_of_attributes<0>());
          stats->set_hexahedra(block.map().number_of_attributes<3>());
          stats->set_critical_darts(block.critical_count());
          stats->set_accounted_bytes(block.AccountedBytes());
          stats->set_version(block.version());
          stats->set_attribute_bytes(attributes.bytes());
          return absl::OkStatus();
        },
        BlockActor::Needs::kAny);
    if (!status.ok()) return status;
  }
  return absl::OkStatus();
}

grpc::Status BlockServiceImpl::ExportPiece(grpc::ServerContext* context,
                                           const v1::ExportPieceRequest* request,
                                           grpc::ServerWriter<v1::ExportPieceResponse>* writer) {
  ClientQuery query(gate_, context, ClientQuery::Kind::kExport);
  return query.Run([&](const ClientQuery::Gone& gone) {
    return server::ExportPiece(*host_, options_.piece_source, options_.data_folder, *request, gone,
                               query.Into(writer));
  });
}

grpc::Status BlockServiceImpl::PutSurface(grpc::ServerContext*, grpc::ServerReader<v1::SurfaceChunk>* reader,
                                          v1::PutSurfaceResponse* response) {
  service::SurfaceReceiver receiver(options_.max_surface_bytes);
  v1::SurfaceChunk chunk;
  while (reader->Read(&chunk)) {
    if (absl::Status status = receiver.Add(chunk); !status.ok()) return ToGrpc(status);
  }
  if (absl::Status status = receiver.Finish(); !status.ok()) return ToGrpc(status);
  response->set_surface_id(receiver.id());
  return ToGrpc(host_->PutSurface(receiver.id(), receiver.Take(), options_.max_surface_bytes));
}

grpc::Status BlockServiceImpl::PutPiece(grpc::ServerContext*, grpc::ServerReader<v1::PieceChunk>* reader,
                                        v1::PutPieceResponse*) {
  return ToGrpc(service::Guarded([&]() -> absl::Status {
    PieceStore& pieces = host_->pieces();
    const auto room = std::make_shared<PieceStore::Room>(pieces);
    service::PieceReceiver receiver([&room](uint64_t bytes) { return room->Take(bytes); });
    v1::PieceChunk chunk;
    while (reader->Read(&chunk)) {
      if (absl::Status status = receiver.Add(chunk); !status.ok()) return status;
      pieces.Touch(receiver.header().upload(), absl::Now());
    }
    if (absl::Status status = receiver.Finish(); !status.ok()) return status;
    const v1::PieceHeader& header = receiver.header();
    auto cells = MeshCells::Make(receiver.Take(), BlockId{header.block()}, header.block_count());
    if (!cells.ok()) {
      return absl::Status(cells.status().code(), absl::StrCat("the piece of block ", header.block(), ": ",
                                                              cells.status().message()));
    }
    pieces.Put(header.upload(), header.block_count(), *std::move(cells), room, absl::Now());
    return absl::OkStatus();
  }));
}

grpc::Status BlockServiceImpl::DropPieces(grpc::ServerContext*, const v1::DropPiecesRequest* request,
                                          v1::DropPiecesResponse*) {
  host_->pieces().Drop(request->upload());
  return grpc::Status::OK;
}

grpc::Status BlockServiceImpl::CreateBlocks(grpc::ServerContext*, const v1::CreateBlocksRequest* request,
                                            v1::CreateBlocksResponse*) {
  return ToGrpc(host_->CreateBlocks(*request));
}

grpc::Status BlockServiceImpl::DropMap(grpc::ServerContext*, const v1::DropMapRequest* request,
                                       v1::DropMapResponse*) {
  return ToGrpc(host_->DropMap(request->map(), request->map_number()));
}

grpc::Status BlockServiceImpl::StartPhase(grpc::ServerContext*, const v1::StartPhaseRequest* request,
                                          v1::StartPhaseResponse* response) {
  *response->mutable_process() = service::ReadProcessStats(kProgram, host_->address());
  return ToGrpc(host_->StartPhase(*request));
}

grpc::Status BlockServiceImpl::RunPhase(grpc::ServerContext*, const v1::RunPhaseRequest* request,
                                        v1::RunPhaseResponse*) {
  return ToGrpc(host_->RunPhase(request->key()));
}

grpc::Status BlockServiceImpl::PollPhase(grpc::ServerContext*, const v1::PollPhaseRequest* request,
                                         v1::PollPhaseResponse* response) {
  return ToGrpc(host_->PollPhase(*request, *response));
}

grpc::Status BlockServiceImpl::FinishPhase(grpc::ServerContext*, const v1::FinishPhaseRequest* request,
                                           v1::FinishPhaseResponse* response) {
  const absl::Status status = host_->FinishPhase(request->key(), *response);
  *response->mutable_process() = service::ReadProcessStats(kProgram, host_->address());
  return ToGrpc(status);
}

grpc::Status BlockServiceImpl::CancelPhase(grpc::ServerContext*, const v1::CancelPhaseRequest* request,
                                           v1::CancelPhaseResponse*) {
  return ToGrpc(host_->CancelPhase(request->key(), request->abandon()));
}

}  // namespace ndmap::server

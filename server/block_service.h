// SPDX-License-Identifier: GPL-3.0-or-later
// The gRPC face of a block server. Every call but Exchange has a thread of gRPC's, and may wait; Exchange is
// callbacks, which only move batches.
#pragma once

#include <string>

#include "ndmap/v1/block_service.grpc.pb.h"
#include "server/attribute_aggregates.h"
#include "server/attribute_reads.h"
#include "server/attribute_rows.h"
#include "server/attribute_writes.h"
#include "server/block_host.h"
#include "server/client_query.h"
#include "server/exchange.h"
#include "server/explorer.h"
#include "server/export.h"
#include "server/piece.h"
#include "server/walker.h"
#include "server/walks.h"

namespace ndmap::server {

struct ServiceOptions {
  // Empty: none.
  std::string data_folder;
  uint64_t max_surface_bytes = uint64_t{4} << 30;
  // Of one question of a client.
  uint64_t max_query_darts = kDefaultQueryDarts;
  QueryLimits query_limits;
  PieceSource piece_source = MakeVtuPiece;
};

class BlockServiceImpl final
    : public v1::BlockService::WithCallbackMethod_Exchange<v1::BlockService::Service> {
 public:
  BlockServiceImpl(BlockHost* host, ServiceOptions options)
      : host_(host),
        options_(std::move(options)),
        gate_(options_.query_limits),
        walker_(host, &peers_),
        explorer_(host, &peers_, options_.max_query_darts),
        walks_(host, &explorer_.answers(), &peers_, options_.max_query_darts),
        attribute_rows_(host, &explorer_.answers()),
        attribute_reads_(host, &peers_, &explorer_, &attribute_rows_),
        attribute_writes_(host, &peers_, &explorer_, &attribute_rows_),
        attribute_aggregates_(host, &peers_, &attribute_rows_),
        exchange_(host) {}

  // Ends what would keep a stopping server waiting.
  void Stop() { exchange_.Finish(); }

  grpc::Status GetVersion(grpc::ServerContext*, const v1::GetVersionRequest*,
                          v1::GetVersionResponse*) override;
  grpc::Status GetProcessStats(grpc::ServerContext*, const v1::GetProcessStatsRequest*,
                               v1::GetProcessStatsResponse*) override;
  grpc::Status Walk(grpc::ServerContext*, const v1::WalkRequest*, v1::WalkResponse*) override;
  grpc::Status Beta(grpc::ServerContext*, const v1::BetaRequest*, v1::BetaResponse*) override;
  grpc::Status Explore(grpc::ServerContext*, const v1::ExploreRequest*,
                       grpc::ServerWriter<v1::ExploreResponse>*) override;
  grpc::Status FetchCells(grpc::ServerContext*, const v1::FetchCellsRequest*,
                          grpc::ServerWriter<v1::FetchCellsResponse>*) override;
  grpc::Status AskBlock(grpc::ServerContext*, const v1::AskBlockRequest*, v1::AskBlockResponse*) override;
  grpc::Status ReadAttributes(grpc::ServerContext*, const v1::ReadAttributesRequest*,
                              grpc::ServerWriter<v1::ReadAttributesResponse>*) override;
  grpc::Status WriteAttribute(grpc::ServerContext*, grpc::ServerReader<v1::WriteAttributeRequest>*,
                              v1::WriteAttributeResponse*) override;
  grpc::Status Aggregate(grpc::ServerContext*, const v1::AggregateRequest*, v1::AggregateResponse*) override;
  grpc::Status ReadBlocks(grpc::ServerContext*, const v1::ReadBlocksRequest*,
                          grpc::ServerWriter<v1::ReadBlocksResponse>*) override;
  grpc::Status ApplyAttribute(grpc::ServerContext*, const v1::ApplyAttributeRequest*,
                              v1::ApplyAttributeResponse*) override;
  grpc::Status AggregateBlocks(grpc::ServerContext*, const v1::AggregateBlocksRequest*,
                               grpc::ServerWriter<v1::AggregateBlocksResponse>*) override;
  grpc::Status GetBlockStats(grpc::ServerContext*, const v1::GetBlockStatsRequest*,
                             v1::GetBlockStatsResponse*) override;
  grpc::Status ExportPiece(grpc::ServerContext*, const v1::ExportPieceRequest*,
                           grpc::ServerWriter<v1::ExportPieceResponse>*) override;
  grpc::Status PutSurface(grpc::ServerContext*, grpc::ServerReader<v1::SurfaceChunk>*,
                          v1::PutSurfaceResponse*) override;
  grpc::Status PutPiece(grpc::ServerContext*, grpc::ServerReader<v1::PieceChunk>*,
                        v1::PutPieceResponse*) override;
  grpc::Status DropPieces(grpc::ServerContext*, const v1::DropPiecesRequest*,
                          v1::DropPiecesResponse*) override;
  grpc::Status CreateBlocks(grpc::ServerContext*, const v1::CreateBlocksRequest*,
                            v1::CreateBlocksResponse*) override;
  grpc::Status DropMap(grpc::ServerContext*, const v1::DropMapRequest*, v1::DropMapResponse*) override;
  grpc::Status StartPhase(grpc::ServerContext*, const v1::StartPhaseRequest*,
                          v1::StartPhaseResponse*) override;
  grpc::Status RunPhase(grpc::ServerContext*, const v1::RunPhaseRequest*, v1::RunPhaseResponse*) override;
  grpc::Status PollPhase(grpc::ServerContext*, const v1::PollPhaseRequest*, v1::PollPhaseResponse*) override;
  grpc::Status FinishPhase(grpc::ServerContext*, const v1::FinishPhaseRequest*,
                           v1::FinishPhaseResponse*) override;
  grpc::Status CancelPhase(grpc::ServerContext*, const v1::CancelPhaseRequest*,
                           v1::CancelPhaseResponse*) override;
  ExchangeReactor* Exchange(grpc::CallbackServerContext*) override { return exchange_.Open(); }

 private:
  absl::Status BlockStats(const v1::GetBlockStatsRequest& request, const ClientQuery::Gone& gone,
                          v1::GetBlockStatsResponse& response);

  BlockHost* const host_;
  const ServiceOptions options_;
  QueryGate gate_;
  PeerStubs peers_;
  Walker walker_;
  Explorer explorer_;
  Walks walks_;
  AttributeRows attribute_rows_;
  AttributeReads attribute_reads_;
  AttributeWrites attribute_writes_;
  AttributeAggregates attribute_aggregates_;
  ExchangeStreams exchange_;
};

}  // namespace ndmap::server

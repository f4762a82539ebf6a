// SPDX-License-Identifier: Apache-2.0
#include "client/sdk/map.h"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <map>
#include <set>

#define XXH_INLINE_ALL
#include <xxhash.h>

#include "absl/strings/str_cat.h"
#include "client/sdk/connection.h"

namespace ndmap {

absl::StatusOr<std::string> MapHandle::AddressOf(uint32_t block) const {
  for (const v1::BlockPlacement& placement : info_->blocks()) {
    if (placement.block() == block) return placement.address();
  }
  return absl::NotFoundError(
      absl::StrCat("map '", name(), "' has no block ", block, ", it has ", info_->block_count(), " blocks"));
}

absl::StatusOr<JobHandle> MapHandle::StartJob(const std::string& kind,
                                              const std::vector<v1::Phase>& phases) const {
  v1::StartJobRequest request;
  request.set_map(name());
  request.set_kind(kind);
  for (const v1::Phase& phase : phases) *request.add_phases() = phase;
  v1::StartJobResponse response;
  absl::Status status =
      internal::CallOnce(connection_->coordinator(), &v1::Coordinator::Stub::StartJob, request, &response,
                         connection_->options().call_timeout, connection_->coordinator_name());
  if (!status.ok()) return status;
  return JobHandle(connection_, response.job().job());
}

absl::StatusOr<std::vector<v1::BlockStats>> MapHandle::Stats() const {
  std::set<std::string> addresses;
  for (const v1::BlockPlacement& placement : info_->blocks()) addresses.insert(placement.address());
  std::map<uint32_t, v1::BlockStats> by_block;
  v1::GetBlockStatsRequest request;
  request.set_map(name());
  for (const std::string& address : addresses) {
    auto server = connection_->BlockServer(address);
    if (!server.ok()) return server.status();
    v1::GetBlockStatsResponse response;
    absl::Status status =
        internal::CallIdempotent(**server, &v1::BlockService::Stub::GetBlockStats, request, &response,
                                 connection_->options(), internal::ServerName(address));
    if (!status.ok()) return status;
    for (const v1::BlockStats& stats : response.blocks()) by_block[stats.block()] = stats;
  }
  std::vector<v1::BlockStats> all;
  for (auto& [block, stats] : by_block) all.push_back(std::move(stats));
  return all;
}

absl::StatusOr<std::vector<v1::ProcessStats>> MapHandle::ServerStats() const {
  std::set<std::string> addresses;
  for (const v1::BlockPlacement& placement : info_->blocks()) addresses.insert(placement.address());
  std::vector<v1::ProcessStats> all;
  for (const std::string& address : addresses) {
    auto server = connection_->BlockServer(address);
    if (!server.ok()) return server.status();
    v1::GetProcessStatsResponse response;
    absl::Status status = internal::CallIdempotent(**server, &v1::BlockService::Stub::GetProcessStats,
                                                   v1::GetProcessStatsRequest(), &response,
                                                   connection_->options(), internal::ServerName(address));
    if (!status.ok()) return status;
    all.push_back(std::move(*response.mutable_stats()));
  }
  return all;
}

absl::StatusOr<v1::ExportSummary> MapHandle::ExportPiece(
    uint32_t block, const std::vector<std::pair<std::string, std::string>>& options, ByteSink sink) const {
  absl::StatusOr<std::string> address = AddressOf(block);
  if (!address.ok()) return address.status();
  auto server = connection_->BlockServer(*address);
  if (!server.ok()) return server.status();
  grpc::ClientContext context;
  internal::SetDeadline(context, connection_->options().transfer_timeout);
  v1::ExportPieceRequest request;
  request.set_map(name());
  request.set_block(block);
  for (const auto& [key, value] : options) (*request.mutable_options())[key] = value;
  auto stream = (*server)->ExportPiece(&context, request);

  XXH3_state_t hash;
  XXH3_INITSTATE(&hash);
  XXH3_64bits_reset(&hash);
  uint64_t bytes = 0;
  bool complete = false;
  absl::Status wrong;
  v1::ExportSummary summary;
  v1::ExportPieceResponse response;
  while (wrong.ok() && stream->Read(&response)) {
    if (response.has_summary()) {
      summary = response.summary();
      complete = true;
      continue;
    }
    XXH3_64bits_update(&hash, response.data().data(), response.data().size());
    bytes += response.data().size();
    wrong = sink(response.data());
  }
  if (!wrong.ok()) context.TryCancel();
  absl::Status status = internal::FromGrpc(stream->Finish(), internal::ServerName(*address));
  if (!wrong.ok()) return wrong;
  if (!status.ok()) return status;
  if (!complete || bytes != summary.bytes() || XXH3_64bits_digest(&hash) != summary.checksum()) {
    return absl::DataLossError(absl::StrCat("block ", block, ": the piece that came from ",
                                            internal::ServerName(*address), " (", bytes,
                                            " bytes) is not the one that was sent"));
  }
  return summary;
}

absl::StatusOr<v1::ExportSummary> MapHandle::ExportPieceToFile(
    uint32_t block, const std::vector<std::pair<std::string, std::string>>& options,
    const std::string& path) const {
  const std::string unfinished = path + ".part";
  const auto failed = [&](absl::string_view what) {
    absl::Status status = absl::UnavailableError(absl::StrCat(path, ": ", what, ": ", std::strerror(errno)));
    std::remove(unfinished.c_str());
    return status;
  };
  std::FILE* file = std::fopen(unfinished.c_str(), "wb");
  if (file == nullptr) return failed("cannot be written");
  absl::StatusOr<v1::ExportSummary> summary =
      ExportPiece(block, options, [&](absl::string_view bytes) -> absl::Status {
        if (std::fwrite(bytes.data(), 1, bytes.size(), file) == bytes.size()) return absl::OkStatus();
        return absl::UnavailableError(absl::StrCat(path, ": cannot be written: ", std::strerror(errno)));
      });
  if (std::fclose(file) != 0 && summary.ok()) return failed("cannot be written");
  if (!summary.ok()) {
    std::remove(unfinished.c_str());
    return summary;
  }
  if (std::rename(unfinished.c_str(), path.c_str()) != 0) return failed("cannot be put in place");
  return summary;
}

}  // namespace ndmap

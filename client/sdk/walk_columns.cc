// SPDX-License-Identifier: Apache-2.0
// Many walks at once, in columns.
#include <algorithm>
#include <map>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/sdk/column.h"
#include "client/sdk/connection.h"
#include "client/sdk/map.h"
#include "client/sdk/word.h"

namespace ndmap {
namespace {

using internal::Column;

// What one call may carry: starts (below what servers take unless told otherwise), and starts times letters.
constexpr size_t kStartsACall = 1 << 17;
constexpr size_t kBetasACall = 1 << 24;
constexpr size_t kLettersACall = 65536;
constexpr int kAttempts = 4;

}  // namespace

namespace internal {

absl::Status CheckWord(absl::Span<const uint8_t> word) {
  for (uint8_t letter : word) {
    if (letter > 3) {
      return absl::InvalidArgumentError(
          absl::StrCat("beta ", int{letter}, ": a map of dimension 3 has beta 0 ... 3"));
    }
  }
  return absl::OkStatus();
}

}  // namespace internal

absl::Status MapHandle::WalkRows(const std::string& address, absl::Span<const uint32_t> rows,
                                 const DartColumns& starts, absl::Span<const uint8_t> word,
                                 WalkedColumns& walked) const {
  std::vector<uint32_t> column(rows.size());
  v1::WalkRequest request;
  request.set_map(name());
  request.set_word(word.data(), word.size());
  std::transform(rows.begin(), rows.end(), column.begin(), [&](uint32_t row) { return starts.blocks[row]; });
  internal::AssignColumn(column, request.mutable_blocks());
  std::transform(rows.begin(), rows.end(), column.begin(), [&](uint32_t row) { return starts.darts[row]; });
  internal::AssignColumn(column, request.mutable_darts());
  // Those that earlier calls met as well: all of it is of one version.
  for (const auto& [block, version] : walked.at.versions) {
    request.add_version_blocks(block);
    request.add_versions(version);
  }
  auto server = connection_->BlockServer(address);
  if (!server.ok()) return server.status();
  v1::WalkResponse response;
  absl::Status status = internal::CallIdempotent(**server, &v1::BlockService::Stub::Walk, request, &response,
                                                 connection_->options(), internal::ServerName(address));
  if (!status.ok()) return status;
  const Column blocks(response.blocks()), darts(response.darts()), used(response.used());
  if (blocks.size() != rows.size() || darts.size() != rows.size() || used.size() != rows.size() ||
      response.versions_size() != response.version_blocks_size()) {
    return absl::InternalError(absl::StrCat(internal::ServerName(address), " gave ", darts.size(),
                                            " results for ", rows.size(), " darts"));
  }
  for (size_t i = 0; i < rows.size(); ++i) {
    walked.at.blocks[rows[i]] = blocks[i];
    walked.at.darts[rows[i]] = darts[i];
    walked.used[rows[i]] = used[i];
  }
  for (int i = 0; i < response.versions_size(); ++i) {
    walked.at.versions[response.version_blocks(i)] = response.versions(i);
  }
  return absl::OkStatus();
}

absl::Status MapHandle::WalkOnce(const std::map<std::string, std::vector<uint32_t>>& by_server,
                                 const DartColumns& starts, absl::Span<const uint8_t> word,
                                 WalkedColumns& walked) const {
  walked.at.versions.clear();
  for (const auto& [block, version] : starts.versions) {
    if (version != 0) walked.at.versions[block] = version;
  }
  const size_t a_call = std::min(kStartsACall, kBetasACall / std::max<size_t>(1, word.size()));
  for (const auto& [address, rows] : by_server) {
    for (size_t first = 0; first < rows.size(); first += a_call) {
      absl::Status status =
          WalkRows(address, absl::MakeConstSpan(rows).subspan(first, a_call), starts, word, walked);
      if (!status.ok()) return status;
    }
  }
  return absl::OkStatus();
}

absl::StatusOr<WalkedColumns> MapHandle::Walk(const DartColumns& starts,
                                              absl::Span<const uint8_t> word) const {
  if (absl::Status status = internal::CheckWord(word); !status.ok()) return status;
  if (starts.blocks.size() != starts.darts.size() || word.size() > kLettersACall) {
    return absl::InvalidArgumentError(absl::StrCat(
        starts.blocks.size(), " blocks and ", starts.darts.size(), " darts with a word of ", word.size(),
        " letters; as many blocks as darts are expected, and at most ", kLettersACall, " letters"));
  }
  std::map<std::string, std::vector<uint32_t>> by_server;
  std::map<uint32_t, std::vector<uint32_t>*> by_block;
  for (size_t row = 0; row < starts.size(); ++row) {
    std::vector<uint32_t>*& rows = by_block[starts.blocks[row]];
    if (rows == nullptr) {
      absl::StatusOr<std::string> address = AddressOf(starts.blocks[row]);
      if (!address.ok()) return address.status();
      rows = &by_server[*address];
    }
    rows->push_back(static_cast<uint32_t>(row));
  }
  WalkedColumns walked;
  walked.at.blocks.resize(starts.size());
  walked.at.darts.resize(starts.size());
  walked.used.resize(starts.size());
  absl::Status status;
  for (int k = 0; k < kAttempts; ++k) {
    status = WalkOnce(by_server, starts, word, walked);
    if (status.ok()) return walked;
    // A version that the caller did not name is one that an earlier call of this attempt met.
    if (!absl::IsFailedPrecondition(status) || !starts.versions.empty()) return status;
  }
  return absl::AbortedError(status.message());
}

}  // namespace ndmap

// SPDX-License-Identifier: Apache-2.0
// Proposition 1 from outside: walks that go on in the block, and on the server, that a crossing leads to.
#include <map>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/sdk/connection.h"
#include "client/sdk/map.h"
#include "client/sdk/word.h"

namespace ndmap {
namespace {

// What one call may carry.
constexpr size_t kMaxStarts = 65536;
constexpr size_t kMaxLetters = 65536;

}  // namespace

// One walk under way: where it goes on, and with which letter.
struct MapHandle::Walker {
  uint32_t block = 0;
  v1::BetaStart start;
  size_t next_letter = 0;
  bool done = false;
  Walked result;
};

absl::StatusOr<v1::BetaResponse> MapHandle::BetaInBlock(const v1::BetaRequest& request) const {
  absl::StatusOr<std::string> address = AddressOf(request.block());
  if (!address.ok()) return address.status();
  auto server = connection_->BlockServer(*address);
  if (!server.ok()) return server.status();
  v1::BetaResponse response;
  absl::Status status = internal::CallIdempotent(**server, &v1::BlockService::Stub::Beta, request, &response,
                                                 connection_->options(), internal::ServerName(*address));
  if (!status.ok()) return status;
  if (response.results_size() != request.starts_size()) {
    return absl::InternalError(absl::StrCat(internal::ServerName(*address), " gave ", response.results_size(),
                                            " results for ", request.starts_size(), " darts"));
  }
  return response;
}

absl::StatusOr<v1::DartInfo> MapHandle::AnyDart(uint32_t block) const {
  v1::BetaRequest request;
  request.set_map(name());
  request.set_block(block);
  request.set_stay(true);
  request.add_starts()->set_any_dart(true);
  absl::StatusOr<v1::BetaResponse> response = BetaInBlock(request);
  if (!response.ok()) return response.status();
  return response->results(0).at();
}

absl::StatusOr<bool> MapHandle::HasLabel(uint32_t block, const v1::Label& label) const {
  v1::BetaRequest request;
  request.set_map(name());
  request.set_block(block);
  request.set_stay(true);
  *request.add_starts()->mutable_label() = label;
  absl::StatusOr<v1::BetaResponse> response = BetaInBlock(request);
  if (!response.ok()) return response.status();
  return response->results(0).end() == v1::WALK_END_ARRIVED;
}

absl::Status MapHandle::Cross(Walker& walker, const v1::BetaResult& at) const {
  uint32_t peer = at.peer();
  if (!at.has_peer()) {
    // Broadcast routing: no dart knows where its partner is, so every other block is asked.
    bool found = false;
    for (uint32_t block = 0; !found && block < info_->block_count(); ++block) {
      if (block == walker.block) continue;
      absl::StatusOr<bool> has = HasLabel(block, at.label());
      if (!has.ok()) return has.status();
      if (*has) {
        peer = block;
        found = true;
      }
    }
    if (!found) {
      return absl::AbortedError(absl::StrCat("map '", name(), "': no block but ", walker.block, " has label ",
                                             absl::Hex(at.label().root()), ":", absl::Hex(at.label().path()),
                                             " at the moment"));
    }
  }
  absl::StatusOr<std::string> from = AddressOf(walker.block);
  absl::StatusOr<std::string> to = AddressOf(peer);
  if (!from.ok()) return from.status();
  if (!to.ok()) return to.status();
  ++walker.result.block_crossings;
  if (*from != *to) ++walker.result.server_crossings;
  walker.block = peer;
  *walker.start.mutable_label() = at.label();
  // The crossing is the letter.
  ++walker.next_letter;
  return absl::OkStatus();
}

absl::Status MapHandle::Go(absl::Span<Walker* const> walkers, absl::Span<const uint8_t> word) const {
  const uint32_t block = walkers[0]->block;
  const absl::Span<const uint8_t> rest = word.subspan(walkers[0]->next_letter, kMaxLetters);
  v1::BetaRequest request;
  request.set_map(name());
  request.set_block(block);
  request.set_stay(true);
  request.set_word(rest.data(), rest.size());
  for (const Walker* walker : walkers) *request.add_starts() = walker->start;
  absl::StatusOr<v1::BetaResponse> response = BetaInBlock(request);
  if (!response.ok()) return response.status();
  for (size_t i = 0; i < walkers.size(); ++i) {
    Walker& walker = *walkers[i];
    const v1::BetaResult& result = response->results(static_cast<int>(i));
    walker.next_letter += result.used();
    walker.result.at = result.at();
    walker.result.used = static_cast<uint32_t>(walker.next_letter);
    absl::Status status;
    switch (result.end()) {
      case v1::WALK_END_CROSSING:
        status = Cross(walker, result);
        break;
      case v1::WALK_END_FREE:
        walker.result.free = walker.done = true;
        break;
      case v1::WALK_END_ARRIVED:
        walker.done = walker.next_letter == word.size();
        *walker.start.mutable_dart() = result.at().dart();
        break;
      default:
        status = absl::InternalError(
            absl::StrCat("map '", name(), "': block ", block, " does not have the label that leads to it"));
    }
    if (!status.ok()) return status;
  }
  return absl::OkStatus();
}

absl::StatusOr<Traced> MapHandle::Trace(uint32_t block, const v1::BetaStart& start,
                                        absl::Span<const uint8_t> word) const {
  if (absl::Status status = internal::CheckWord(word); !status.ok()) return status;
  Walker walker;
  walker.block = block;
  walker.start = start;
  Traced traced;
  bool begun = false, crossed_server = false;
  while (true) {
    const absl::Span<const uint8_t> rest = word.subspan(walker.next_letter);
    v1::BetaRequest request;
    request.set_map(name());
    request.set_block(walker.block);
    request.set_stay(true);
    request.set_trace(true);
    request.set_word(rest.data(), rest.size());
    *request.add_starts() = walker.start;
    absl::StatusOr<v1::BetaResponse> response = BetaInBlock(request);
    if (!response.ok()) return response.status();
    const v1::BetaResult& result = response->results(0);
    if (result.end() == v1::WALK_END_NO_LABEL) {
      return absl::AbortedError(absl::StrCat("map '", name(), "': block ", walker.block,
                                             " does not have the label that leads to it at the moment"));
    }
    for (int i = 0; i < result.passed_size(); ++i) {
      // The first dart of a block is where the walk began, or what the crossing's letter led to.
      if (i > 0 || begun) traced.steps.push_back({result.passed(i), i == 0, i == 0 && crossed_server});
      if (!begun) traced.start = result.passed(i);
      begun = true;
    }
    walker.next_letter += result.used();
    if (result.end() != v1::WALK_END_CROSSING) {
      traced.free = result.end() == v1::WALK_END_FREE;
      return traced;
    }
    const uint32_t before = walker.result.server_crossings;
    if (absl::Status status = Cross(walker, result); !status.ok()) return status;
    crossed_server = walker.result.server_crossings > before;
  }
}

absl::StatusOr<std::vector<Walked>> MapHandle::Beta(absl::Span<const v1::DartRef> starts,
                                                    absl::Span<const uint8_t> word) const {
  if (absl::Status status = internal::CheckWord(word); !status.ok()) return status;
  std::vector<Walker> walkers(starts.size());
  for (size_t i = 0; i < starts.size(); ++i) {
    walkers[i].block = starts[i].block();
    *walkers[i].start.mutable_dart() = starts[i];
  }
  for (;;) {
    // Walks in the same block at the same letter go together.
    std::map<std::pair<uint32_t, size_t>, std::vector<Walker*>> groups;
    for (Walker& walker : walkers) {
      if (!walker.done) groups[{walker.block, walker.next_letter}].push_back(&walker);
    }
    if (groups.empty()) break;
    for (const auto& [where, group] : groups) {
      for (size_t first = 0; first < group.size(); first += kMaxStarts) {
        absl::Status status = Go(absl::MakeConstSpan(group).subspan(first, kMaxStarts), word);
        if (!status.ok()) return status;
      }
    }
  }
  std::vector<Walked> results;
  results.reserve(walkers.size());
  for (Walker& walker : walkers) results.push_back(std::move(walker.result));
  return results;
}

}  // namespace ndmap

// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/walker.h"

#include <algorithm>
#include <chrono>
#include <map>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/types/span.h"
#include "core/map/walk.h"
#include "server/block_version.h"
#include "server/peer_calls.h"
#include "server/walk_answer.h"
#include "server/wire.h"
#include "service/status.h"

namespace ndmap::server {
namespace {

constexpr int kMaxStarts = 1 << 16;
constexpr size_t kMaxTrace = 4097;

void Describe(Block3& block, DartIndex index, v1::DartInfo& info) {
  auto& map = block.map();
  auto d = DartAt(map, index);
  v1::DartRef& ref = *info.mutable_dart();
  ref.set_block(block.id().value);
  ref.set_dart(index.value);
  ref.set_version(block.version());
  if (map.attribute<0>(d) != Block3::Lcc::null_handle) {
    const auto& p = map.point(d);
    info.set_x(p.x());
    info.set_y(p.y());
    info.set_z(p.z());
  }
  if (map.attribute<3>(d) != Block3::Lcc::null_handle) {
    const CellId& id = map.info<3>(d).id;
    if (id.valid()) {
      info.set_cell(id.ToString());
      info.set_level(static_cast<uint32_t>(id.level()));
    }
  }
  info.set_critical(block.IsCritical(d));
  if (info.critical()) ToWire(block.critical(d).label, *info.mutable_label());
}

// The dart that a walk begins at; not valid when there is no such label.
absl::StatusOr<DartIndex> Begin(Block3& block, const v1::BetaStart& start) {
  auto& map = block.map();
  switch (start.from_case()) {
    case v1::BetaStart::kDart:
      if (start.dart().block() != block.id().value) {
        return absl::InvalidArgumentError(absl::StrCat("a start in block ", start.dart().block(),
                                                       ", the request is for block ", block.id().value));
      }
      if (absl::Status s = CheckVersion(block, start.dart().version()); !s.ok()) return s;
      return DartIndex{start.dart().dart()};
    case v1::BetaStart::kLabel: {
      auto d = block.Find(FromWire(start.label()));
      return d == Block3::Lcc::null_handle ? DartIndex{} : IndexOf(map, d);
    }
    case v1::BetaStart::kAnyDart:
      if (map.number_of_darts() == 0) {
        return absl::NotFoundError(absl::StrCat("block ", block.id().value, " has no darts"));
      }
      return IndexOf(map, map.darts().begin());
    default:
      return absl::InvalidArgumentError("a start names a dart, a label or any dart");
  }
}

absl::Status WalkOne(Block3& block, const v1::BetaStart& start, absl::Span<const uint8_t> word, bool trace,
                     v1::BetaResult& result) {
  absl::StatusOr<DartIndex> from = Begin(block, start);
  if (!from.ok()) return from.status();
  if (!from->valid()) {
    result.set_end(v1::WALK_END_NO_LABEL);
    return absl::OkStatus();
  }
  absl::StatusOr<WalkResult> walk = Walk(block, *from, trace ? word.first(0) : word);
  if (walk.ok() && trace) Describe(block, walk->dart, *result.add_passed());
  for (size_t i = 0; trace && walk.ok() && walk->end == WalkResult::End::kArrived && i < word.size(); ++i) {
    walk = Walk(block, walk->dart, word.subspan(i, 1));
    if (!walk.ok()) break;
    if (walk->used > 0) Describe(block, walk->dart, *result.add_passed());
    walk->used += i;
  }
  if (!walk.ok()) return walk.status();
  Describe(block, walk->dart, *result.mutable_at());
  result.set_used(static_cast<uint32_t>(walk->used));
  switch (walk->end) {
    case WalkResult::End::kArrived:
      result.set_end(v1::WALK_END_ARRIVED);
      break;
    case WalkResult::End::kFree:
      result.set_end(v1::WALK_END_FREE);
      break;
    case WalkResult::End::kCrossing:
      result.set_end(v1::WALK_END_CROSSING);
      ToWire(walk->label, *result.mutable_label());
      result.set_has_peer(walk->peer.valid());
      if (walk->peer.valid()) result.set_peer(walk->peer.value);
      break;
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status Walker::InBlock(const v1::BetaRequest& request, const std::function<bool()>& gone,
                             v1::BetaResponse& response) {
  const absl::Span<const uint8_t> word(reinterpret_cast<const uint8_t*>(request.word().data()),
                                       request.word().size());
  int next = 0;
  // Many starts with a long word take long: a few at a time.
  auto step = [&](Block3& block) -> absl::StatusOr<bool> {
    const int end =
        std::min<int>(next + 1 + static_cast<int>(1000 / (word.size() + 1)), request.starts_size());
    for (; next < end; ++next) {
      if (absl::Status s =
              WalkOne(block, request.starts(next), word, request.trace(), *response.add_results());
          !s.ok())
        return s;
    }
    return next == request.starts_size();
  };
  return host_->QuerySliced(request.map(), request.block(), step, gone);
}

absl::Status Walker::Ask(const std::string& address, const v1::BetaRequest& request,
                         const std::function<bool()>& gone, v1::BetaResponse& response) {
  if (address.empty() || address == host_->address()) return InBlock(request, gone, response);
  if (gone()) return absl::CancelledError("the caller has gone");
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + PeerStubs::kDeadline);
  return FromServer(peers_->To(address)->Beta(&context, request, &response),
                    absl::StrCat("the block server at ", address));
}

absl::Status Walker::Beta(const v1::BetaRequest& request, const std::function<bool()>& gone,
                          v1::BetaResponse& response) {
  if (request.starts_size() > kMaxStarts || request.word().size() > kMaxWord) {
    return absl::InvalidArgumentError(absl::StrCat(request.starts_size(), " starts and a word of ",
                                                   request.word().size(), " letters; at most ", kMaxStarts,
                                                   " and ", kMaxWord, " are allowed"));
  }
  if (request.trace() &&
      (!request.stay() ||
       static_cast<size_t>(request.starts_size()) * (request.word().size() + 1) > kMaxTrace)) {
    return absl::InvalidArgumentError(absl::StrCat("a trace of ", request.starts_size(), " walks of ",
                                                   request.word().size(), " letters; with stay, at most ",
                                                   kMaxTrace, " darts are told"));
  }
  if (absl::Status status = InBlock(request, gone, response); !status.ok() || request.stay()) return status;
  absl::StatusOr<BlockHost::MapInfo> info = host_->Info(request.map());
  if (!info.ok()) return info.status();
  while (true) {
    // By block and number of letters used, so that one request serves many walks.
    std::map<std::pair<uint32_t, uint32_t>, std::vector<int>> rounds;
    for (int i = 0; i < response.results_size(); ++i) {
      const v1::BetaResult& r = response.results(i);
      if (r.end() != v1::WALK_END_CROSSING) continue;
      if (r.has_peer()) {
        rounds[{r.peer(), r.used()}].push_back(i);
        continue;
      }
      for (uint32_t b = 0; b < info->block_count; ++b) {
        if (b != r.at().dart().block()) rounds[{b, r.used()}].push_back(i);
      }
    }
    if (rounds.empty()) return absl::OkStatus();
    const v1::BetaResponse before = response;
    std::vector<bool> found(static_cast<size_t>(response.results_size()), false);
    for (const auto& [where, starts] : rounds) {
      const auto [block, used] = where;
      if (block >= info->block_count) return absl::InternalError(absl::StrCat("a peer is block ", block));
      v1::BetaRequest next;
      next.set_map(request.map());
      next.set_block(block);
      // The crossing's own letter was not counted as used.
      next.set_word(request.word().substr(used + 1));
      next.set_stay(true);
      for (int i : starts) *next.add_starts()->mutable_label() = before.results(i).label();
      v1::BetaResponse answer;
      if (absl::Status status = Ask(info->addresses[block], next, gone, answer); !status.ok()) return status;
      if (answer.results_size() != next.starts_size())
        return absl::InternalError("a peer's answer has other starts");
      for (size_t k = 0; k < starts.size(); ++k) {
        v1::BetaResult& result = *answer.mutable_results(static_cast<int>(k));
        if (result.end() == v1::WALK_END_NO_LABEL) continue;
        result.set_used(result.used() + used + 1);
        found[static_cast<size_t>(starts[k])] = true;
        *response.mutable_results(starts[k]) = std::move(result);
      }
    }
    for (int i = 0; i < before.results_size(); ++i) {
      const v1::BetaResult& r = before.results(i);
      if (r.end() == v1::WALK_END_CROSSING && !found[static_cast<size_t>(i)]) {
        return absl::UnavailableError(
            absl::StrCat("label ", ToString(FromWire(r.label())), " of block ", r.at().dart().block(),
                         " has no partner at the moment: the map is being changed"));
      }
    }
  }
}

}  // namespace ndmap::server

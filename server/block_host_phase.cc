// SPDX-License-Identifier: GPL-3.0-or-later
// Phases on the blocks of one server.
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/synchronization/blocking_counter.h"
#include "server/block_host.h"
#include "server/hosted_map.h"
#include "server/wire.h"

namespace ndmap::server {
namespace {

absl::Status WithBlock(uint32_t block, const absl::Status& status) {
  return absl::Status(status.code(), absl::StrCat("block ", block, ": ", status.message()));
}

}  // namespace

absl::StatusOr<std::shared_ptr<BlockHost::HostedMap>> BlockHost::FindPhase(const v1::PhaseKey& key) const {
  absl::StatusOr<std::shared_ptr<HostedMap>> map = Find(key.map());
  if (!map.ok()) return map.status();
  absl::MutexLock lock(&(*map)->mutex);
  if (!(*map)->in_phase || !((*map)->phase == FromWire(key))) {
    return absl::FailedPreconditionError(absl::StrCat("phase ", key.phase(), " of job ", key.job(),
                                                      " attempt ", key.attempt(), " does not run on server ",
                                                      address_));
  }
  return map;
}

absl::Status BlockHost::StartPhase(const v1::StartPhaseRequest& request) {
  absl::StatusOr<std::shared_ptr<HostedMap>> found = Find(request.key().map());
  if (!found.ok()) return found.status();
  const std::shared_ptr<HostedMap> map = *found;
  PhaseSetup setup{map->name, FromWire(request.key()), std::vector<Peer>(map->block_count)};
  std::vector<std::string> addresses(map->block_count);
  for (const v1::BlockPlacement& placement : request.placement()) {
    if (placement.block() >= map->block_count) {
      return absl::InvalidArgumentError(
          absl::StrCat("placement of block ", placement.block(), " of ", map->block_count));
    }
    setup.peers[placement.block()] = {placement.incarnation(), placement.address() != address_};
    addresses[placement.block()] = placement.address();
  }
  {
    absl::MutexLock lock(&map->mutex);
    map->in_phase = true;
    map->phase = setup.id;
    map->addresses = std::move(addresses);
  }
  absl::btree_map<std::string, std::string> values(request.phase().parameters().begin(),
                                                   request.phase().parameters().end());
  const Parameters parameters(std::move(values));
  absl::Mutex mutex;
  absl::Status result;
  absl::BlockingCounter left(static_cast<int>(map->blocks.size()));
  for (auto& [number, hosted] : map->blocks) {
    const uint32_t b = number;
    const Environment environment{BlockId{b}, map->block_count, map->routing, map->surface,
                                  hosted->index_cache};
    hosted->actor->Start(
        setup,
        [this, &request, &parameters, environment, block = hosted] {
          return options_.factory(request.phase().algorithm(), parameters, environment, block->block);
        },
        [&, b](absl::Status status) {
          if (!status.ok()) {
            absl::MutexLock lock(&mutex);
            result.Update(WithBlock(b, status));
          }
          left.DecrementCount();
        });
  }
  left.Wait();
  absl::MutexLock lock(&mutex);
  return result;
}

absl::Status BlockHost::RunPhase(const v1::PhaseKey& key) {
  absl::StatusOr<std::shared_ptr<HostedMap>> map = FindPhase(key);
  if (!map.ok()) return map.status();
  for (auto& [number, hosted] : (*map)->blocks) hosted->actor->Run(FromWire(key));
  return absl::OkStatus();
}

absl::Status BlockHost::PollPhase(const v1::PollPhaseRequest& request, v1::PollPhaseResponse& response) {
  const absl::Time deadline = absl::Now() + absl::Milliseconds(std::min(request.wait_milliseconds(), 1000u));
  while (true) {
    absl::StatusOr<std::shared_ptr<HostedMap>> found = FindPhase(request.key());
    if (!found.ok()) return found.status();
    HostedMap& map = **found;
    bool stopping;
    {
      absl::MutexLock lock(&mutex_);
      stopping = stopping_;
    }
    uint64_t rests;
    {
      absl::MutexLock lock(&map.mutex);
      rests = map.rests;
    }
    response.Clear();
    bool rest = true;
    for (auto& [number, hosted] : map.blocks) {
      const BlockSnapshot snapshot = hosted->actor->snapshot();
      ToWire(BlockId{number}, snapshot, *response.add_blocks());
      rest = rest && snapshot.idle;
      if (!snapshot.status.ok() && response.error().empty()) {
        response.set_error(std::string(snapshot.status.message()));
        response.set_error_block(number);
        response.set_error_code(static_cast<int32_t>(snapshot.status.code()));
      }
    }
    if (rest || stopping || !response.error().empty() || absl::Now() >= deadline) break;
    // A block that comes to rest after the look above has raised the count.
    absl::MutexLock lock(&map.mutex);
    auto changed = [&map, rests]() ABSL_EXCLUSIVE_LOCKS_REQUIRED(map.mutex) { return map.rests != rests; };
    map.mutex.AwaitWithDeadline(absl::Condition(&changed), deadline);
  }
  for (std::string& why : streams_.Broken()) response.add_broken_streams(std::move(why));
  return absl::OkStatus();
}

absl::Status BlockHost::FinishPhase(const v1::PhaseKey& key, v1::FinishPhaseResponse& response) {
  absl::StatusOr<std::shared_ptr<HostedMap>> found = FindPhase(key);
  if (!found.ok()) return found.status();
  HostedMap& map = **found;
  absl::Mutex mutex;
  absl::Status result;
  absl::BlockingCounter left(static_cast<int>(map.blocks.size()));
  for (auto& [number, hosted] : map.blocks) {
    const uint32_t b = number;
    v1::BlockReport* out = response.add_blocks();
    hosted->actor->Finish(FromWire(key),
                          [&, b, out](absl::Status status, BlockSnapshot snapshot, Report report) {
                            ToWire(BlockId{b}, snapshot, *out->mutable_progress());
                            ToWire(report, *out->mutable_report());
                            if (!status.ok()) {
                              absl::MutexLock lock(&mutex);
                              result.Update(WithBlock(b, status));
                            }
                            left.DecrementCount();
                          });
  }
  left.Wait();
  {
    absl::MutexLock lock(&map.mutex);
    map.in_phase = false;
  }
  absl::MutexLock lock(&mutex);
  return result;
}

absl::Status BlockHost::CancelPhase(const v1::PhaseKey& key, bool abandon) {
  absl::StatusOr<std::shared_ptr<HostedMap>> map = FindPhase(key);
  if (!map.ok()) return map.status();
  if (abandon) {
    Abandon(**map);
  } else {
    for (auto& [number, hosted] : (*map)->blocks) hosted->actor->Cancel(FromWire(key));
  }
  return absl::OkStatus();
}

}  // namespace ndmap::server

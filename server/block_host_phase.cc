// SPDX-License-Identifier: GPL-3.0-or-later
// Phases on the blocks of one server.
#include <algorithm>
#include <atomic>
#include <exception>
#include <thread>
#include <utility>

#include "absl/functional/function_ref.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/synchronization/blocking_counter.h"
#include "core/algorithm/refine/frame.h"
#include "server/block_host.h"
#include "server/hosted_map.h"
#include "server/wire.h"
#include "service/guarded.h"

namespace ndmap::server {
namespace {

// That phase closes the gates of writes.
constexpr char kAttributes[] = "attributes";

absl::Status WithBlock(uint32_t block, const absl::Status& status) {
  const std::string name = absl::StrCat("block ", block);
  if (absl::StartsWith(status.message(), name)) return status;
  return absl::Status(status.code(), absl::StrCat(name, ": ", status.message()));
}

// Calls f(0) ... f(count - 1) on this thread and up to `threads` - 1 others, and waits for all.
void ForEach(size_t count, unsigned threads, absl::FunctionRef<void(size_t)> f) {
  std::atomic<size_t> next = 0;
  const auto work = [&] {
    for (size_t i = next++; i < count; i = next++) f(i);
  };
  std::vector<std::thread> others;
  try {
    while (others.size() + 1 < std::min<size_t>(threads, count)) others.emplace_back(work);
  } catch (const std::exception&) {
    // Fewer threads take longer.
  }
  work();
  for (std::thread& thread : others) thread.join();
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
  const PhaseId id = FromWire(request.key());
  const bool attributes = request.phase().algorithm() == kAttributes;
  PhaseSetup setup{map->name, id, std::vector<Peer>(map->block_count)};
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
    if (map->dropped) return absl::NotFoundError(absl::StrCat("map \"", map->name, "\" was deleted"));
    map->in_phase = true;
    map->cancelled = false;
    map->attributes_phase = attributes;
    map->changing = false;
    map->phase = id;
    map->addresses = std::move(addresses);
  }
  if (!attributes) {
    map->gates->EndPhase(0);
  } else if (absl::Status status = map->gates->BeginPhase(); !status.ok()) {
    return status;
  }
  std::vector<std::unique_ptr<BlockAlgorithm>> algorithms;
  if (absl::Status status = MakeAlgorithms(*map, request.phase(), algorithms); !status.ok()) return status;
  if (!algorithms.empty() && algorithms.front()->changes_map()) {
    absl::MutexLock lock(&map->mutex);
    map->changing = true;
    map->last_change = id;
  }
  absl::Mutex mutex;
  absl::Status result;
  absl::BlockingCounter left(static_cast<int>(map->blocks.size()));
  size_t next = 0;
  for (auto& [number, hosted] : map->blocks) {
    const uint32_t b = number;
    hosted->actor->Start(setup, std::move(algorithms[next++]), [&, b](absl::Status status) {
      if (!status.ok()) {
        absl::MutexLock lock(&mutex);
        result.Update(WithBlock(b, status));
      }
      left.DecrementCount();
    });
  }
  bool cancelled;
  {
    absl::MutexLock lock(&map->mutex);
    cancelled = map->cancelled && map->phase == id;
  }
  if (cancelled) {
    for (auto& [number, hosted] : map->blocks) hosted->actor->Cancel(id);
  }
  left.Wait();
  absl::MutexLock lock(&mutex);
  return result;
}

absl::Status BlockHost::MakeAlgorithms(HostedMap& map, const v1::Phase& phase,
                                       std::vector<std::unique_ptr<BlockAlgorithm>>& made) {
  const Parameters parameters(
      absl::btree_map<std::string, std::string>(phase.parameters().begin(), phase.parameters().end()));
  std::vector<HostedBlock*> blocks;
  for (auto& [number, hosted] : map.blocks) blocks.push_back(hosted.get());
  made.resize(blocks.size());
  std::vector<absl::Status> status(blocks.size());
  // Indices of a large surface take long.
  const unsigned threads = map.surface == nullptr ? 1 : threads_;
  ForEach(blocks.size(), threads, [&](size_t i) {
    status[i] = service::Guarded([&]() -> absl::Status {
      HostedBlock& hosted = *blocks[i];
      Environment environment{hosted.block->id(), map.block_count, map.routing, nullptr, hosted.index_cache};
      environment.initial = InitialOf(map, hosted);
      environment.attributes = hosted.attributes;
      if (map.surface != nullptr) {
        environment.surface = map.surface->surface;
        environment.parity_cache = map.surface->parity;
      }
      environment.bounds = [this, &hosted] { return Bounds(hosted); };
      auto algorithm = options_.factory(phase.algorithm(), parameters, environment, *hosted.block);
      if (!algorithm.ok()) return WithBlock(hosted.block->id().value, algorithm.status());
      made[i] = *std::move(algorithm);
      return absl::OkStatus();
    });
  });
  absl::Status result;
  for (const absl::Status& s : status) result.Update(s);
  return result;
}

absl::StatusOr<Box3> BlockHost::Bounds(HostedBlock& hosted) {
  constexpr size_t kVerticesAStep = 1 << 14;
  VertexBounds<Block3> bounds(*hosted.block);
  absl::Status status = QueryActor(
      *hosted.actor, hosted.block,
      [&bounds](Block3&) -> absl::StatusOr<bool> { return bounds.Next(kVerticesAStep); },
      [] { return false; });
  if (!status.ok()) return status;
  return bounds.box();
}

absl::Status BlockHost::RunPhase(const v1::PhaseKey& key) {
  absl::StatusOr<std::shared_ptr<HostedMap>> map = FindPhase(key);
  if (!map.ok()) return map.status();
  bool attributes;
  {
    absl::MutexLock lock(&(*map)->mutex);
    attributes = (*map)->attributes_phase;
  }
  if (attributes) (*map)->gates->RunPhase();
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
  bool attributes;
  {
    absl::MutexLock lock(&map.mutex);
    map.in_phase = false;
    attributes = map.attributes_phase;
  }
  absl::MutexLock lock(&mutex);
  if (attributes) map.gates->EndPhase(result.ok() ? key.job() : 0);
  return result;
}

absl::Status BlockHost::CancelPhase(const v1::PhaseKey& key, bool abandon) {
  absl::StatusOr<std::shared_ptr<HostedMap>> map = FindPhase(key);
  if (!map.ok()) return map.status();
  if (abandon) {
    Abandon(**map);
  } else {
    {
      absl::MutexLock lock(&(*map)->mutex);
      (*map)->cancelled = (*map)->cancelled || (*map)->phase == FromWire(key);
    }
    for (auto& [number, hosted] : (*map)->blocks) hosted->actor->Cancel(FromWire(key));
  }
  return absl::OkStatus();
}

}  // namespace ndmap::server

// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/block_host.h"

#include <algorithm>
#include <thread>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/synchronization/blocking_counter.h"
#include "absl/synchronization/notification.h"
#include "server/hosted_map.h"
#include "server/wire.h"
#include "service/grid.h"
#include "service/guarded.h"
#include "service/mesh.h"
#include "service/names.h"
#include "service/surface_transfer.h"

namespace ndmap::server {

// Finds the process of a destination: this one (memory) or another (streams).
class BlockHost::Router : public PeerTransport {
 public:
  explicit Router(BlockHost* host) : host_(host) {}
  void Send(Envelope envelope, Taken taken) override {
    std::string address;
    if (absl::StatusOr<std::shared_ptr<HostedMap>> map = host_->Find(envelope.map); map.ok()) {
      absl::MutexLock lock(&(*map)->mutex);
      if (envelope.destination.value < (*map)->addresses.size()) {
        address = (*map)->addresses[envelope.destination.value];
      }
    }
    if (address.empty() || address == host_->address_) {
      host_->Deliver(std::move(envelope), std::move(taken));
    } else {
      host_->streams_.Send(address, envelope, std::move(taken));
    }
  }

 private:
  BlockHost* const host_;
};

BlockHost::BlockHost(HostOptions options)
    : options_(std::move(options)),
      threads_(options_.threads > 0 ? options_.threads : std::max(std::thread::hardware_concurrency(), 1u)),
      pieces_(options_.max_piece_bytes, options_.max_piece_time),
      router_(std::make_unique<Router>(this)),
      wrapped_(options_.wrap_transport ? options_.wrap_transport(router_.get()) : nullptr),
      pool_(threads_) {}

BlockHost::~BlockHost() { Stop(); }

void BlockHost::StopWaiting() {
  absl::MutexLock lock(&mutex_);
  stopping_ = true;
  for (auto& [name, map] : maps_) {
    absl::MutexLock map_lock(&map->mutex);
    ++map->rests;
  }
}

void BlockHost::Stop() {
  StopWaiting();
  streams_.Stop();
  pool_.Stop();
}

absl::StatusOr<std::shared_ptr<BlockHost::HostedMap>> BlockHost::Find(absl::string_view map) const {
  absl::MutexLock lock(&mutex_);
  auto it = maps_.find(map);
  if (it != maps_.end()) return it->second;
  if (absl::Status status = service::CheckName("map", map); !status.ok()) return status;
  return absl::NotFoundError(absl::StrCat("server ", address_, " has no map \"", map, "\""));
}

absl::StatusOr<BlockHost::HostedBlock*> BlockHost::FindBlock(HostedMap& map, uint32_t block) const {
  auto it = map.blocks.find(block);
  if (it != map.blocks.end()) return it->second.get();
  return absl::NotFoundError(
      absl::StrCat("server ", address_, " does not have block ", block, " of map \"", map.name, "\""));
}

bool BlockHost::Used(const HostedSurface& surface) const {
  return std::any_of(maps_.begin(), maps_.end(), [&](const auto& m) {
    return m.second->surface != nullptr && m.second->surface->surface == surface.surface;
  });
}

absl::Status BlockHost::PutSurface(const std::string& id, TriangleSurface surface, uint64_t max_bytes) {
  auto bytes = [](const TriangleSurface& s) {
    return service::SurfaceBytes(s.points.size(), s.triangles.size());
  };
  auto shared = std::make_shared<HostedSurface>();
  shared->surface = std::make_shared<const TriangleSurface>(std::move(surface));
  uint64_t kept = bytes(*shared->surface);
  absl::MutexLock lock(&mutex_);
  // The same surface again, for another map: what was computed from it serves both. The entry is a new one,
  // so that it does not go with the map that used the old one.
  if (auto there = surfaces_.find(id); there != surfaces_.end()) {
    *shared = *there->second;
    shared->order = ++last_surface_;
    there->second = std::move(shared);
    return absl::OkStatus();
  }
  for (const auto& [other, there] : surfaces_) kept += bytes(*there->surface);
  while (kept > max_bytes) {
    auto oldest = surfaces_.end();
    for (auto it = surfaces_.begin(); it != surfaces_.end(); ++it) {
      if (Used(*it->second)) continue;
      if (oldest == surfaces_.end() || it->second->order < oldest->second->order) oldest = it;
    }
    if (oldest == surfaces_.end()) {
      return absl::ResourceExhaustedError(absl::StrCat("server ", address_, " would keep ", kept,
                                                       " bytes of surfaces, over its limit of ", max_bytes,
                                                       " (--max-surface-bytes)"));
    }
    kept -= bytes(*oldest->second->surface);
    surfaces_.erase(oldest);
  }
  shared->order = ++last_surface_;
  surfaces_[id] = std::move(shared);
  return absl::OkStatus();
}

absl::Status BlockHost::CreateBlocks(const v1::CreateBlocksRequest& request) {
  if (absl::Status status = service::CheckName("map", request.map()); !status.ok()) return status;
  if (request.block_count() < 1 || request.block_count() > service::kMaxBlocks) {
    return absl::InvalidArgumentError(
        absl::StrCat("a map has 1 to ", service::kMaxBlocks, " blocks, not ", request.block_count()));
  }
  auto map = std::make_shared<HostedMap>();
  map->name = request.map();
  map->number = request.map_number();
  map->block_count = request.block_count();
  map->routing = request.routing() == v1::ROUTING_BROADCAST ? Routing::kBroadcast : Routing::kDirect;
  if (request.has_grid()) {
    absl::StatusOr<GridShape> grid = service::GridFromWire(request.grid());
    if (!grid.ok()) return grid.status();
    map->grid = *grid;
    map->grid_cells = std::make_shared<const GridCells>(grid->cells);
  }
  PeerTransport* const transport = wrapped_ ? wrapped_.get() : router_.get();
  for (uint32_t b : request.blocks()) {
    if (b >= request.block_count()) {
      return absl::InvalidArgumentError(absl::StrCat("block ", b, " of ", request.block_count()));
    }
    auto hosted = std::make_shared<HostedBlock>();
    hosted->block = std::make_shared<Block3>(BlockId{b});
    // No version is used twice, also not by a later map of this name: fewer changes than microseconds.
    hosted->block->set_version(static_cast<uint64_t>(absl::ToUnixMicros(absl::Now())));
    BlockActor::Options options;
    options.outstanding_limit = options_.outstanding_limit;
    options.accounted_bytes = [block = hosted->block] { return block->AccountedBytes(); };
    options.on_rest = [weak = std::weak_ptr<HostedMap>(map)] {
      if (std::shared_ptr<HostedMap> m = weak.lock()) {
        absl::MutexLock lock(&m->mutex);
        ++m->rests;
      }
    };
    hosted->actor = std::make_shared<BlockActor>(BlockId{b}, &pool_, transport, std::move(options));
    map->blocks.emplace(b, std::move(hosted));
  }
  if (request.has_mesh()) {
    if (absl::Status status = ClaimPieces(request, *map); !status.ok()) return status;
  }
  while (true) {
    if (absl::Status status = DropMap(request.map()); !status.ok() && !absl::IsNotFound(status))
      return status;
    absl::MutexLock lock(&mutex_);
    // Another call may have made one meanwhile; the last call's stays.
    if (maps_.contains(request.map())) continue;
    if (!request.surface_id().empty()) {
      auto it = surfaces_.find(request.surface_id());
      if (it == surfaces_.end()) {
        return absl::NotFoundError(
            absl::StrCat("server ", address_, " has no surface ", request.surface_id()));
      }
      map->surface = it->second;
    }
    maps_[request.map()] = std::move(map);
    return absl::OkStatus();
  }
}

absl::Status BlockHost::ClaimPieces(const v1::CreateBlocksRequest& request, HostedMap& map) {
  if (request.has_grid()) {
    return absl::InvalidArgumentError("a map is made from a grid or from a mesh, not from both");
  }
  if (absl::Status s = service::CheckMesh(request.mesh(), request.block_count()); !s.ok()) return s;
  map.mesh_cells = service::CellsOf(request.mesh());
  std::vector<uint32_t> blocks;
  for (const auto& [number, hosted] : map.blocks) blocks.push_back(number);
  auto claimed = pieces_.Claim(request.upload(), blocks, map.block_count, *map.mesh_cells);
  if (!claimed.ok()) {
    return absl::Status(claimed.status().code(),
                        absl::StrCat("server ", address_, ": ", claimed.status().message()));
  }
  size_t next = 0;
  for (auto& [number, hosted] : map.blocks) hosted->mesh = std::move((*claimed)[next++]);
  return absl::OkStatus();
}

absl::StatusOr<std::shared_ptr<const InitialCells>> BlockHost::Initial(const std::string& name,
                                                                       uint32_t block) const {
  absl::StatusOr<std::shared_ptr<HostedMap>> map = Find(name);
  if (!map.ok()) return map.status();
  absl::StatusOr<HostedBlock*> hosted = FindBlock(**map, block);
  if (!hosted.ok()) return hosted.status();
  if (std::shared_ptr<const InitialCells> initial = InitialOf(**map, **hosted)) return initial;
  return absl::FailedPreconditionError(
      absl::StrCat("map \"", name, "\" has no grid of initial hexahedra and no mesh: its cells have no ids"));
}

std::shared_ptr<const InitialCells> BlockHost::InitialOf(const HostedMap& map, HostedBlock& block) {
  if (block.mesh != nullptr) return block.mesh;
  return map.grid_cells;
}

absl::Status BlockHost::DropMap(const std::string& name, uint64_t number) {
  absl::StatusOr<std::shared_ptr<HostedMap>> map = Find(name);
  if (!map.ok()) return map.status();
  if (number != 0 && (*map)->number != number) {
    return absl::NotFoundError(
        absl::StrCat("server ", address_, " has another map \"", name, "\" than number ", number));
  }
  Drop(**map);
  // The surface goes with the last map that uses it.
  const std::shared_ptr<const HostedSurface> surface = (*map)->surface;
  absl::MutexLock lock(&mutex_);
  const bool used =
      std::any_of(maps_.begin(), maps_.end(), [&](const auto& m) { return m.second->surface == surface; });
  if (surface != nullptr && !used) {
    absl::erase_if(surfaces_, [&](const auto& there) { return there.second == surface; });
  }
  return absl::OkStatus();
}

void BlockHost::Drop(HostedMap& map) {
  {
    absl::MutexLock lock(&map.mutex);
    if (std::exchange(map.dropped, true)) {
      map.mutex.Await(absl::Condition(&map.gone));
      return;
    }
  }
  Abandon(map);
  const absl::Status why = absl::NotFoundError(absl::StrCat("map \"", map.name, "\" was deleted"));
  for (auto& [number, hosted] : map.blocks) hosted->actor->Close(why);
  {
    absl::MutexLock lock(&mutex_);
    if (auto it = maps_.find(map.name); it != maps_.end() && it->second.get() == &map) maps_.erase(it);
  }
  absl::MutexLock lock(&map.mutex);
  map.gone = true;
}

std::vector<std::pair<std::string, uint64_t>> BlockHost::Maps() const {
  absl::MutexLock lock(&mutex_);
  std::vector<std::pair<std::string, uint64_t>> maps;
  for (const auto& [name, map] : maps_) maps.emplace_back(name, map->number);
  return maps;
}

void BlockHost::DropEverything() {
  std::vector<std::string> names;
  {
    absl::MutexLock lock(&mutex_);
    for (const auto& [name, map] : maps_) names.push_back(name);
  }
  for (const std::string& name : names) DropMap(name).IgnoreError();
  absl::MutexLock lock(&mutex_);
  surfaces_.clear();
  pieces_.DropAll();
}

void BlockHost::Abandon(HostedMap& map) {
  {
    absl::MutexLock lock(&map.mutex);
    map.in_phase = false;
    ++map.rests;
  }
  absl::BlockingCounter left(static_cast<int>(map.blocks.size()));
  for (auto& [number, hosted] : map.blocks) hosted->actor->Abandon([&left] { left.DecrementCount(); });
  left.Wait();
  map.gates->EndPhase(0);
  streams_.Discard(map.name);
}

void BlockHost::Deliver(Envelope envelope, Taken taken) {
  absl::StatusOr<std::shared_ptr<HostedMap>> map = Find(envelope.map);
  if (map.ok()) {
    if (auto it = (*map)->blocks.find(envelope.destination.value); it != (*map)->blocks.end()) {
      it->second->actor->Deliver(std::move(envelope), std::move(taken));
      return;
    }
  }
  taken();
}

absl::Status BlockHost::Query(const std::string& name, uint32_t block,
                              std::function<absl::Status(Block3&)> query, BlockActor::Needs needs) {
  return Query(
      name, block, [&query](Block3& b, AttributeStore&) { return query(b); }, needs);
}

absl::Status BlockHost::Query(const std::string& name, uint32_t block,
                              std::function<absl::Status(Block3&, AttributeStore&)> query,
                              BlockActor::Needs needs) {
  absl::StatusOr<std::shared_ptr<HostedMap>> map = Find(name);
  if (!map.ok()) return map.status();
  absl::StatusOr<HostedBlock*> hosted = FindBlock(**map, block);
  if (!hosted.ok()) return hosted.status();
  absl::Status result;
  absl::Notification done;
  (*hosted)->actor->Post(
      [&](const absl::Status& turn) {
        result = turn.ok()
                     ? service::Guarded([&] { return query(*(*hosted)->block, *(*hosted)->attributes); })
                     : turn;
        done.Notify();
      },
      needs);
  done.WaitForNotification();
  return result;
}

absl::Status BlockHost::QuerySliced(const std::string& name, uint32_t block,
                                    std::function<absl::StatusOr<bool>(Block3&)> step,
                                    std::function<bool()> abandoned) {
  absl::StatusOr<std::shared_ptr<HostedMap>> map = Find(name);
  if (!map.ok()) return map.status();
  absl::StatusOr<HostedBlock*> hosted = FindBlock(**map, block);
  if (!hosted.ok()) return hosted.status();
  return QueryActor(*(*hosted)->actor, (*hosted)->block, std::move(step), std::move(abandoned));
}

absl::Status BlockHost::QuerySliced(const std::string& name, uint32_t block,
                                    std::function<absl::StatusOr<bool>(Block3&, AttributeStore&)> step,
                                    std::function<bool()> abandoned) {
  absl::StatusOr<std::shared_ptr<HostedMap>> map = Find(name);
  if (!map.ok()) return map.status();
  absl::StatusOr<HostedBlock*> hosted = FindBlock(**map, block);
  if (!hosted.ok()) return hosted.status();
  return QueryActor(
      *(*hosted)->actor, (*hosted)->block,
      [step = std::move(step), store = (*hosted)->attributes](Block3& b) { return step(b, *store); },
      std::move(abandoned));
}

absl::StatusOr<uint64_t> BlockHost::AtRest(const std::string& name) const {
  absl::StatusOr<std::shared_ptr<HostedMap>> map = Find(name);
  if (!map.ok()) return map.status();
  absl::MutexLock lock(&(*map)->mutex);
  if ((*map)->in_phase && (*map)->changing) {
    return absl::AbortedError(absl::StrCat("map \"", name, "\" is being changed by job ", (*map)->phase.job,
                                           ": its cells can be counted when that has ended"));
  }
  const PhaseId& last = (*map)->last_change;
  return last.job << 20 | last.phase;
}

absl::StatusOr<std::shared_ptr<AttributeGates>> BlockHost::Gates(const std::string& name) const {
  absl::StatusOr<std::shared_ptr<HostedMap>> map = Find(name);
  if (!map.ok()) return map.status();
  return (*map)->gates;
}

absl::Status BlockHost::QueryActor(BlockActor& actor, const std::shared_ptr<Block3>& block,
                                   std::function<absl::StatusOr<bool>(Block3&)> step,
                                   std::function<bool()> abandoned) {
  absl::Status result;
  absl::Notification done;
  actor.PostSliced([&](const absl::Status& turn) -> bool {
    absl::StatusOr<bool> over = true;
    if (!turn.ok()) {
      over = turn;
    } else {
      over = abandoned() ? absl::CancelledError("the caller has gone")
                         : service::Guarded([&] { return step(*block); });
    }
    if (over.ok() && !*over) return false;
    result = over.status();
    done.Notify();
    return true;
  });
  done.WaitForNotification();
  return result;
}

absl::StatusOr<BlockHost::MapInfo> BlockHost::Info(const std::string& name) const {
  absl::StatusOr<std::shared_ptr<HostedMap>> map = Find(name);
  if (!map.ok()) return map.status();
  MapInfo info;
  info.number = (*map)->number;
  info.block_count = (*map)->block_count;
  info.routing = (*map)->routing;
  info.grid = (*map)->grid;
  info.mesh_cells = (*map)->mesh_cells;
  for (const auto& [number, hosted] : (*map)->blocks) info.blocks.push_back(number);
  absl::MutexLock lock(&(*map)->mutex);
  info.addresses = (*map)->addresses;
  info.addresses.resize(info.block_count);
  return info;
}

size_t BlockHost::map_count() const {
  absl::MutexLock lock(&mutex_);
  return maps_.size();
}

}  // namespace ndmap::server

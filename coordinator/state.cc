// SPDX-License-Identifier: GPL-3.0-or-later
// Servers and surfaces; maps and jobs are in state_jobs.cc.
#include "coordinator/state.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "service/surface_transfer.h"

namespace ndmap::coordinator {
namespace {

// Surfaces that no map uses: few are between their upload and a map for long.
constexpr size_t kUnusedSurfaces = 100;

}  // namespace

v1::RegisterServerResponse State::Register(const v1::RegisterServerRequest& request) {
  absl::MutexLock lock(&mutex_);
  return RegisterLocked(request);
}

absl::StatusOr<v1::RegisterServerResponse> State::RegisterWhenFree(const v1::RegisterServerRequest& request,
                                                                   absl::Time deadline,
                                                                   absl::FunctionRef<bool()> given_up) {
  constexpr absl::Duration kLook = absl::Milliseconds(100);
  absl::MutexLock lock(&mutex_);
  const absl::Time begin = absl::Now();
  while (true) {
    const ServerRecord* holder = nullptr;
    for (const auto& [id, record] : servers_) {
      if (record.server.address() == request.address() && Alive(record)) holder = &record;
    }
    if (holder == nullptr) return RegisterLocked(request);
    const std::string whose =
        absl::StrCat(request.address(), " is the address of server ", holder->server.server_id(), ", which ");
    if (holder->last_seen > begin) {
      return absl::AlreadyExistsError(
          absl::StrCat(whose, "is alive: take another --advertise or --listen, or stop that server first"));
    }
    const absl::Time now = absl::Now(), end = holder->last_seen + options_.lease;
    if (given_up()) return absl::CancelledError("the caller has gone");
    if (now >= deadline) {
      return absl::AbortedError(
          absl::StrCat(whose, "was alive ", absl::FormatDuration(absl::Trunc(now - holder->last_seen, kLook)),
                       " ago: waiting for its next sign of life, or the end of its lease in ",
                       absl::FormatDuration(absl::Ceil(end - now, kLook))));
    }
    const auto heard = [holder, seen = holder->last_seen] { return holder->last_seen != seen; };
    mutex_.AwaitWithTimeout(absl::Condition(&heard), std::min({kLook, deadline - now, end - now}));
  }
}

v1::RegisterServerResponse State::RegisterLocked(const v1::RegisterServerRequest& request) {
  v1::RegisterServerResponse response;
  response.set_lease_milliseconds(static_cast<uint32_t>(absl::ToInt64Milliseconds(options_.lease)));
  uint32_t id = 0;
  for (const auto& [number, record] : servers_) {
    if (record.server.address() == request.address()) id = number;
  }
  if (id == 0) id = servers_.empty() ? 1 : servers_.rbegin()->first + 1;
  ServerRecord& record = servers_[id];
  record.server.set_server_id(id);
  record.server.set_incarnation(++last_incarnation_);
  record.server.set_address(request.address());
  *record.server.mutable_version() = request.version();
  record.server.set_capacity(request.capacity());
  record.last_seen = absl::Now();
  record.stopped = false;
  response.set_server_id(id);
  response.set_incarnation(last_incarnation_);
  return response;
}

State::ServerRecord* State::FindServer(uint32_t server_id, uint64_t incarnation) {
  auto it = servers_.find(server_id);
  const bool known =
      it != servers_.end() && it->second.server.incarnation() == incarnation && !it->second.stopped;
  return known ? &it->second : nullptr;
}

absl::Status State::Unregister(uint32_t server_id, uint64_t incarnation) {
  absl::MutexLock lock(&mutex_);
  ServerRecord* const record = FindServer(server_id, incarnation);
  if (record == nullptr)
    return absl::NotFoundError(absl::StrCat("server ", server_id, " is not known in this incarnation"));
  record->stopped = true;
  return absl::OkStatus();
}

uint64_t State::NewNumber() {
  absl::MutexLock lock(&mutex_);
  return ++last_incarnation_;
}

absl::Status State::Heartbeat(const v1::HeartbeatRequest& request, v1::HeartbeatResponse* response) {
  absl::MutexLock lock(&mutex_);
  ServerRecord* const record = FindServer(request.server_id(), request.incarnation());
  if (record == nullptr) {
    return absl::NotFoundError(
        absl::StrCat("server ", request.server_id(), " is not known in this incarnation"));
  }
  record->last_seen = absl::Now();
  if (response == nullptr) return absl::OkStatus();
  for (const v1::MapNumber& there : request.maps()) {
    const auto map = maps_.find(there.map());
    // A map is entered here before its blocks are made, so what is unknown was deleted.
    const bool wanted = map != maps_.end() && map->second.number() == there.number();
    if (!wanted) *response->add_drop() = there;
  }
  return absl::OkStatus();
}

std::vector<v1::Server> State::Servers() const {
  absl::MutexLock lock(&mutex_);
  std::map<uint32_t, uint32_t> blocks;
  for (const auto& [name, map] : maps_) {
    for (const v1::BlockPlacement& placement : map.blocks()) ++blocks[placement.server_id()];
  }
  std::vector<v1::Server> result;
  for (const auto& [id, record] : servers_) {
    v1::Server server = record.server;
    server.set_alive(Alive(record));
    server.set_blocks(blocks[id]);
    result.push_back(std::move(server));
  }
  return result;
}

absl::Status State::CheckServer(uint32_t server_id, uint64_t incarnation) const {
  absl::MutexLock lock(&mutex_);
  return CheckServerLocked(server_id, incarnation);
}

absl::Status State::CheckServerLocked(uint32_t server_id, uint64_t incarnation) const {
  auto it = servers_.find(server_id);
  if (it == servers_.end())
    return absl::UnavailableError(absl::StrCat("server ", server_id, " is not known"));
  const ServerRecord& record = it->second;
  const std::string name = absl::StrCat("server ", server_id, " (", record.server.address(), ")");
  if (record.server.incarnation() != incarnation) {
    return absl::UnavailableError(absl::StrCat(name, " was restarted and has lost its blocks"));
  }
  if (record.stopped)
    return absl::UnavailableError(absl::StrCat(name, " was stopped and has lost its blocks"));
  if (!Alive(record)) {
    return absl::UnavailableError(
        absl::StrCat(name, " is lost: no sign of life for ", absl::FormatDuration(options_.lease)));
  }
  return absl::OkStatus();
}

bool State::MakeRoom(uint64_t bytes) {
  if (bytes > options_.max_surface_bytes) return false;
  std::set<std::string> used;
  for (const auto& [name, map] : maps_) used.insert(map.surface_id());
  while (true) {
    uint64_t kept = 0;
    size_t unused = 0;
    auto oldest = surfaces_.end();
    for (auto it = surfaces_.begin(); it != surfaces_.end(); ++it) {
      kept += it->second.bytes;
      if (used.contains(it->first)) continue;
      ++unused;
      if (oldest == surfaces_.end() || it->second.order < oldest->second.order) oldest = it;
    }
    const bool fits = kept <= options_.max_surface_bytes - bytes;
    if (fits && unused < kUnusedSurfaces) return true;
    if (oldest == surfaces_.end()) return false;
    surfaces_.erase(oldest);
  }
}

absl::Status State::AddSurface(const std::string& id, const std::string& name, TriangleSurface content) {
  const uint64_t bytes = service::SurfaceBytes(content.points.size(), content.triangles.size());
  auto shared = std::make_shared<const TriangleSurface>(std::move(content));
  absl::MutexLock lock(&mutex_);
  if (auto there = surfaces_.find(id); there != surfaces_.end()) {
    there->second.order = ++last_surface_;
    return absl::OkStatus();
  }
  if (!MakeRoom(bytes)) {
    return absl::ResourceExhaustedError(
        absl::StrCat("a surface of ", bytes,
                     " bytes does not fit beside those that maps use: the limit of all surfaces is ",
                     options_.max_surface_bytes, " bytes (--max-surface-bytes); delete maps"));
  }
  surfaces_[id] = {name, std::move(shared), bytes, ++last_surface_};
  return absl::OkStatus();
}

absl::StatusOr<State::Surface> State::FindSurface(const std::string& id) const {
  absl::MutexLock lock(&mutex_);
  auto it = surfaces_.find(id);
  if (it == surfaces_.end()) {
    return absl::NotFoundError(
        absl::StrCat("there is no surface \"", id.substr(0, 64), "\": upload it first"));
  }
  return it->second;
}

absl::Status State::DeleteSurface(const std::string& id) {
  absl::MutexLock lock(&mutex_);
  for (const auto& [name, map] : maps_) {
    if (map.surface_id() == id) {
      return absl::FailedPreconditionError(absl::StrCat("map \"", name, "\" uses surface ", id));
    }
  }
  if (surfaces_.erase(id) == 0) {
    return absl::NotFoundError(absl::StrCat("there is no surface \"", id.substr(0, 64), "\""));
  }
  return absl::OkStatus();
}

}  // namespace ndmap::coordinator

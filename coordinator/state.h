// SPDX-License-Identifier: GPL-3.0-or-later
// What the coordinator knows: servers, surfaces, maps, jobs. Every method is one atomic step; nothing here
// waits for the network, except Wait...() for a change of the state.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/container/flat_hash_map.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"
#include "core/geometry/surface.h"
#include "ndmap/v1/coordinator.pb.h"

namespace ndmap::coordinator {

// Gives new cells values: the last phase of jobs that change a map with attributes.
inline constexpr char kAttributesAlgorithm[] = "attributes";

struct StateOptions {
  absl::Duration lease = absl::Seconds(10);
  // Of all surfaces that are kept.
  uint64_t max_surface_bytes = uint64_t{4} << 30;
  // Of the jobs that have ended and are remembered: their results are as long as their maps have blocks.
  uint64_t max_job_bytes = uint64_t{256} << 20;
};

class State {
 public:
  explicit State(StateOptions options) : options_(options) {}

  // --- Servers. ---
  // Also renames nothing: an address that was there before keeps its number and gets a new incarnation.
  v1::RegisterServerResponse Register(const v1::RegisterServerRequest& request);
  // The same, but not of an address that belongs to a server that is alive. Whether it is, when its lease
  // still runs, the next sign of life tells, or the end of the lease: waited for until `deadline` or until
  // `given_up`, which is asked some times a second. ALREADY_EXISTS: it is alive. ABORTED: not known yet, ask
  // again.
  absl::StatusOr<v1::RegisterServerResponse> RegisterWhenFree(const v1::RegisterServerRequest& request,
                                                              absl::Time deadline,
                                                              absl::FunctionRef<bool()> given_up);
  // `response` (may be null) is told which of the server's maps are to be dropped.
  absl::Status Heartbeat(const v1::HeartbeatRequest& request, v1::HeartbeatResponse* response = nullptr);
  std::vector<v1::Server> Servers() const;
  // The server stops: it is not alive from now on. NOT_FOUND as Heartbeat().
  absl::Status Unregister(uint32_t server_id, uint64_t incarnation);
  // OK while the server is in this incarnation and its lease runs; otherwise UNAVAILABLE that names it.
  absl::Status CheckServer(uint32_t server_id, uint64_t incarnation) const;

  // --- Surfaces. ---
  // Keeps a surface for maps to come. When there is no room, or too many are unused, those that no map uses
  // are forgotten, the oldest first. RESOURCE_EXHAUSTED names the limit.
  absl::Status AddSurface(const std::string& id, const std::string& name, TriangleSurface surface);
  struct Surface {
    std::string name;
    std::shared_ptr<const TriangleSurface> content;
    uint64_t bytes = 0;
    // Higher for one that was sent later.
    uint64_t order = 0;
  };
  absl::StatusOr<Surface> FindSurface(const std::string& id) const;
  absl::Status DeleteSurface(const std::string& id);

  // --- Maps and jobs. ---
  // One that was never given before, also not by an earlier coordinator.
  uint64_t NewNumber();
  // The map in state CREATING together with the job that creates it. ALREADY_EXISTS.
  absl::StatusOr<v1::Job> AddMap(v1::Map map, v1::Phase build);
  // FAILED_PRECONDITION naming the job that is in the way. A job that changes a map with attributes gets a
  // last phase that brings them up to date.
  absl::StatusOr<v1::Job> AddJob(const v1::StartJobRequest& request, bool changes_map);
  // Jobs after which the map has one attribute more or less. ALREADY_EXISTS, NOT_FOUND, RESOURCE_EXHAUSTED
  // (too many), and as AddJob.
  absl::StatusOr<v1::Job> DefineAttribute(const std::string& map, const v1::Attribute& attribute);
  absl::StatusOr<v1::Job> DropAttribute(const std::string& map, const std::string& name);
  absl::StatusOr<v1::Map> FindMap(const std::string& map) const;
  // Without routing tables. A map that is READY and has blocks on a server that is not there any more has an
  // error that names the server.
  std::vector<v1::Map> Maps() const;
  // Takes the map out; its name stays taken until FreeName(). FAILED_PRECONDITION while a job runs on it.
  absl::StatusOr<v1::Map> RemoveMap(const std::string& map);
  // Its blocks are dropped, or will be when their servers are heard of again.
  void FreeName(const std::string& map);

  absl::StatusOr<v1::Job> FindJob(uint64_t job) const;
  // Without results; the newest last.
  std::vector<v1::Job> Jobs(const std::string& map) const;
  absl::StatusOr<v1::Job> CancelJob(uint64_t job);
  bool CancelRequested(uint64_t job) const;
  void SetProgress(uint64_t job, uint32_t phase, const std::string& algorithm,
                   std::vector<v1::BlockProgress> blocks);
  // Of phase `phase` of the job.
  void AddResult(uint64_t job, uint32_t phase, v1::PhaseResult result);
  // Ends the job and what follows for its map: a failed job that changes the map leaves it FAILED.
  void EndJob(uint64_t job, const absl::Status& status, bool cancelled, bool changed = true);
  // The progress once it is newer than `revision` (which is brought up to date), or after `timeout` as it is.
  absl::StatusOr<v1::JobProgress> WaitProgress(uint64_t job, uint64_t& revision,
                                               absl::Duration timeout) const;
  // No job is running any more.
  bool WaitAllEnded(absl::Duration timeout) const;

 private:
  v1::RegisterServerResponse RegisterLocked(const v1::RegisterServerRequest& request)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  struct ServerRecord {
    v1::Server server;
    absl::Time last_seen;
    // It has said goodbye.
    bool stopped = false;
  };
  struct JobRecord {
    v1::Job job;
    v1::JobProgress progress;
    uint64_t revision = 1;
    absl::Time started;
    // Of what is remembered of it when it has ended.
    uint64_t bytes = 0;
    // The map's list when the job is done, if that is what it is for.
    std::optional<google::protobuf::RepeatedPtrField<v1::Attribute>> attributes;
  };

  v1::Job NewJob(const std::string& map, const std::string& kind, bool changes_map,
                 std::vector<v1::Phase> phases) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  absl::StatusOr<JobRecord*> FindRecord(uint64_t job) const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  bool Alive(const ServerRecord& record) const {
    return !record.stopped && absl::Now() - record.last_seen < options_.lease;
  }
  // The server in this incarnation, also one that is lost; null if it is not known, or has stopped.
  ServerRecord* FindServer(uint32_t server_id, uint64_t incarnation) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  absl::Status CheckServerLocked(uint32_t server_id, uint64_t incarnation) const
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  absl::Status CheckFree(const v1::Map& map) const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // The map, if a job may be begun on it.
  absl::StatusOr<v1::Map*> FindToRun(const std::string& map, bool changes_map)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  absl::Status AppendAttributes(const v1::Map& map, std::vector<v1::Phase>& phases) const;
  absl::StatusOr<v1::Job> NewAttributesJob(const v1::Map& map, const std::string& kind,
                                           google::protobuf::RepeatedPtrField<v1::Attribute> list)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Forgets unused surfaces until one of `bytes` fits; false if it does not even then.
  bool MakeRoom(uint64_t bytes) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const StateOptions options_;
  mutable absl::Mutex mutex_;
  std::map<uint32_t, ServerRecord> servers_ ABSL_GUARDED_BY(mutex_);
  // Never the same in two lives of the coordinator: a server of an earlier one is not taken for a newer.
  // Numbers maps, too.
  uint64_t last_incarnation_ ABSL_GUARDED_BY(mutex_) = static_cast<uint64_t>(absl::ToUnixNanos(absl::Now()));
  std::map<std::string, Surface> surfaces_ ABSL_GUARDED_BY(mutex_);
  uint64_t last_surface_ ABSL_GUARDED_BY(mutex_) = 0;
  std::map<std::string, v1::Map> maps_ ABSL_GUARDED_BY(mutex_);
  // Names of maps whose blocks are being dropped.
  std::set<std::string> leaving_ ABSL_GUARDED_BY(mutex_);
  std::map<uint64_t, std::unique_ptr<JobRecord>> jobs_ ABSL_GUARDED_BY(mutex_);
  uint64_t last_job_ ABSL_GUARDED_BY(mutex_) = 0;
  // Of all jobs that have ended.
  uint64_t job_bytes_ ABSL_GUARDED_BY(mutex_) = 0;
};

}  // namespace ndmap::coordinator

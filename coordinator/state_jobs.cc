// SPDX-License-Identifier: GPL-3.0-or-later
// Maps and their jobs.
#include <algorithm>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "coordinator/state.h"

namespace ndmap::coordinator {
namespace {

// Ended jobs that are remembered.
constexpr size_t kKeptJobs = 1000;
// However long their results are: who waits for one of them has not asked for them yet.
constexpr size_t kJobsAlwaysKept = 16;

double UnixSeconds(absl::Time t) { return absl::ToDoubleSeconds(t - absl::UnixEpoch()); }

bool Running(const v1::Job& job) {
  return job.state() == v1::JOB_STATE_RUNNING || job.state() == v1::JOB_STATE_CANCELLING;
}

absl::Status NoMap(const std::string& map) {
  return absl::NotFoundError(absl::StrCat("there is no map \"", map, "\""));
}

// Jobs are remembered when they have ended; assignments and lists of hexahedra, of megabytes, are not.
void Shorten(v1::Phase& phase) {
  constexpr size_t kKeptBytes = 4096;
  for (auto& [name, value] : *phase.mutable_parameters()) {
    if (value.size() > kKeptBytes) value = absl::StrCat("(", value.size(), " bytes)");
  }
}

}  // namespace

v1::Job State::NewJob(const std::string& map, const std::string& kind, bool changes_map,
                      std::vector<v1::Phase> phases) {
  // The oldest that have ended are forgotten.
  for (auto it = jobs_.begin(); it != jobs_.end();) {
    const bool few = jobs_.size() < kJobsAlwaysKept;
    if (few || (jobs_.size() < kKeptJobs && job_bytes_ <= options_.max_job_bytes)) break;
    if (Running(it->second->job)) {
      ++it;
      continue;
    }
    job_bytes_ -= it->second->bytes;
    it = jobs_.erase(it);
  }
  auto record = std::make_unique<JobRecord>();
  record->started = absl::Now();
  v1::Job& job = record->job;
  job.set_job(++last_job_);
  job.set_map(map);
  job.set_kind(kind);
  job.set_state(v1::JOB_STATE_RUNNING);
  job.set_changes_map(changes_map);
  job.set_started(UnixSeconds(record->started));
  for (v1::Phase& phase : phases) *job.add_phases() = std::move(phase);
  record->progress.set_job(job.job());
  record->progress.set_state(job.state());
  record->progress.set_phase_count(static_cast<uint32_t>(job.phases_size()));
  maps_[map].add_running_jobs(job.job());
  v1::Job result = job;
  jobs_.emplace(job.job(), std::move(record));
  return result;
}

absl::StatusOr<v1::Job> State::AddMap(v1::Map map, v1::Phase build) {
  absl::MutexLock lock(&mutex_);
  if (maps_.contains(map.map())) {
    return absl::AlreadyExistsError(absl::StrCat("there is a map \"", map.map(), "\" already"));
  }
  if (leaving_.contains(map.map())) {
    return absl::FailedPreconditionError(
        absl::StrCat("map \"", map.map(), "\" is still being deleted: try again in a moment"));
  }
  if (!map.surface_id().empty() && !surfaces_.contains(map.surface_id())) {
    return absl::NotFoundError(absl::StrCat("surface ", map.surface_id(), " was deleted: upload it again"));
  }
  map.set_state(v1::MAP_STATE_CREATING);
  map.set_number(++last_incarnation_);
  const std::string name = map.map();
  maps_[name] = std::move(map);
  return NewJob(name, "create", true, {std::move(build)});
}

absl::Status State::CheckFree(const v1::Map& map) const {
  for (uint64_t number : map.running_jobs()) {
    const v1::Job& other = jobs_.at(number)->job;
    return absl::FailedPreconditionError(absl::StrCat("job ", number, " (", other.kind(),
                                                      ") is running on map \"", map.map(),
                                                      "\": wait for it or cancel it"));
  }
  return absl::OkStatus();
}

absl::StatusOr<v1::Map*> State::FindToRun(const std::string& map, bool changes_map) {
  auto it = maps_.find(map);
  if (it == maps_.end()) return NoMap(map);
  if (absl::Status status = CheckFree(it->second); !status.ok()) return status;
  if (it->second.unmade()) {
    return absl::FailedPreconditionError(
        absl::StrCat("map \"", map, "\" was never made (", it->second.error(), "): delete it"));
  }
  if (it->second.state() == v1::MAP_STATE_FAILED && changes_map) {
    return absl::FailedPreconditionError(
        absl::StrCat("map \"", map, "\" is not to be changed any more: ", it->second.error()));
  }
  return &it->second;
}

absl::StatusOr<v1::Job> State::AddJob(const v1::StartJobRequest& request, bool changes_map) {
  absl::MutexLock lock(&mutex_);
  absl::StatusOr<v1::Map*> map = FindToRun(request.map(), changes_map);
  if (!map.ok()) return map.status();
  std::vector<v1::Phase> phases(request.phases().begin(), request.phases().end());
  if (changes_map) {
    if (absl::Status status = AppendAttributes(**map, phases); !status.ok()) return status;
  }
  return NewJob(request.map(), request.kind(), changes_map, std::move(phases));
}

absl::StatusOr<v1::Map> State::FindMap(const std::string& map) const {
  absl::MutexLock lock(&mutex_);
  auto it = maps_.find(map);
  if (it == maps_.end()) return NoMap(map);
  return it->second;
}

std::vector<v1::Map> State::Maps() const {
  absl::MutexLock lock(&mutex_);
  std::vector<v1::Map> result;
  for (const auto& [name, map] : maps_) {
    result.push_back(map);
    result.back().clear_blocks();
    if (map.state() != v1::MAP_STATE_READY) continue;
    std::set<std::pair<uint32_t, uint64_t>> servers;
    for (const v1::BlockPlacement& b : map.blocks()) servers.emplace(b.server_id(), b.incarnation());
    for (const auto& [server, incarnation] : servers) {
      const absl::Status status = CheckServerLocked(server, incarnation);
      if (!status.ok()) result.back().set_error(std::string(status.message()));
    }
  }
  return result;
}

absl::StatusOr<v1::Map> State::RemoveMap(const std::string& map) {
  absl::MutexLock lock(&mutex_);
  auto it = maps_.find(map);
  if (it == maps_.end()) return NoMap(map);
  if (absl::Status status = CheckFree(it->second); !status.ok()) return status;
  v1::Map result = std::move(it->second);
  maps_.erase(it);
  leaving_.insert(map);
  return result;
}

void State::FreeName(const std::string& map) {
  absl::MutexLock lock(&mutex_);
  leaving_.erase(map);
}

absl::StatusOr<State::JobRecord*> State::FindRecord(uint64_t job) const {
  auto it = jobs_.find(job);
  if (it == jobs_.end()) return absl::NotFoundError(absl::StrCat("there is no job ", job));
  return it->second.get();
}

absl::StatusOr<v1::Job> State::FindJob(uint64_t job) const {
  absl::MutexLock lock(&mutex_);
  absl::StatusOr<JobRecord*> record = FindRecord(job);
  if (!record.ok()) return record.status();
  return (*record)->job;
}

std::vector<v1::Job> State::Jobs(const std::string& map) const {
  absl::MutexLock lock(&mutex_);
  std::vector<v1::Job> result;
  for (const auto& [number, record] : jobs_) {
    if (!map.empty() && record->job.map() != map) continue;
    // Field by field: results are long, and a list of jobs is read by people. So are lists of hexahedra and
    // assignments among the parameters of phases.
    const v1::Job& job = record->job;
    v1::Job& brief = result.emplace_back();
    brief.set_job(job.job());
    brief.set_map(job.map());
    brief.set_kind(job.kind());
    brief.set_state(job.state());
    brief.set_error(job.error());
    brief.set_changes_map(job.changes_map());
    brief.set_started(job.started());
    brief.set_ended(job.ended());
    for (const v1::Phase& phase : job.phases()) brief.add_phases()->set_algorithm(phase.algorithm());
  }
  return result;
}

absl::StatusOr<v1::Job> State::CancelJob(uint64_t job) {
  absl::MutexLock lock(&mutex_);
  absl::StatusOr<JobRecord*> record = FindRecord(job);
  if (!record.ok()) return record.status();
  JobRecord& r = **record;
  if (r.job.state() == v1::JOB_STATE_RUNNING) {
    r.job.set_state(v1::JOB_STATE_CANCELLING);
    r.progress.set_state(v1::JOB_STATE_CANCELLING);
    ++r.revision;
  }
  return r.job;
}

bool State::CancelRequested(uint64_t job) const {
  absl::MutexLock lock(&mutex_);
  absl::StatusOr<JobRecord*> record = FindRecord(job);
  return record.ok() && (*record)->job.state() == v1::JOB_STATE_CANCELLING;
}

void State::SetProgress(uint64_t job, uint32_t phase, const std::string& algorithm,
                        std::vector<v1::BlockProgress> blocks) {
  std::sort(blocks.begin(), blocks.end(), [](const auto& a, const auto& b) { return a.block() < b.block(); });
  absl::MutexLock lock(&mutex_);
  absl::StatusOr<JobRecord*> record = FindRecord(job);
  if (!record.ok()) return;
  v1::JobProgress& progress = (*record)->progress;
  progress.set_phase_index(phase);
  progress.set_algorithm(algorithm);
  progress.clear_blocks();
  for (v1::BlockProgress& block : blocks) *progress.add_blocks() = std::move(block);
  progress.set_seconds(absl::ToDoubleSeconds(absl::Now() - (*record)->started));
  ++(*record)->revision;
}

void State::AddResult(uint64_t job, uint32_t phase, v1::PhaseResult result) {
  absl::MutexLock lock(&mutex_);
  absl::StatusOr<JobRecord*> record = FindRecord(job);
  if (!record.ok()) return;
  Shorten(*result.mutable_phase());
  *(*record)->job.add_results() = std::move(result);
  (*record)->progress.set_phase_index(phase + 1);
  ++(*record)->revision;
}

void State::EndJob(uint64_t number, const absl::Status& status, bool cancelled, bool changed) {
  absl::MutexLock lock(&mutex_);
  absl::StatusOr<JobRecord*> record = FindRecord(number);
  if (!record.ok()) return;
  v1::Job& job = (*record)->job;
  job.set_state(!status.ok() ? v1::JOB_STATE_FAILED
                : cancelled  ? v1::JOB_STATE_CANCELLED
                             : v1::JOB_STATE_DONE);
  job.set_error(std::string(status.message()));
  for (v1::Phase& phase : *job.mutable_phases()) Shorten(phase);
  job.set_ended(UnixSeconds(absl::Now()));
  v1::JobProgress& progress = (*record)->progress;
  progress.set_state(job.state());
  progress.set_error(job.error());
  progress.set_seconds(job.ended() - job.started());
  ++(*record)->revision;
  (*record)->bytes = job.SpaceUsedLong() + progress.SpaceUsedLong();
  job_bytes_ += (*record)->bytes;
  auto it = maps_.find(job.map());
  if (it == maps_.end()) return;
  v1::Map& map = it->second;
  auto* running = map.mutable_running_jobs();
  running->erase(std::remove(running->begin(), running->end(), number), running->end());
  if ((*record)->attributes && job.state() == v1::JOB_STATE_DONE) {
    *map.mutable_attributes() = *std::move((*record)->attributes);
  }
  const bool creating = map.state() == v1::MAP_STATE_CREATING;
  const bool unmade = creating && (cancelled || !status.ok());
  if (unmade || (job.changes_map() && !status.ok() && changed)) {
    map.set_state(v1::MAP_STATE_FAILED);
    map.set_unmade(unmade);
    map.set_error(absl::StrCat("job ", number, " (", job.kind(), ") ",
                               status.ok() ? "was cancelled" : absl::StrCat("failed: ", job.error())));
  } else if (creating) {
    map.set_state(v1::MAP_STATE_READY);
  }
}

absl::StatusOr<v1::JobProgress> State::WaitProgress(uint64_t job, uint64_t& revision,
                                                    absl::Duration timeout) const {
  absl::MutexLock lock(&mutex_);
  auto newer = [this, job, &revision]() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    absl::StatusOr<JobRecord*> record = FindRecord(job);
    return !record.ok() || (*record)->revision > revision;
  };
  mutex_.AwaitWithTimeout(absl::Condition(&newer), timeout);
  absl::StatusOr<JobRecord*> record = FindRecord(job);
  if (!record.ok()) return record.status();
  revision = (*record)->revision;
  return (*record)->progress;
}

bool State::WaitAllEnded(absl::Duration timeout) const {
  absl::MutexLock lock(&mutex_);
  auto ended = [this]() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    return std::none_of(jobs_.begin(), jobs_.end(), [](const auto& j) { return Running(j.second->job); });
  };
  return mutex_.AwaitWithTimeout(absl::Condition(&ended), timeout);
}

}  // namespace ndmap::coordinator

// SPDX-License-Identifier: GPL-3.0-or-later
// Runs jobs, each on a thread of its own: phase after phase, start on every block, wait for quiescence,
// finish. It knows no algorithm.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"
#include "coordinator/fan_out.h"
#include "coordinator/state.h"

namespace ndmap::coordinator {

struct RunnerOptions {
  // Without progress for this long (no message, no step of work) a job has failed.
  absl::Duration stall_timeout = absl::Seconds(60);
};

// Of a job that makes its map.
struct Creation {
  // The blocks are made first.
  bool create = false;
  // From the pieces of this upload, when the map is made from a mesh.
  uint64_t upload = 0;
};

class JobRunner {
 public:
  JobRunner(State* state, RunnerOptions options) : state_(state), options_(options) {}
  ~JobRunner();

  // Begins to run a job of the state.
  void Begin(const v1::Job& job, const Creation& creation = {});
  // Frees a map's blocks on its servers; servers that are gone do not matter.
  void DropMap(const v1::Map& map);
  // Fails the jobs that are running and joins all threads.
  void Stop();

 private:
  struct Run;

  void RunJob(const v1::Job& job, const Creation& creation);
  absl::Status RunPhases(Run& run, bool* cancelled);
  absl::Status CreateBlocks(Run& run);
  absl::Status RunPhase(Run& run, uint32_t index, v1::PhaseResult& result);
  absl::Status AwaitQuiescence(Run& run, const v1::PhaseKey& key, v1::PhaseResult& result);
  absl::Status StalledStatus(const Run& run, const std::vector<v1::PollPhaseResponse>& answers) const;
  std::vector<Target> Targets(const v1::Map& map);
  absl::Status Watched(const Target& target);

  State* const state_;
  const RunnerOptions options_;
  Stubs stubs_;
  mutable absl::Mutex mutex_;
  bool stopping_ ABSL_GUARDED_BY(mutex_) = false;
  std::map<uint64_t, std::thread> threads_ ABSL_GUARDED_BY(mutex_);
  // Whose threads have nothing more to do.
  std::vector<uint64_t> ended_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace ndmap::coordinator

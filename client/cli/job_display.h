// SPDX-License-Identifier: GPL-3.0-or-later
// A job as people see it while it runs.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/cli/context.h"
#include "client/cli/progress.h"
#include "client/sdk/client.h"

namespace ndmap::cli {

// "refine level 2", "refine level 4/05" (children 0 and 5), "classify".
std::string PhaseName(const v1::Phase& phase);
// "12,345 refined", "valid": what a phase found, in a few words.
std::string PhaseOutcome(const v1::PhaseResult& result);
// The sum of one count over blocks; 0 if nobody has it.
int64_t CountOf(const v1::Report& report, const std::string& name);

class JobDisplay {
 public:
  // `cells`: hexahedra before the job, if they are all of level 0 and their number is known; otherwise 0, and
  // refinement has no bar.
  JobDisplay(Progress& progress, uint64_t cells) : progress_(progress), cells_(cells) {}

  // Waits for the job, showing its phases, and returns it however it ended; StatusOf() tells.
  absl::StatusOr<v1::Job> Wait(const JobHandle& job);

 private:
  void Show(const v1::JobProgress& now, const JobHandle& job);
  // Ends the lines of phases that have ended since the last call.
  void EndPhases(const v1::Job& job);

  Progress& progress_;
  uint64_t cells_;
  uint32_t shown_ = 0;       // Phases whose lines have ended.
  bool phase_open_ = false;  // Phase `shown_` has a line.
  std::vector<std::string> names_;
};

// Starts a job and waits for it, showing its progress. While it runs, a Ctrl-C cancels it and waits for its
// safe end. The job's own error if it failed, CANCELLED with what that means if it was cancelled.
absl::StatusOr<v1::Job> RunJob(Context& context, const MapHandle& map, const std::string& kind,
                               const std::vector<v1::Phase>& phases);
// The same for a job that has been started.
absl::StatusOr<v1::Job> WatchJob(Context& context, const JobHandle& job, bool cancel_on_interrupt);

}  // namespace ndmap::cli

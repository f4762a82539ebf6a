// SPDX-License-Identifier: GPL-3.0-or-later
// Who may read and write the attributes of a map when, on one server. At the server of block 0 parts of
// writes go one at a time, and none while the phase "attributes" runs: it begins when the part under way has
// come to its end on all servers. What parts do to the blocks of a server goes one at a time there, too, and
// not while the phase works. Reads learn whether such a phase came between.
#pragma once

#include <cstdint>
#include <functional>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"

namespace ndmap::server {

// ABORTED: the answer to a question between whose parts the phase "attributes" ran, or one that changed a map
// whose cells have no attributes.
absl::Status AttributesChanged();

class AttributeGates {
 public:
  // --- At the server of block 0. ---

  // Begins a part when those before it have ended, and settles what is not settled. ABORTED: the phase
  // "attributes" runs, and did not end while this waited. EndPart() follows when it is OK.
  absl::Status BeginPart();
  void EndPart();
  // A number for what a part does; higher than any before, also of an earlier life of this server.
  uint64_t NextSequence();
  // Between BeginPart() and EndPart(): the part may have reached some blocks and not others. `again` brings
  // it to all of them; it is called before the next part and before the phase "attributes", until it is OK.
  // So that blocks never differ in what a phase makes of their values.
  void SetUnsettled(std::function<absl::Status()> again);

  // --- On each server. ---

  // Begins to apply a part to the blocks here. ABORTED as BeginPart(). EndApply() follows when it is OK.
  absl::Status BeginApply();
  void EndApply();

  // The number of the job that last brought the attributes up to date. ABORTED while one does, and did not
  // end for `patience`.
  absl::StatusOr<uint64_t> Update(absl::Duration patience = absl::ZeroDuration());

  // --- The phase "attributes". ---

  // Waits for the part under way. Reads are ABORTED from now on. Returns what settling says.
  absl::Status BeginPhase();
  // Waits for what is still being applied.
  void RunPhase();
  // `job`: whose phase it was; 0 when it was abandoned. Also without BeginPhase().
  void EndPhase(uint64_t job);

 private:
  absl::Status Settle();

  absl::Mutex mutex_;
  bool in_phase_ ABSL_GUARDED_BY(mutex_) = false;
  bool working_ ABSL_GUARDED_BY(mutex_) = false;
  bool part_ ABSL_GUARDED_BY(mutex_) = false;
  bool apply_ ABSL_GUARDED_BY(mutex_) = false;
  uint64_t update_ ABSL_GUARDED_BY(mutex_) = 0;
  uint64_t last_sequence_ ABSL_GUARDED_BY(mutex_) = 0;
  // Used by who has begun a part, or by the phase when no part is under way.
  std::function<absl::Status()> unsettled_;
};

}  // namespace ndmap::server

// SPDX-License-Identifier: Apache-2.0
// Long work on a map: watched, waited for, cancelled.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "ndmap/v1/coordinator.pb.h"

namespace ndmap {

namespace internal {
class Connection;
}

// Whether a job in this state works no more.
bool HasEnded(v1::JobState state);

// OK for a job that is done; CANCELLED, or the job's own error, naming the job, otherwise.
absl::Status StatusOf(const v1::Job& job);

// A job of a cluster, by its number. Cheap to copy; all its functions may be called from any thread.
class JobHandle {
 public:
  using ProgressCallback = std::function<void(const v1::JobProgress&)>;

  JobHandle(std::shared_ptr<internal::Connection> connection, uint64_t job)
      : connection_(std::move(connection)), job_(job) {}

  uint64_t id() const { return job_; }

  // The job as it is now, with the results of the phases that have ended.
  absl::StatusOr<v1::Job> Get() const;

  // Returns when the job has ended, however it ended (StatusOf). `progress` is called from this thread, at
  // once and then at most once in `interval`. The watch goes on when the connection was lost for a moment;
  // an error means that the coordinator does not answer or does not know the job.
  absl::StatusOr<v1::Job> Wait(const ProgressCallback& progress = nullptr,
                               absl::Duration interval = absl::Milliseconds(100)) const;

  // Asks the job to stop at the next safe place; the map stays valid. Does not wait.
  absl::Status Cancel() const;

 private:
  // One stream of progress; OK when it said that the job has ended.
  absl::Status Watch(const ProgressCallback& progress, absl::Duration interval, bool* heard) const;

  std::shared_ptr<internal::Connection> connection_;
  uint64_t job_;
};

}  // namespace ndmap

// SPDX-License-Identifier: Apache-2.0
#include "client/sdk/job.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "client/sdk/connection.h"

namespace ndmap {
namespace {

// A watch is begun anew after this time, so that no call is without a deadline.
constexpr absl::Duration kWatchTimeout = absl::Minutes(5);
// Between questions about a job that cannot be watched.
constexpr absl::Duration kAskAgain = absl::Milliseconds(500);

}  // namespace

bool HasEnded(v1::JobState state) {
  return state == v1::JOB_STATE_DONE || state == v1::JOB_STATE_CANCELLED || state == v1::JOB_STATE_FAILED;
}

absl::Status StatusOf(const v1::Job& job) {
  switch (job.state()) {
    case v1::JOB_STATE_DONE:
      return absl::OkStatus();
    case v1::JOB_STATE_CANCELLED:
      return absl::CancelledError(absl::StrCat("job ", job.job(), " (", job.kind(), ") was cancelled"));
    case v1::JOB_STATE_FAILED:
      return absl::AbortedError(absl::StrCat("job ", job.job(), " (", job.kind(), ") failed: ", job.error()));
    default:
      return absl::UnavailableError(absl::StrCat("job ", job.job(), " (", job.kind(), ") is still running"));
  }
}

absl::StatusOr<v1::Job> JobHandle::Get() const {
  v1::GetJobRequest request;
  request.set_job(job_);
  v1::GetJobResponse response;
  absl::Status status =
      internal::CallIdempotent(connection_->coordinator(), &v1::Coordinator::Stub::GetJob, request, &response,
                               connection_->options(), connection_->coordinator_name());
  if (!status.ok()) return status;
  return std::move(*response.mutable_job());
}

absl::Status JobHandle::Cancel() const {
  v1::CancelJobRequest request;
  request.set_job(job_);
  v1::CancelJobResponse response;
  return internal::CallIdempotent(connection_->coordinator(), &v1::Coordinator::Stub::CancelJob, request,
                                  &response, connection_->options(), connection_->coordinator_name());
}

absl::Status JobHandle::Watch(const ProgressCallback& progress, absl::Duration interval, bool* heard) const {
  grpc::ClientContext context;
  internal::SetDeadline(context, kWatchTimeout);
  v1::WatchJobRequest request;
  request.set_job(job_);
  request.set_interval_milliseconds(static_cast<uint32_t>(absl::ToInt64Milliseconds(interval)));
  auto stream = connection_->coordinator().WatchJob(&context, request);
  v1::WatchJobResponse response;
  bool ended = false;
  while (stream->Read(&response)) {
    *heard = true;
    if (progress) progress(response.progress());
    ended = HasEnded(response.progress().state());
  }
  absl::Status status = internal::FromGrpc(stream->Finish(), connection_->coordinator_name());
  if (ended) return absl::OkStatus();
  return status.ok() ? absl::UnavailableError("the watch ended before the job") : status;
}

absl::StatusOr<v1::Job> JobHandle::Wait(const ProgressCallback& progress, absl::Duration interval) const {
  const ClientOptions& options = connection_->options();
  absl::Duration pause = options.first_pause;
  for (int failures = 0;;) {
    bool heard = false;
    absl::Status status = Watch(progress, interval, &heard);
    if (status.ok()) return Get();
    if (absl::IsResourceExhausted(status)) {
      // Too many are watching. The job goes on all the same, and is asked for now and then.
      absl::StatusOr<v1::Job> job = Get();
      if (!job.ok() || HasEnded(job->state())) return job;
      absl::SleepFor(kAskAgain);
      continue;
    }
    if (!absl::IsUnavailable(status) && !absl::IsDeadlineExceeded(status)) return status;
    if (heard) {
      failures = 0;
      pause = options.first_pause;
    }
    if (++failures >= options.attempts) return status;
    absl::SleepFor(pause);
    pause *= 2;
  }
}

}  // namespace ndmap

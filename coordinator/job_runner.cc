// SPDX-License-Identifier: GPL-3.0-or-later
#include "coordinator/job_runner.h"

#include <spdlog/spdlog.h>

#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "coordinator/phase_result.h"
#include "coordinator/quiescence.h"
#include "service/guarded.h"
#include "service/surface_transfer.h"

namespace ndmap::coordinator {
namespace {

using Async = v1::BlockService::StubInterface::async_interface;

// A server answers a poll when its blocks are idle, at the latest after this time: so often progress is seen,
// and so long a cancel may wait.
constexpr uint32_t kPollMilliseconds = 50;
// Between waves when all blocks are idle but messages are under way: doubled up to the last.
constexpr absl::Duration kFirstPause = absl::Microseconds(200);
constexpr absl::Duration kLastPause = absl::Milliseconds(50);
// A server that gets a phase ready answers a cancel at once.
constexpr absl::Duration kCancelDeadline = absl::Seconds(1);

}  // namespace

struct JobRunner::Run {
  // Whether a phase was ever released.
  bool changed = false;
  v1::Job job;
  v1::Map map;
  Creation creation;
  std::vector<Target> targets;
  Watch watch;

  v1::PhaseKey Key(uint32_t phase) const {
    v1::PhaseKey key;
    key.set_map(job.map());
    key.set_job(job.job());
    key.set_attempt(1);
    key.set_phase(phase);
    return key;
  }
  // Half of that phase would be of no use to anybody: it goes on to its end, and the job is not called
  // cancelled for it.
  static bool MayCancel(const v1::Phase& phase) { return phase.algorithm() != kAttributesAlgorithm; }
  template <class Request>
  std::vector<Request> ForAll(const Request& request) const {
    return std::vector<Request>(targets.size(), request);
  }
};

JobRunner::~JobRunner() { Stop(); }

void JobRunner::Begin(const v1::Job& job, const Creation& creation) {
  std::vector<std::thread> over;
  {
    absl::MutexLock lock(&mutex_);
    for (uint64_t number : ended_) {
      over.push_back(std::move(threads_[number]));
      threads_.erase(number);
    }
    ended_.clear();
    absl::Status begun = service::Guarded([&]() -> absl::Status {
      if (!stopping_) threads_[job.job()] = std::thread([this, job, creation] { RunJob(job, creation); });
      return absl::OkStatus();
    });
    if (!begun.ok()) state_->EndJob(job.job(), begun, false, false);
  }
  // Stop() may have taken them.
  for (std::thread& thread : over) {
    if (thread.joinable()) thread.join();
  }
}

void JobRunner::Stop() {
  std::map<uint64_t, std::thread> threads;
  {
    absl::MutexLock lock(&mutex_);
    stopping_ = true;
    threads.swap(threads_);
  }
  for (auto& [number, thread] : threads) {
    if (thread.joinable()) thread.join();
  }
}

absl::Status JobRunner::Watched(const Target& target) {
  {
    absl::MutexLock lock(&mutex_);
    if (stopping_) return absl::AbortedError("the coordinator is stopping");
  }
  return state_->CheckServer(target.server_id, target.incarnation);
}

std::vector<Target> JobRunner::Targets(const v1::Map& map) {
  std::map<uint32_t, Target> by_server;
  for (const v1::BlockPlacement& placement : map.blocks()) {
    Target& target = by_server[placement.server_id()];
    if (target.stub != nullptr) continue;
    target = {placement.server_id(), placement.incarnation(), placement.address(),
              stubs_.Get(placement.address())};
  }
  std::vector<Target> result;
  for (auto& [id, target] : by_server) result.push_back(std::move(target));
  return result;
}

void JobRunner::DropMap(const v1::Map& map) {
  const std::vector<Target> targets = Targets(map);
  v1::DropMapRequest request;
  request.set_map(map.map());
  request.set_map_number(map.number());
  std::vector<v1::DropMapResponse> responses;
  absl::Status status = CallAll<v1::DropMapRequest, v1::DropMapResponse>(
      targets, std::vector<v1::DropMapRequest>(targets.size(), request), &responses, &Async::DropMap,
      [this](const Target& target) { return Watched(target); });
  // A server that was lost and is heard of again is told then.
  if (!status.ok() && !absl::IsNotFound(status))
    spdlog::warn("dropping map \"{}\": {}", map.map(), std::string(status.message()));
}

void JobRunner::RunJob(const v1::Job& job, const Creation& creation) {
  bool cancelled = false;
  bool changed = false;
  const absl::Status status = service::Guarded([&]() -> absl::Status {
    Run run;
    run.job = job;
    run.creation = creation;
    run.watch = [this](const Target& target) { return Watched(target); };
    absl::Status over = service::Guarded([&] { return RunPhases(run, &cancelled); });
    changed = run.changed;
    return over;
  });
  if (status.ok()) {
    spdlog::info("job {} ({}) of map \"{}\" {}", job.job(), job.kind(), job.map(),
                 cancelled ? "cancelled" : "done");
  } else {
    spdlog::warn("job {} ({}) of map \"{}\" failed: {}", job.job(), job.kind(), job.map(),
                 std::string(status.message()));
  }
  service::Guarded([&]() -> absl::Status {
    state_->EndJob(job.job(), status, cancelled, changed);
    absl::MutexLock lock(&mutex_);
    ended_.push_back(job.job());
    return absl::OkStatus();
  }).IgnoreError();
}

absl::Status JobRunner::RunPhases(Run& run, bool* cancelled) {
  absl::StatusOr<v1::Map> map = state_->FindMap(run.job.map());
  if (!map.ok()) return map.status();
  run.map = *std::move(map);
  run.targets = Targets(run.map);
  for (const Target& target : run.targets) {
    if (absl::Status status = Watched(target); !status.ok()) return status;
  }
  if (run.creation.create) {
    if (absl::Status status = CreateBlocks(run); !status.ok()) return status;
  }
  for (int i = 0; i < run.job.phases_size(); ++i) {
    // What a cancelled job has changed has new cells, too.
    const bool needed = run.changed && !Run::MayCancel(run.job.phases(i));
    if (!needed && state_->CancelRequested(run.job.job())) {
      *cancelled = true;
      continue;
    }
    v1::PhaseResult result;
    *result.mutable_phase() = run.job.phases(i);
    const absl::Time begin = absl::Now();
    absl::Status status = RunPhase(run, static_cast<uint32_t>(i), result);
    result.set_wall_seconds(absl::ToDoubleSeconds(absl::Now() - begin));
    if (!status.ok()) {
      v1::CancelPhaseRequest abandon;
      *abandon.mutable_key() = run.Key(static_cast<uint32_t>(i));
      abandon.set_abandon(true);
      std::vector<v1::CancelPhaseResponse> responses;
      CallAll<v1::CancelPhaseRequest, v1::CancelPhaseResponse>(run.targets, run.ForAll(abandon), &responses,
                                                               &Async::CancelPhase, run.watch)
          .IgnoreError();
      return absl::Status(status.code(), absl::StrCat("phase ", i, " (", run.job.phases(i).algorithm(),
                                                      "): ", status.message()));
    }
    if (result.cancelled()) *cancelled = true;
    state_->AddResult(run.job.job(), static_cast<uint32_t>(i), std::move(result));
  }
  return absl::OkStatus();
}

absl::Status JobRunner::CreateBlocks(Run& run) {
  std::vector<v1::CreateBlocksRequest> requests(run.targets.size());
  for (size_t i = 0; i < requests.size(); ++i) {
    requests[i].set_map(run.map.map());
    requests[i].set_block_count(run.map.block_count());
    requests[i].set_routing(run.map.routing());
    requests[i].set_surface_id(run.map.surface_id());
    if (run.map.has_grid()) *requests[i].mutable_grid() = run.map.grid();
    if (run.map.has_mesh()) {
      *requests[i].mutable_mesh() = run.map.mesh();
      requests[i].set_upload(run.creation.upload);
    }
    requests[i].set_map_number(run.map.number());
    for (const v1::BlockPlacement& placement : run.map.blocks()) {
      if (placement.server_id() == run.targets[i].server_id) requests[i].add_blocks(placement.block());
    }
  }
  std::vector<v1::CreateBlocksResponse> responses;
  if (!run.map.surface_id().empty()) {
    absl::StatusOr<State::Surface> surface = state_->FindSurface(run.map.surface_id());
    if (!surface.ok()) return surface.status();
    for (const Target& target : run.targets) {
      grpc::ClientContext context;
      v1::PutSurfaceResponse response;
      auto writer = target.stub->PutSurface(&context, &response);
      absl::Status lost;
      service::SendSurface(*surface->content, run.map.surface_id(), surface->name,
                           [&](const v1::SurfaceChunk& chunk) {
                             lost = Watched(target);
                             if (!lost.ok()) context.TryCancel();
                             return lost.ok() && writer->Write(chunk);
                           });
      writer->WritesDone();
      const absl::Status status = service::FromGrpc(writer->Finish());
      if (!lost.ok()) return lost;
      if (!status.ok()) {
        return absl::Status(status.code(),
                            absl::StrCat("sending the surface to ", target.Name(), ": ", status.message()));
      }
    }
  }
  return CallAll(run.targets, requests, &responses,
                 Method<v1::CreateBlocksRequest, v1::CreateBlocksResponse>(&Async::CreateBlocks), run.watch);
}

absl::Status JobRunner::RunPhase(Run& run, uint32_t index, v1::PhaseResult& result) {
  const v1::PhaseKey key = run.Key(index);
  state_->SetProgress(run.job.job(), index, result.phase().algorithm(), {});
  v1::StartPhaseRequest start;
  *start.mutable_key() = key;
  *start.mutable_phase() = result.phase();
  *start.mutable_placement() = run.map.blocks();
  std::vector<v1::StartPhaseResponse> started;
  // Getting ready may take long; a server that has not begun to does not know the phase yet, and is told
  // again.
  const bool may_cancel = Run::MayCancel(result.phase());
  const Watch watch = [this, &run, &key, may_cancel](const Target& target) {
    if (may_cancel && state_->CancelRequested(run.job.job())) {
      v1::CancelPhaseRequest cancel;
      *cancel.mutable_key() = key;
      v1::CancelPhaseResponse response;
      grpc::ClientContext context;
      context.set_deadline(absl::ToChronoTime(absl::Now() + kCancelDeadline));
      target.stub->CancelPhase(&context, cancel, &response);
    }
    return run.watch(target);
  };
  // Its start already changes lists of attributes.
  if (!may_cancel) run.changed = true;
  absl::Status status = CallAll<v1::StartPhaseRequest, v1::StartPhaseResponse>(
      run.targets, run.ForAll(start), &started, &Async::StartPhase, watch);
  if (!status.ok()) return status;

  // Until now algorithms were only made: a wrong parameter harms nothing.
  run.changed = true;
  v1::RunPhaseRequest go;
  *go.mutable_key() = key;
  std::vector<v1::RunPhaseResponse> going;
  status = CallAll<v1::RunPhaseRequest, v1::RunPhaseResponse>(run.targets, run.ForAll(go), &going,
                                                              &Async::RunPhase, run.watch);
  if (!status.ok()) return status;
  if (status = AwaitQuiescence(run, key, result); !status.ok()) return status;

  v1::FinishPhaseRequest finish;
  *finish.mutable_key() = key;
  std::vector<v1::FinishPhaseResponse> finished;
  status = CallAll<v1::FinishPhaseRequest, v1::FinishPhaseResponse>(
      run.targets, run.ForAll(finish), &finished, &Async::FinishPhase, run.watch);
  if (!status.ok()) return status;
  Summarise(started, std::move(finished), result);
  return absl::OkStatus();
}

absl::Status JobRunner::AwaitQuiescence(Run& run, const v1::PhaseKey& key, v1::PhaseResult& result) {
  v1::PollPhaseRequest poll;
  *poll.mutable_key() = key;
  poll.set_wait_milliseconds(kPollMilliseconds);
  Quiescence quiescence;
  absl::Duration pause = kFirstPause;
  absl::Time last_progress = absl::Now();
  uint64_t done_before = 0;
  while (true) {
    const bool may_cancel = Run::MayCancel(result.phase()) && !result.cancelled();
    if (may_cancel && state_->CancelRequested(run.job.job())) {
      result.set_cancelled(true);
      v1::CancelPhaseRequest cancel;
      *cancel.mutable_key() = key;
      std::vector<v1::CancelPhaseResponse> responses;
      absl::Status status = CallAll<v1::CancelPhaseRequest, v1::CancelPhaseResponse>(
          run.targets, run.ForAll(cancel), &responses, &Async::CancelPhase, run.watch);
      if (!status.ok()) return status;
    }
    std::vector<v1::PollPhaseResponse> answers;
    absl::Status status = CallAll<v1::PollPhaseRequest, v1::PollPhaseResponse>(
        run.targets, run.ForAll(poll), &answers, &Async::PollPhase, run.watch);
    if (!status.ok()) return status;
    Quiescence::Wave wave{true, 0, 0};
    uint64_t done = 0;
    std::vector<v1::BlockProgress> blocks;
    for (v1::PollPhaseResponse& answer : answers) {
      if (!answer.error().empty()) {
        return absl::Status(static_cast<absl::StatusCode>(answer.error_code()),
                            absl::StrCat("block ", answer.error_block(), ": ", answer.error()));
      }
      for (const v1::BlockProgress& block : answer.blocks()) {
        wave.all_idle = wave.all_idle && block.idle();
        wave.sent += block.messages_sent();
        wave.received += block.messages_received();
        done += block.messages_sent() + block.messages_received() + block.steps();
        blocks.push_back(block);
      }
    }
    state_->SetProgress(run.job.job(), key.phase(), result.phase().algorithm(), std::move(blocks));
    if (quiescence.Add(wave)) return absl::OkStatus();
    for (const Target& target : run.targets) {
      if (status = Watched(target); !status.ok()) return status;
    }
    const absl::Time now = absl::Now();
    if (done != done_before) {
      done_before = done;
      last_progress = now;
      pause = kFirstPause;
    } else if (now - last_progress > options_.stall_timeout) {
      return StalledStatus(run, answers);
    }
    // The poll itself waits while a block works; only messages under way are waited for here.
    if (wave.all_idle && !quiescence.MaybeOver()) {
      absl::SleepFor(pause);
      pause = std::min(pause * 2, kLastPause);
    }
  }
}

absl::Status JobRunner::StalledStatus(const Run& run,
                                      const std::vector<v1::PollPhaseResponse>& answers) const {
  uint64_t sent = 0, received = 0;
  std::vector<std::string> stuck, broken;
  for (size_t i = 0; i < answers.size(); ++i) {
    for (const v1::BlockProgress& block : answers[i].blocks()) {
      sent += block.messages_sent();
      received += block.messages_received();
      if (block.idle() && block.outstanding_bytes() == 0) continue;
      stuck.push_back(absl::StrCat("block ", block.block(), " on ", run.targets[i].Name(),
                                   block.idle() ? " is idle" : " is not idle", " with ",
                                   block.messages_sent(), " messages sent, ", block.messages_received(),
                                   " received and ", block.outstanding_bytes(), " bytes not taken in"));
    }
    for (const std::string& why : answers[i].broken_streams()) {
      broken.push_back(absl::StrCat("the stream from ", run.targets[i].Name(), " ", why));
    }
  }
  return absl::DeadlineExceededError(
      absl::StrCat("no progress for ", absl::FormatDuration(options_.stall_timeout), ": ", sent,
                   " messages sent, ", received, " received", stuck.empty() ? "" : "; ",
                   absl::StrJoin(stuck, "; "), broken.empty() ? "" : "; ", absl::StrJoin(broken, "; ")));
}

}  // namespace ndmap::coordinator

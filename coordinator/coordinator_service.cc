// SPDX-License-Identifier: GPL-3.0-or-later
#include "coordinator/coordinator_service.h"

#include <algorithm>
#include <utility>

#include "absl/cleanup/cleanup.h"
#include "absl/strings/str_cat.h"
#include "coordinator/create_map.h"
#include "coordinator/placement.h"
#include "service/names.h"
#include "service/process_stats.h"
#include "service/status.h"
#include "service/surface_transfer.h"
#include "service/version.h"

namespace ndmap::coordinator {

using service::ToGrpc;

namespace {

constexpr char kProgram[] = "ndmap-coordinator";
constexpr int kMaxPhases = 64;
constexpr int kMaxParameters = 256;
constexpr size_t kMaxParameterBytes = 8 << 20;

absl::Status CheckBlockCount(uint32_t blocks) {
  if (blocks >= 1 && blocks <= service::kMaxBlocks) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("a map of ", blocks, " blocks; 1 to ", service::kMaxBlocks, " are allowed"));
}

absl::Status CheckPhase(const v1::Phase& phase) {
  if (absl::Status status = service::CheckName("algorithm", phase.algorithm()); !status.ok()) return status;
  if (phase.parameters_size() > kMaxParameters) {
    return absl::InvalidArgumentError(
        absl::StrCat(phase.parameters_size(), " parameters; at most ", kMaxParameters));
  }
  size_t bytes = 0;
  for (const auto& [name, value] : phase.parameters()) {
    if (absl::Status status = service::CheckName("parameter", name); !status.ok()) return status;
    bytes += value.size();
  }
  if (bytes <= kMaxParameterBytes) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("parameters of ", bytes, " bytes; at most ", kMaxParameterBytes));
}

}  // namespace

grpc::Status CoordinatorServiceImpl::GetVersion(grpc::ServerContext*, const v1::GetVersionRequest* request,
                                                v1::GetVersionResponse* response) {
  *response->mutable_version() = service::MakeVersion(kProgram);
  if (!request->has_caller()) return grpc::Status::OK;
  return ToGrpc(service::CheckVersion(response->version(), request->caller()));
}

grpc::Status CoordinatorServiceImpl::GetProcessStats(grpc::ServerContext*, const v1::GetProcessStatsRequest*,
                                                     v1::GetProcessStatsResponse* response) {
  *response->mutable_stats() = service::ReadProcessStats(kProgram, address_);
  return grpc::Status::OK;
}

grpc::Status CoordinatorServiceImpl::RegisterServer(grpc::ServerContext* context,
                                                    const v1::RegisterServerRequest* request,
                                                    v1::RegisterServerResponse* response) {
  const v1::Version own = service::MakeVersion(kProgram);
  if (absl::Status s = service::CheckVersion(own, request->version()); !s.ok()) return ToGrpc(s);
  if (absl::Status s = service::CheckAddress(request->address()); !s.ok()) return ToGrpc(s);
  // The answer has as much time to arrive before the caller's patience ends.
  const absl::Time now = absl::Now(), patience = absl::FromChrono(context->deadline());
  absl::StatusOr<v1::RegisterServerResponse> registered = state_->RegisterWhenFree(
      *request, now + (patience - now) / 2, [this, context] { return stopping_ || context->IsCancelled(); });
  if (!registered.ok()) return ToGrpc(registered.status());
  *response = *std::move(registered);
  *response->mutable_version() = own;
  return grpc::Status::OK;
}

grpc::Status CoordinatorServiceImpl::UnregisterServer(grpc::ServerContext*,
                                                      const v1::UnregisterServerRequest* request,
                                                      v1::UnregisterServerResponse*) {
  return ToGrpc(state_->Unregister(request->server_id(), request->incarnation()));
}

grpc::Status CoordinatorServiceImpl::Heartbeat(grpc::ServerContext*, const v1::HeartbeatRequest* request,
                                               v1::HeartbeatResponse* response) {
  return ToGrpc(state_->Heartbeat(*request, response));
}

grpc::Status CoordinatorServiceImpl::ListServers(grpc::ServerContext*, const v1::ListServersRequest*,
                                                 v1::ListServersResponse* response) {
  for (v1::Server& server : state_->Servers()) *response->add_servers() = std::move(server);
  return grpc::Status::OK;
}

grpc::Status CoordinatorServiceImpl::UploadSurface(grpc::ServerContext*,
                                                   grpc::ServerReader<v1::SurfaceChunk>* reader,
                                                   v1::UploadSurfaceResponse* response) {
  const service::Places::Place place(uploads_);
  if (!place.taken()) {
    return ToGrpc(absl::ResourceExhaustedError(
        absl::StrCat("the coordinator is receiving ", uploads_.most(),
                     " surfaces, the most at one time (--max-uploads): send it again later")));
  }
  service::SurfaceReceiver receiver(max_surface_bytes_);
  v1::SurfaceChunk chunk;
  while (reader->Read(&chunk)) {
    if (absl::Status status = receiver.Add(chunk); !status.ok()) return ToGrpc(status);
  }
  if (absl::Status status = receiver.Finish(); !status.ok()) return ToGrpc(status);
  response->set_surface_id(receiver.id());
  return ToGrpc(state_->AddSurface(receiver.id(), receiver.name(), receiver.Take()));
}

grpc::Status CoordinatorServiceImpl::DeleteSurface(grpc::ServerContext*,
                                                   const v1::DeleteSurfaceRequest* request,
                                                   v1::DeleteSurfaceResponse*) {
  return ToGrpc(state_->DeleteSurface(request->surface_id()));
}

grpc::Status CoordinatorServiceImpl::PlaceBlocks(grpc::ServerContext*, const v1::PlaceBlocksRequest* request,
                                                 v1::PlaceBlocksResponse* response) {
  if (absl::Status status = CheckBlockCount(request->block_count()); !status.ok()) return ToGrpc(status);
  absl::StatusOr<std::vector<v1::BlockPlacement>> placement =
      Place(request->block_count(), state_->Servers());
  if (!placement.ok()) return ToGrpc(placement.status());
  for (v1::BlockPlacement& block : *placement) *response->add_blocks() = std::move(block);
  response->set_upload(state_->NewNumber());
  return grpc::Status::OK;
}

absl::StatusOr<v1::Job> CoordinatorServiceImpl::Create(const v1::CreateMapRequest& request) {
  if (absl::Status status = service::CheckName("map", request.map()); !status.ok()) return status;
  if (absl::Status status = CheckBlockCount(request.block_count()); !status.ok()) return status;
  if (absl::StatusOr<v1::Map> there = state_->FindMap(request.map()); there.ok()) {
    return absl::AlreadyExistsError(absl::StrCat("there is a map \"", request.map(), "\" already"));
  }
  State::Surface surface;
  if (!request.surface_id().empty()) {
    absl::StatusOr<State::Surface> found = state_->FindSurface(request.surface_id());
    if (!found.ok()) return found.status();
    surface = *std::move(found);
  }
  const uint32_t blocks = request.block_count();
  absl::StatusOr<std::vector<v1::BlockPlacement>> placement =
      request.has_mesh() ? CheckPlacement(request.mesh().blocks(), blocks, state_->Servers())
                         : Place(blocks, state_->Servers());
  if (!placement.ok()) return placement.status();
  absl::StatusOr<std::pair<v1::Map, v1::Phase>> plan = PlanMap(request, surface.content.get());
  if (!plan.ok()) return plan.status();
  auto& [map, build] = *plan;
  if (absl::Status status = CheckPhase(build); !status.ok()) return status;
  if (absl::StatusOr<AlgorithmInfo> info = find_algorithm_(build.algorithm()); !info.ok())
    return info.status();
  for (v1::BlockPlacement& block : *placement) *map.add_blocks() = std::move(block);
  absl::StatusOr<v1::Job> job = state_->AddMap(std::move(map), std::move(build));
  if (job.ok()) runner_->Begin(*job, {true, request.mesh().upload()});
  return job;
}

absl::StatusOr<v1::Job> CoordinatorServiceImpl::Start(const v1::StartJobRequest& request) {
  if (absl::Status status = service::CheckName("map", request.map()); !status.ok()) return status;
  if (absl::Status status = service::CheckName("job's kind", request.kind()); !status.ok()) return status;
  if (request.phases_size() < 1 || request.phases_size() > kMaxPhases) {
    return absl::InvalidArgumentError(
        absl::StrCat("a job of ", request.phases_size(), " phases; 1 to ", kMaxPhases, " are allowed"));
  }
  bool changes_map = false;
  for (const v1::Phase& phase : request.phases()) {
    if (absl::Status status = CheckPhase(phase); !status.ok()) return status;
    if (phase.algorithm() == kAttributesAlgorithm) {
      return absl::InvalidArgumentError(
          "\"attributes\" is not for StartJob: DefineAttribute and DropAttribute run it, and it ends every "
          "job "
          "that changes a map with attributes");
    }
    absl::StatusOr<AlgorithmInfo> info = find_algorithm_(phase.algorithm());
    if (!info.ok()) return info.status();
    changes_map = changes_map || info->changes_map;
  }
  absl::StatusOr<v1::Job> job = state_->AddJob(request, changes_map);
  if (job.ok()) runner_->Begin(*job);
  return job;
}

grpc::Status CoordinatorServiceImpl::CreateMap(grpc::ServerContext*, const v1::CreateMapRequest* request,
                                               v1::CreateMapResponse* response) {
  absl::StatusOr<v1::Job> job = Create(*request);
  if (!job.ok()) return ToGrpc(job.status());
  *response->mutable_job() = *std::move(job);
  return grpc::Status::OK;
}

grpc::Status CoordinatorServiceImpl::ListMaps(grpc::ServerContext*, const v1::ListMapsRequest*,
                                              v1::ListMapsResponse* response) {
  for (v1::Map& map : state_->Maps()) *response->add_maps() = std::move(map);
  return grpc::Status::OK;
}

grpc::Status CoordinatorServiceImpl::GetMap(grpc::ServerContext*, const v1::GetMapRequest* request,
                                            v1::GetMapResponse* response) {
  if (absl::Status status = service::CheckName("map", request->map()); !status.ok()) return ToGrpc(status);
  absl::StatusOr<v1::Map> map = state_->FindMap(request->map());
  if (!map.ok()) return ToGrpc(map.status());
  *response->mutable_map() = *std::move(map);
  return grpc::Status::OK;
}

grpc::Status CoordinatorServiceImpl::DeleteMap(grpc::ServerContext*, const v1::DeleteMapRequest* request,
                                               v1::DeleteMapResponse*) {
  if (absl::Status status = service::CheckName("map", request->map()); !status.ok()) return ToGrpc(status);
  absl::StatusOr<v1::Map> map = state_->RemoveMap(request->map());
  if (!map.ok()) return ToGrpc(map.status());
  // Also when an exception ends the call.
  const absl::Cleanup free_name = [&] { state_->FreeName(request->map()); };
  runner_->DropMap(*map);
  return grpc::Status::OK;
}

grpc::Status CoordinatorServiceImpl::DefineAttribute(grpc::ServerContext*,
                                                     const v1::DefineAttributeRequest* request,
                                                     v1::DefineAttributeResponse* response) {
  if (absl::Status status = service::CheckName("map", request->map()); !status.ok()) return ToGrpc(status);
  absl::StatusOr<v1::Job> job = state_->DefineAttribute(request->map(), request->attribute());
  if (!job.ok()) return ToGrpc(job.status());
  runner_->Begin(*job);
  *response->mutable_job() = *std::move(job);
  return grpc::Status::OK;
}

grpc::Status CoordinatorServiceImpl::DropAttribute(grpc::ServerContext*,
                                                   const v1::DropAttributeRequest* request,
                                                   v1::DropAttributeResponse* response) {
  if (absl::Status status = service::CheckName("map", request->map()); !status.ok()) return ToGrpc(status);
  absl::StatusOr<v1::Job> job = state_->DropAttribute(request->map(), request->name());
  if (!job.ok()) return ToGrpc(job.status());
  runner_->Begin(*job);
  *response->mutable_job() = *std::move(job);
  return grpc::Status::OK;
}

grpc::Status CoordinatorServiceImpl::StartJob(grpc::ServerContext*, const v1::StartJobRequest* request,
                                              v1::StartJobResponse* response) {
  absl::StatusOr<v1::Job> job = Start(*request);
  if (!job.ok()) return ToGrpc(job.status());
  *response->mutable_job() = *std::move(job);
  return grpc::Status::OK;
}

grpc::Status CoordinatorServiceImpl::GetJob(grpc::ServerContext*, const v1::GetJobRequest* request,
                                            v1::GetJobResponse* response) {
  absl::StatusOr<v1::Job> job = state_->FindJob(request->job());
  if (!job.ok()) return ToGrpc(job.status());
  *response->mutable_job() = *std::move(job);
  return grpc::Status::OK;
}

grpc::Status CoordinatorServiceImpl::ListJobs(grpc::ServerContext*, const v1::ListJobsRequest* request,
                                              v1::ListJobsResponse* response) {
  if (!request->map().empty()) {
    if (absl::Status status = service::CheckName("map", request->map()); !status.ok()) return ToGrpc(status);
  }
  for (v1::Job& job : state_->Jobs(request->map())) *response->add_jobs() = std::move(job);
  // A map that was deleted is still known by its jobs.
  if (!request->map().empty() && response->jobs().empty())
    return ToGrpc(state_->FindMap(request->map()).status());
  return grpc::Status::OK;
}

grpc::Status CoordinatorServiceImpl::WatchJob(grpc::ServerContext* context,
                                              const v1::WatchJobRequest* request,
                                              grpc::ServerWriter<v1::WatchJobResponse>* writer) {
  const service::Places::Place place(watches_);
  if (!place.taken()) {
    return ToGrpc(absl::ResourceExhaustedError(absl::StrCat(
        watches_.most(),
        " clients are watching jobs, the most at one time (--max-watches): the job goes on, ask for "
        "it or watch it again later")));
  }
  const absl::Duration interval =
      absl::Milliseconds(request->interval_milliseconds() == 0 ? 100 : request->interval_milliseconds());
  // So often the caller's and the coordinator's end are noticed.
  constexpr absl::Duration kLook = absl::Milliseconds(200);
  uint64_t revision = 0, sent = 0;
  absl::Time last = absl::InfinitePast();
  while (!context->IsCancelled()) {
    if (stopping_) return grpc::Status(grpc::StatusCode::UNAVAILABLE, "the coordinator is stopping");
    absl::StatusOr<v1::JobProgress> progress = state_->WaitProgress(request->job(), revision, kLook);
    if (!progress.ok()) return ToGrpc(progress.status());
    const bool ended =
        progress->state() != v1::JOB_STATE_RUNNING && progress->state() != v1::JOB_STATE_CANCELLING;
    if (!ended && revision != sent && absl::Now() - last < interval) {
      // The end does not wait for the interval: it is looked for in small steps.
      absl::SleepFor(std::min(absl::Milliseconds(10), interval - (absl::Now() - last)));
      revision = sent;
      continue;
    }
    if (revision != sent || ended) {
      v1::WatchJobResponse response;
      *response.mutable_progress() = *std::move(progress);
      if (!writer->Write(response)) break;
      last = absl::Now();
      sent = revision;
    }
    if (ended) return grpc::Status::OK;
  }
  return grpc::Status::CANCELLED;
}

grpc::Status CoordinatorServiceImpl::CancelJob(grpc::ServerContext*, const v1::CancelJobRequest* request,
                                               v1::CancelJobResponse* response) {
  absl::StatusOr<v1::Job> job = state_->CancelJob(request->job());
  if (!job.ok()) return ToGrpc(job.status());
  *response->mutable_job() = *std::move(job);
  return grpc::Status::OK;
}

}  // namespace ndmap::coordinator

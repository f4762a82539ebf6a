// SPDX-License-Identifier: GPL-3.0-or-later
// The gRPC face of the coordinator. Every call has a thread of gRPC's and may wait.
#pragma once

#include <atomic>
#include <functional>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "coordinator/job_runner.h"
#include "coordinator/state.h"
#include "core/algorithm/registry.h"
#include "ndmap/v1/coordinator.grpc.pb.h"
#include "service/places.h"

namespace ndmap::coordinator {

// FindAlgorithm of core/algorithm/registry.h, or a test's.
using AlgorithmFinder = std::function<absl::StatusOr<AlgorithmInfo>(absl::string_view name)>;

// Of calls that last, each with the flag of ndmap-coordinator that sets it.
struct ServiceLimits {
  uint32_t max_watches = 256;  // --max-watches
  uint32_t max_uploads = 16;   // --max-uploads; each may hold a surface beside those that are kept
};

class CoordinatorServiceImpl final : public v1::Coordinator::Service {
 public:
  CoordinatorServiceImpl(State* state, JobRunner* runner, AlgorithmFinder find_algorithm,
                         uint64_t max_surface_bytes, const ServiceLimits& limits)
      : state_(state),
        runner_(runner),
        find_algorithm_(std::move(find_algorithm)),
        max_surface_bytes_(max_surface_bytes),
        watches_(limits.max_watches),
        uploads_(limits.max_uploads) {}

  void SetAddress(const std::string& address) { address_ = address; }
  // Ends the calls that watch jobs.
  void Stop() { stopping_ = true; }

  grpc::Status GetVersion(grpc::ServerContext*, const v1::GetVersionRequest*,
                          v1::GetVersionResponse*) override;
  grpc::Status GetProcessStats(grpc::ServerContext*, const v1::GetProcessStatsRequest*,
                               v1::GetProcessStatsResponse*) override;
  grpc::Status RegisterServer(grpc::ServerContext*, const v1::RegisterServerRequest*,
                              v1::RegisterServerResponse*) override;
  grpc::Status UnregisterServer(grpc::ServerContext*, const v1::UnregisterServerRequest*,
                                v1::UnregisterServerResponse*) override;
  grpc::Status Heartbeat(grpc::ServerContext*, const v1::HeartbeatRequest*, v1::HeartbeatResponse*) override;
  grpc::Status ListServers(grpc::ServerContext*, const v1::ListServersRequest*,
                           v1::ListServersResponse*) override;
  grpc::Status UploadSurface(grpc::ServerContext*, grpc::ServerReader<v1::SurfaceChunk>*,
                             v1::UploadSurfaceResponse*) override;
  grpc::Status DeleteSurface(grpc::ServerContext*, const v1::DeleteSurfaceRequest*,
                             v1::DeleteSurfaceResponse*) override;
  grpc::Status PlaceBlocks(grpc::ServerContext*, const v1::PlaceBlocksRequest*,
                           v1::PlaceBlocksResponse*) override;
  grpc::Status CreateMap(grpc::ServerContext*, const v1::CreateMapRequest*, v1::CreateMapResponse*) override;
  grpc::Status ListMaps(grpc::ServerContext*, const v1::ListMapsRequest*, v1::ListMapsResponse*) override;
  grpc::Status GetMap(grpc::ServerContext*, const v1::GetMapRequest*, v1::GetMapResponse*) override;
  grpc::Status DeleteMap(grpc::ServerContext*, const v1::DeleteMapRequest*, v1::DeleteMapResponse*) override;
  grpc::Status DefineAttribute(grpc::ServerContext*, const v1::DefineAttributeRequest*,
                               v1::DefineAttributeResponse*) override;
  grpc::Status DropAttribute(grpc::ServerContext*, const v1::DropAttributeRequest*,
                             v1::DropAttributeResponse*) override;
  grpc::Status StartJob(grpc::ServerContext*, const v1::StartJobRequest*, v1::StartJobResponse*) override;
  grpc::Status GetJob(grpc::ServerContext*, const v1::GetJobRequest*, v1::GetJobResponse*) override;
  grpc::Status ListJobs(grpc::ServerContext*, const v1::ListJobsRequest*, v1::ListJobsResponse*) override;
  grpc::Status WatchJob(grpc::ServerContext*, const v1::WatchJobRequest*,
                        grpc::ServerWriter<v1::WatchJobResponse>*) override;
  grpc::Status CancelJob(grpc::ServerContext*, const v1::CancelJobRequest*, v1::CancelJobResponse*) override;

 private:
  absl::StatusOr<v1::Job> Create(const v1::CreateMapRequest& request);
  absl::StatusOr<v1::Job> Start(const v1::StartJobRequest& request);

  State* const state_;
  JobRunner* const runner_;
  const AlgorithmFinder find_algorithm_;
  const uint64_t max_surface_bytes_;
  service::Places watches_;
  service::Places uploads_;
  std::string address_;
  std::atomic<bool> stopping_ = false;
};

}  // namespace ndmap::coordinator

// SPDX-License-Identifier: GPL-3.0-or-later
// The real services on loopback, in this process, for tests.
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "coordinator/coordinator_server.h"
#include "core/algorithm/registry.h"
#include "core/io/sample_surface.h"
#include "ndmap/v1/block_service.grpc.pb.h"
#include "ndmap/v1/coordinator.grpc.pb.h"
#include "server/block_server.h"
#include "service/channel.h"
#include "service/surface_transfer.h"
#include "tests/service/token_algorithm.h"

namespace ndmap {

// Passes tokens, and says with every slice of work that the block has changed.
class TouchingTokens : public TokenAlgorithm {
 public:
  TouchingTokens(const Environment& environment, const Parameters& parameters, Block3* block)
      : TokenAlgorithm(environment, parameters), block_(block) {}
  absl::StatusOr<size_t> Work(size_t budget, Outbox& out) override {
    block_->Touch();
    return TokenAlgorithm::Work(budget, out);
  }

 private:
  Block3* const block_;
};

// The real algorithms, and two that pass tokens: "token", which counts as changing the map, and "peek", which
// does not.
inline absl::StatusOr<AlgorithmInfo> FindTestAlgorithm(absl::string_view name) {
  if (name == "token") return AlgorithmInfo{"token", true, ""};
  if (name == "peek") return AlgorithmInfo{"peek", false, ""};
  return FindAlgorithm(name);
}

inline absl::StatusOr<std::unique_ptr<BlockAlgorithm>> MakeTestAlgorithm(absl::string_view name,
                                                                         const Parameters& parameters,
                                                                         const Environment& environment,
                                                                         Block3& block) {
  if (name == "token") return std::make_unique<TouchingTokens>(environment, parameters, &block);
  if (name == "peek") return std::make_unique<TokenAlgorithm>(environment, parameters);
  return MakeAlgorithm(name, parameters, environment, block);
}

class Cluster {
 public:
  using Values = std::map<std::string, std::string>;

  explicit Cluster(int servers, coordinator::CoordinatorOptions options = {}, server::HostOptions host = {},
                   server::ServiceOptions service = {}) {
    options.find_algorithm = FindTestAlgorithm;
    coordinator_ = coordinator::CoordinatorServer::Start(std::move(options)).value();
    channel_ = service::MakeChannel(coordinator_->address());
    stub_ = v1::Coordinator::NewStub(channel_);
    for (int i = 0; i < servers; ++i) {
      server::BlockServerOptions o;
      o.coordinator = coordinator_->address();
      o.host = host;
      o.host.factory = MakeTestAlgorithm;
      if (o.host.threads == 0) o.host.threads = 2;
      o.service = service;
      servers_.push_back(server::BlockServer::Start(std::move(o)).value());
    }
  }

  v1::Coordinator::Stub& stub() { return *stub_; }
  coordinator::CoordinatorServer& coordinator() { return *coordinator_; }
  server::BlockServer& server(size_t i) { return *servers_[i]; }
  size_t size() const { return servers_.size(); }
  std::shared_ptr<grpc::Channel> channel() { return channel_; }

  // The stub of the server that has the block.
  std::unique_ptr<v1::BlockService::Stub> ServerOf(const std::string& map, uint32_t block) {
    grpc::ClientContext context;
    v1::GetMapRequest request;
    request.set_map(map);
    v1::GetMapResponse response;
    EXPECT_TRUE(stub_->GetMap(&context, request, &response).ok());
    return v1::BlockService::NewStub(
        service::MakeChannel(response.map().blocks(static_cast<int>(block)).address()));
  }

  grpc::Status Upload(const TriangleSurface& surface, std::string id,
                      const std::function<void(v1::SurfaceChunk&)>& spoil = nullptr) {
    grpc::ClientContext context;
    v1::UploadSurfaceResponse response;
    auto writer = stub_->UploadSurface(&context, &response);
    service::SendSurface(surface, id, "test", [&](const v1::SurfaceChunk& chunk) {
      v1::SurfaceChunk sent = chunk;
      if (spoil) spoil(sent);
      return writer->Write(sent);
    });
    writer->WritesDone();
    return writer->Finish();
  }

  static v1::CreateMapRequest GridRequest(const std::string& map, uint32_t blocks,
                                          uint32_t cells_a_side = 2) {
    v1::CreateMapRequest request;
    request.set_map(map);
    request.set_block_count(blocks);
    for (int i = 0; i < 3; ++i) {
      request.mutable_grid()->add_cells(cells_a_side);
      request.mutable_grid()->add_lo(0);
      request.mutable_grid()->add_hi(cells_a_side);
    }
    return request;
  }
  // Creates a map and waits for it.
  v1::Job Create(const v1::CreateMapRequest& request) {
    grpc::ClientContext context;
    v1::CreateMapResponse response;
    const grpc::Status status = stub_->CreateMap(&context, request, &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return status.ok() ? Await(response.job().job()) : v1::Job();
  }

  grpc::Status Start(const std::string& map, const std::vector<std::pair<std::string, Values>>& phases,
                     uint64_t* job) {
    grpc::ClientContext context;
    v1::StartJobRequest request;
    request.set_map(map);
    request.set_kind(phases.empty() ? "none" : phases[0].first);
    for (const auto& [algorithm, values] : phases) {
      v1::Phase& phase = *request.add_phases();
      phase.set_algorithm(algorithm);
      phase.mutable_parameters()->insert(values.begin(), values.end());
    }
    v1::StartJobResponse response;
    const grpc::Status status = stub_->StartJob(&context, request, &response);
    *job = response.job().job();
    return status;
  }
  v1::Job Run(const std::string& map, const std::vector<std::pair<std::string, Values>>& phases) {
    uint64_t job = 0;
    const grpc::Status status = Start(map, phases, &job);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return Await(job);
  }
  // Watches until `enough` of a progress, or to the end.
  v1::JobProgress Watch(uint64_t job, const std::function<bool(const v1::JobProgress&)>& enough) {
    grpc::ClientContext context;
    v1::WatchJobRequest request;
    request.set_job(job);
    request.set_interval_milliseconds(1);
    auto reader = stub_->WatchJob(&context, request);
    v1::WatchJobResponse response;
    while (reader->Read(&response)) {
      if (enough(response.progress())) context.TryCancel();
    }
    reader->Finish();
    return response.progress();
  }
  v1::Job Await(uint64_t job) {
    Watch(job, [](const v1::JobProgress&) { return false; });
    grpc::ClientContext context;
    v1::GetJobRequest request;
    request.set_job(job);
    v1::GetJobResponse response;
    EXPECT_TRUE(stub_->GetJob(&context, request, &response).ok());
    return response.job();
  }
  // Waits until the job has done some work.
  void AwaitWork(uint64_t job) {
    Watch(job, [](const v1::JobProgress& progress) {
      for (const v1::BlockProgress& block : progress.blocks()) {
        if (block.steps() > 0) return true;
      }
      return false;
    });
  }
  void Cancel(uint64_t job) {
    grpc::ClientContext context;
    v1::CancelJobRequest request;
    request.set_job(job);
    v1::CancelJobResponse response;
    EXPECT_TRUE(stub_->CancelJob(&context, request, &response).ok());
  }

 private:
  std::unique_ptr<coordinator::CoordinatorServer> coordinator_;
  std::vector<std::unique_ptr<server::BlockServer>> servers_;
  std::shared_ptr<grpc::Channel> channel_;
  std::unique_ptr<v1::Coordinator::Stub> stub_;
};

}  // namespace ndmap

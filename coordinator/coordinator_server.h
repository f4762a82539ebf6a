// SPDX-License-Identifier: GPL-3.0-or-later
// A coordinator in a box: what ndmap-coordinator runs, and what tests and local clusters start in their own
// process.
#pragma once

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "coordinator/coordinator_service.h"
#include "coordinator/job_runner.h"
#include "coordinator/state.h"
#include "service/channel.h"

namespace ndmap::coordinator {

struct CoordinatorOptions {
  std::string listen = "127.0.0.1:0";
  StateOptions state;
  RunnerOptions runner;
  ServiceLimits limits;
  AlgorithmFinder find_algorithm = [](absl::string_view name) { return FindAlgorithm(name); };
};

class CoordinatorServer {
 public:
  // Serves when this returns. Errors are one sentence.
  static absl::StatusOr<std::unique_ptr<CoordinatorServer>> Start(CoordinatorOptions options);
  ~CoordinatorServer();

  // Stops serving, fails what is running, ends threads. Twice is no error.
  void Stop();

  const std::string& address() const { return listening_.address; }
  int port() const { return listening_.port; }

 private:
  explicit CoordinatorServer(CoordinatorOptions& options)
      : state_(options.state),
        runner_(&state_, options.runner),
        service_(&state_, &runner_, std::move(options.find_algorithm), options.state.max_surface_bytes,
                 options.limits) {}

  State state_;
  JobRunner runner_;
  CoordinatorServiceImpl service_;
  service::Listening listening_;
};

}  // namespace ndmap::coordinator

// SPDX-License-Identifier: GPL-3.0-or-later
// A cluster of the real services on this machine: one coordinator and some block servers, on the loopback
// interface.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "client/cli/process.h"
#include "client/sdk/client.h"

namespace ndmap::cli {

struct LocalClusterOptions {
  uint32_t servers = 1;
  // Worker threads of each block server.
  uint32_t threads = 1;
  // The coordinator's; 0: any free one.
  uint16_t port = 0;
  // The services' logs go to our standard error; otherwise only the last line of one that fails is shown.
  bool show_logs = false;
  absl::Duration patience = absl::Seconds(20);
};

class LocalCluster {
 public:
  // Starts the services and waits until all block servers have registered. Call it from the main thread
  // (process.h). The error is one sentence: a program that is missing, a port in use, a service's own last
  // words. `children` outlives the cluster; on an error it still has to be stopped.
  static absl::StatusOr<LocalCluster> Start(const LocalClusterOptions& options, ChildProcesses& children);

  // The coordinator's HOST:PORT.
  const std::string& address() const { return client_->target(); }
  Client& client() { return *client_; }
  // Why a service is no longer there, in one sentence; OK while all run.
  absl::Status Check() const;
  // Returns when a service has ended, with what Check() says.
  absl::Status WaitForEnd() const;

 private:
  struct Service {
    std::string name;
    pid_t pid = 0;
    int log = -1;  // A file in memory with its standard error; -1 when that is ours.
  };
  explicit LocalCluster(ChildProcesses& children) : children_(&children) {}
  absl::Status Run(Service& service, std::vector<std::string> arguments, bool show_logs);
  absl::StatusOr<uint16_t> WaitForPort(const std::string& file, absl::Time deadline) const;
  absl::Status WaitForServers(uint32_t count, absl::Time deadline) const;

  ChildProcesses* children_;
  // Log files are closed with the last copy.
  std::vector<std::shared_ptr<Service>> services_;
  std::unique_ptr<Client> client_;
};

}  // namespace ndmap::cli

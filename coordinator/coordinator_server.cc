// SPDX-License-Identifier: GPL-3.0-or-later
#include "coordinator/coordinator_server.h"

#include <grpcpp/health_check_service_interface.h>

#include <chrono>
#include <utility>

namespace ndmap::coordinator {

absl::StatusOr<std::unique_ptr<CoordinatorServer>> CoordinatorServer::Start(CoordinatorOptions options) {
  std::unique_ptr<CoordinatorServer> server(new CoordinatorServer(options));
  absl::StatusOr<service::Listening> listening = service::Listen(options.listen, &server->service_);
  if (!listening.ok()) return listening.status();
  server->listening_ = *std::move(listening);
  server->service_.SetAddress(server->listening_.address);
  return server;
}

CoordinatorServer::~CoordinatorServer() { Stop(); }

void CoordinatorServer::Stop() {
  if (listening_.server == nullptr) return;
  if (auto* health = listening_.server->GetHealthCheckService(); health != nullptr)
    health->SetServingStatus(false);
  service_.Stop();
  runner_.Stop();
  listening_.server->Shutdown(std::chrono::system_clock::now() + std::chrono::seconds(1));
  listening_.server->Wait();
  listening_.server.reset();
  listening_.poller.reset();
}

}  // namespace ndmap::coordinator

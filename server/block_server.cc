// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/block_server.h"

#include <grpcpp/health_check_service_interface.h>

#include <algorithm>
#include <chrono>
#include <thread>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "service/names.h"

namespace ndmap::server {

absl::StatusOr<std::unique_ptr<BlockServer>> BlockServer::Start(BlockServerOptions options) {
  const unsigned threads =
      options.host.threads > 0 ? options.host.threads : std::max(std::thread::hardware_concurrency(), 1u);
  if (!options.advertise.empty()) {
    if (absl::Status status = service::CheckAddress(options.advertise); !status.ok()) return status;
  }
  std::unique_ptr<BlockServer> server(new BlockServer(options));
  absl::StatusOr<service::Listening> listening = service::Listen(options.listen, &server->service_);
  if (!listening.ok()) return listening.status();
  server->listening_ = *std::move(listening);
  std::string address = options.advertise.empty() ? server->listening_.address : options.advertise;
  // An advertised port of 0 is the one that was found.
  if (absl::EndsWith(address, ":0"))
    address = absl::StrCat(address.substr(0, address.size() - 1), server->port());
  server->host_.SetAddress(address);
  if (!options.coordinator.empty()) {
    if (absl::Status status = service::CheckAddress(options.coordinator); !status.ok()) return status;
    v1::RegisterServerRequest request;
    request.set_address(address);
    *request.mutable_version() = options.version;
    request.set_capacity(threads);
    BlockHost* const host = &server->host_;
    Registration::Holdings holdings;
    holdings.maps = [host] {
      // Asked for with every sign of life, which is often enough for what waits for minutes.
      host->pieces().DropOld(absl::Now());
      return host->Maps();
    };
    holdings.drop = [host](const std::string& map, uint64_t number) {
      host->DropMap(map, number).IgnoreError();
    };
    holdings.drop_everything = [host] { host->DropEverything(); };
    server->registration_ =
        std::make_unique<Registration>(options.coordinator, std::move(request), std::move(holdings));
    if (absl::Status s = server->registration_->Begin(options.coordinator_timeout); !s.ok()) return s;
  }
  return server;
}

BlockServer::~BlockServer() { Stop(); }

void BlockServer::Stop() {
  if (registration_ != nullptr) registration_->Stop();
  if (listening_.server == nullptr) return;
  if (auto* health = listening_.server->GetHealthCheckService(); health != nullptr)
    health->SetServingStatus(false);
  host_.StopWaiting();
  service_.Stop();
  listening_.server->Shutdown(std::chrono::system_clock::now() + std::chrono::seconds(1));
  listening_.server->Wait();
  host_.Stop();
  listening_.server.reset();
  listening_.poller.reset();
}

}  // namespace ndmap::server

// SPDX-License-Identifier: GPL-3.0-or-later
// A block server in a box: what ndmap-server runs, and what tests and local clusters start in their own
// process.
#pragma once

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "server/block_host.h"
#include "server/block_service.h"
#include "server/registration.h"
#include "service/channel.h"
#include "service/version.h"

namespace ndmap::server {

struct BlockServerOptions {
  std::string listen = "127.0.0.1:0";
  // What peers and clients connect to; empty: the address that it listens on.
  std::string advertise;
  // HOST:PORT; empty: it belongs to no cluster.
  std::string coordinator;
  // How long the first registration may wait for the coordinator.
  absl::Duration coordinator_timeout = absl::Seconds(5);
  HostOptions host;
  ServiceOptions service;
  // A test may be of another version.
  v1::Version version = service::MakeVersion("ndmap-server");
};

class BlockServer {
 public:
  // Serves and is registered when this returns. Errors are one sentence.
  static absl::StatusOr<std::unique_ptr<BlockServer>> Start(BlockServerOptions options);
  ~BlockServer();

  // Stops serving, lets calls end for a second, ends streams and threads. Twice is no error.
  void Stop();

  const std::string& address() const { return host_.address(); }
  int port() const { return listening_.port; }
  BlockHost& host() { return host_; }

 private:
  explicit BlockServer(BlockServerOptions& options)
      : host_(std::move(options.host)), service_(&host_, std::move(options.service)) {}

  BlockHost host_;
  BlockServiceImpl service_;
  service::Listening listening_;
  std::unique_ptr<Registration> registration_;
};

}  // namespace ndmap::server

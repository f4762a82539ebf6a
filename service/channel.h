// SPDX-License-Identifier: GPL-3.0-or-later
// The one place that makes channels and listening servers of the two services.
#pragma once

#include <grpcpp/channel.h>
#include <grpcpp/security/server_credentials.h>
#include <grpcpp/server.h>
#include <grpcpp/server_builder.h>

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "service/poller.h"

namespace ndmap::service {

inline constexpr int kMaxMessageBytes = 16 << 20;

// A channel to one of our services. Connects lazily; a dead peer is noticed within seconds.
std::shared_ptr<grpc::Channel> MakeChannel(const std::string& address);

struct Listening {
  // Ends after the server.
  std::unique_ptr<Poller> poller;
  std::unique_ptr<grpc::Server> server;
  // host:port with the real port.
  std::string address;
  int port = 0;
};

// Serves `grpc_service` at host:port (port 0: any free one) with health and reflection. The error is one
// sentence: the port is in use, or the address is not this machine's.
absl::StatusOr<Listening> Listen(const std::string& address, grpc::Service* grpc_service);

// Sends gRPC's own messages to the log, at debug level. Once a process, before anything else of gRPC.
void RouteGrpcLog();

}  // namespace ndmap::service

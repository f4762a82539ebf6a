// SPDX-License-Identifier: GPL-3.0-or-later
// A thread that watches the sockets of a server, always.
//
// In a server that has callback methods, and health checks are some, gRPC 1.51 lets only the threads of its
// callback API watch sockets, and these sleep for a tenth of a second after each second in which no callback
// came. A call that arrived then waited for them. On a completion queue of one's own nothing ever comes, but
// whoever waits for it watches.
#pragma once

#include <grpcpp/completion_queue.h>

#include <memory>
#include <thread>

namespace ndmap::service {

class Poller {
 public:
  explicit Poller(std::unique_ptr<grpc::ServerCompletionQueue> queue);
  // After the server's Shutdown().
  ~Poller();
  Poller(const Poller&) = delete;
  Poller& operator=(const Poller&) = delete;

 private:
  const std::unique_ptr<grpc::ServerCompletionQueue> queue_;
  std::thread thread_;
};

}  // namespace ndmap::service

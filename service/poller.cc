// SPDX-License-Identifier: GPL-3.0-or-later
#include "service/poller.h"

#include <utility>

namespace ndmap::service {

Poller::Poller(std::unique_ptr<grpc::ServerCompletionQueue> queue)
    : queue_(std::move(queue)), thread_([queue = queue_.get()] {
        void* tag = nullptr;
        bool ok = false;
        while (queue->Next(&tag, &ok)) {
        }
      }) {}

Poller::~Poller() {
  queue_->Shutdown();
  thread_.join();
}

}  // namespace ndmap::service

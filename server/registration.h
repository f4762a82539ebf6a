// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"
#include "ndmap/v1/coordinator.grpc.pb.h"

namespace ndmap::server {

// Keeps a server known to its coordinator: registers, renews the lease, and registers again when the
// coordinator has forgotten it (it was restarted), after which nothing of what the server held is wanted any
// more. With every sign of life it says which maps are here, and drops those that were deleted meanwhile.
class Registration {
 public:
  // What the maps that are here are asked of. Called from a thread of Registration's own.
  struct Holdings {
    std::function<std::vector<std::pair<std::string, uint64_t>>()> maps;
    std::function<void(const std::string& map, uint64_t number)> drop;
    std::function<void()> drop_everything;
  };
  Registration(const std::string& coordinator, v1::RegisterServerRequest request, Holdings holdings);
  ~Registration();

  // The first registration. Waits at most `timeout` for the coordinator, and while a server that had the
  // address may be alive for the end of its lease; the error is one sentence.
  absl::Status Begin(absl::Duration timeout);
  // Ends the heartbeats and says goodbye, so that nobody waits for the end of the lease.
  void Stop();

 private:
  void SayGoodbye();
  absl::Status Register(absl::Time deadline);
  void KeepAlive();
  // One heartbeat.
  void Beat(absl::Duration deadline);

  const std::string coordinator_;
  const v1::RegisterServerRequest request_;
  const Holdings holdings_;
  const std::unique_ptr<v1::Coordinator::Stub> stub_;
  v1::RegisterServerResponse registered_;
  // Whether the last heartbeat was answered.
  bool reachable_ = true;
  absl::Mutex mutex_;
  bool stopping_ ABSL_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

}  // namespace ndmap::server

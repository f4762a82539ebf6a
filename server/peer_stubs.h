// SPDX-License-Identifier: GPL-3.0-or-later
// Stubs of the other block servers, for questions.
#pragma once

#include <chrono>
#include <memory>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/container/flat_hash_map.h"
#include "absl/synchronization/mutex.h"
#include "ndmap/v1/block_service.grpc.pb.h"

namespace ndmap::server {

class PeerStubs {
 public:
  // What one question may take.
  static constexpr std::chrono::seconds kDeadline{10};

  // Made when first asked for. Thread-safe.
  std::shared_ptr<v1::BlockService::Stub> To(const std::string& address);

 private:
  absl::Mutex mutex_;
  absl::flat_hash_map<std::string, std::shared_ptr<v1::BlockService::Stub>> stubs_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace ndmap::server

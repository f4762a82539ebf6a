// SPDX-License-Identifier: Apache-2.0
// What all handles of one client share: the coordinator's stub, and one channel for each block server met so
// far.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/container/flat_hash_map.h"
#include "absl/synchronization/mutex.h"
#include "client/sdk/channel.h"
#include "client/sdk/options.h"
#include "ndmap/v1/block_service.grpc.pb.h"
#include "ndmap/v1/coordinator.grpc.pb.h"

namespace ndmap::internal {

// The version of this SDK, for version exchanges.
v1::Version SdkVersion();

class Connection {
 public:
  // Does not connect yet.
  Connection(std::string target, ClientOptions options);

  const std::string& target() const { return target_; }
  const ClientOptions& options() const { return options_; }
  v1::Coordinator::Stub& coordinator() { return *coordinator_; }
  // "the coordinator at HOST:PORT", for errors.
  const std::string& coordinator_name() const { return name_; }
  // The stub for a block server; versions are exchanged when it is first used. Thread-safe.
  absl::StatusOr<std::shared_ptr<v1::BlockService::Stub>> BlockServer(const std::string& address)
      ABSL_LOCKS_EXCLUDED(mutex_);
  // 0, 1, 2, ...: to spread questions that any server can answer. Thread-safe.
  uint32_t NextNumber() { return next_number_.fetch_add(1, std::memory_order_relaxed); }

 private:
  const std::string target_;
  const ClientOptions options_;
  const std::string name_;
  std::unique_ptr<v1::Coordinator::Stub> coordinator_;
  std::atomic<uint32_t> next_number_{0};
  absl::Mutex mutex_;
  absl::flat_hash_map<std::string, std::shared_ptr<v1::BlockService::Stub>> servers_ ABSL_GUARDED_BY(mutex_);
};

// "the block server at HOST:PORT", for errors.
std::string ServerName(const std::string& address);

}  // namespace ndmap::internal

// SPDX-License-Identifier: GPL-3.0-or-later
// Beta across blocks: Proposition 1 over the cluster.
#pragma once

#include <memory>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/container/flat_hash_map.h"
#include "absl/status/status.h"
#include "absl/synchronization/mutex.h"
#include "ndmap/v1/block_service.grpc.pb.h"
#include "server/block_host.h"

namespace ndmap::server {

class Walker {
 public:
  explicit Walker(BlockHost* host) : host_(host) {}

  // The walks of one request. Those that leave the block go on, together with the others that enter the same
  // block, in memory or by asking its server with `stay`; so a request never waits for one that waits for it.
  // Cost: a round for each crossing of the walk that crosses most. Blocking.
  absl::Status Beta(const v1::BetaRequest& request, v1::BetaResponse& response);

 private:
  absl::Status InBlock(const v1::BetaRequest& request, v1::BetaResponse& response);
  absl::Status Ask(const std::string& address, const v1::BetaRequest& request, v1::BetaResponse& response);

  BlockHost* const host_;
  absl::Mutex mutex_;
  absl::flat_hash_map<std::string, std::shared_ptr<v1::BlockService::Stub>> stubs_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace ndmap::server

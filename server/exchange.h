// SPDX-License-Identifier: GPL-3.0-or-later
// The receiving end of peer streams.
#pragma once

#include <grpcpp/support/server_callback.h>

#include <memory>

#include "absl/base/thread_annotations.h"
#include "absl/container/flat_hash_set.h"
#include "absl/synchronization/mutex.h"
#include "ndmap/v1/block_service.pb.h"
#include "server/block_host.h"

namespace ndmap::server {

using ExchangeReactor = grpc::ServerBidiReactor<v1::ExchangeRequest, v1::ExchangeResponse>;

// The streams that are open, so that a stopping server can end them.
class ExchangeStreams {
 public:
  class Incoming;

  explicit ExchangeStreams(BlockHost* host) : host_(host) {}
  // A reactor for a new stream; it deletes itself when done. After Finish() it ends the stream at once.
  ExchangeReactor* Open();
  // Ends all streams with UNAVAILABLE; their batches are sent again elsewhere or to the next incarnation.
  void Finish();

 private:
  friend class Incoming;
  BlockHost* const host_;
  absl::Mutex mutex_;
  bool finished_ ABSL_GUARDED_BY(mutex_) = false;
  absl::flat_hash_set<std::shared_ptr<Incoming>> open_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace ndmap::server

// SPDX-License-Identifier: GPL-3.0-or-later
// Batches to other processes: one bidirectional gRPC stream to each, opened on demand, one write in flight. A
// batch is kept until the other side has acknowledged it; a broken stream is opened again and what is not
// acknowledged is sent again, in the same order. So every batch arrives at least once, or its map is
// discarded.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/container/flat_hash_map.h"
#include "absl/strings/string_view.h"
#include "absl/synchronization/mutex.h"
#include "server/transport.h"

namespace ndmap::server {

class PeerStream;

class PeerStreams {
 public:
  PeerStreams();
  ~PeerStreams();
  PeerStreams(const PeerStreams&) = delete;
  PeerStreams& operator=(const PeerStreams&) = delete;

  // Never blocks. `taken` runs at the acknowledgement.
  void Send(const std::string& address, const Envelope& envelope, Taken taken);
  // Forgets all batches of a map that are not acknowledged, for example when its job failed.
  void Discard(absl::string_view map);
  // "to HOST:PORT: why" of each stream that is broken at the moment.
  std::vector<std::string> Broken() const;
  // Breaks every stream once, as a network would: for tests.
  void BreakAll();
  // Ends all streams and returns when their last callback has run.
  void Stop();

 private:
  mutable absl::Mutex mutex_;
  bool stopped_ ABSL_GUARDED_BY(mutex_) = false;
  absl::flat_hash_map<std::string, std::shared_ptr<PeerStream>> streams_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace ndmap::server

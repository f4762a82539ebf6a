// SPDX-License-Identifier: GPL-3.0-or-later
// How batches of messages leave a block, whatever carries them: memory, gRPC streams, or a fake in tests.
#pragma once

#include <cstdint>
#include <string>

#include "absl/functional/any_invocable.h"
#include "core/algorithm/message.h"
#include "core/map/ids.h"

namespace ndmap::server {

// One phase of one attempt of one job of a map.
struct PhaseId {
  uint64_t job = 0;
  uint32_t attempt = 0;
  uint32_t phase = 0;
  friend bool operator==(const PhaseId&, const PhaseId&) = default;
};

// A batch with its address. `sequence` counts 1, 2, ... for each source, destination and phase; `incarnation`
// is the sending process's.
struct Envelope {
  std::string map;
  PhaseId phase;
  BlockId source;
  BlockId destination;
  uint64_t incarnation = 0;
  uint64_t sequence = 0;
  MessageBatch messages;
};

// Called once, on any thread, when the destination has taken in what a batch says, or when nobody wants it
// any more.
using Taken = absl::AnyInvocable<void()>;

class PeerTransport {
 public:
  virtual ~PeerTransport() = default;
  // Never blocks and loses nothing: a batch is delivered at least once, or its map is gone. Any thread.
  // `taken` may run before this returns.
  virtual void Send(Envelope envelope, Taken taken) = 0;
};

}  // namespace ndmap::server

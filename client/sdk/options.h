// SPDX-License-Identifier: Apache-2.0
// How a client behaves: how long it waits and how often it tries again.
#pragma once

#include "absl/time/time.h"

namespace ndmap {

struct ClientOptions {
  // For the first answer of a coordinator or a block server.
  absl::Duration connect_timeout = absl::Seconds(4);
  // For one short call: a question, a job's start.
  absl::Duration call_timeout = absl::Seconds(30);
  // For one long stream: a surface up, a piece down.
  absl::Duration transfer_timeout = absl::Minutes(30);
  // Calls that change nothing, or that are harmless when done twice, are tried that often in all when a
  // server does not answer, with this pause after the first try, twice as long after each further one.
  int attempts = 3;
  absl::Duration first_pause = absl::Milliseconds(50);
};

}  // namespace ndmap

// SPDX-License-Identifier: GPL-3.0-or-later
// Many walks at once over the cluster: Proposition 1 in columns.
#pragma once

#include <functional>

#include "absl/status/status.h"
#include "server/block_answers.h"
#include "server/peer_stubs.h"
#include "server/remote_blocks.h"

namespace ndmap::server {

class Walks {
 public:
  // `max_darts`: starts of one request.
  Walks(BlockHost* host, BlockAnswers* answers, PeerStubs* peers, uint64_t max_darts)
      : host_(host), answers_(answers), peers_(peers), max_darts_(max_darts) {}

  // In rounds: each asks every block that walks are in once, all at the same time. Cost: a round for each
  // crossing of the walk that crosses most. When a block changes on the way and the request named no version
  // it begins again, some times, and then says ABORTED. Blocking.
  absl::Status Walk(const v1::WalkRequest& request, const std::function<bool()>& gone,
                    v1::WalkResponse& response);

 private:
  BlockHost* const host_;
  BlockAnswers* const answers_;
  PeerStubs* const peers_;
  const uint64_t max_darts_;
};

}  // namespace ndmap::server

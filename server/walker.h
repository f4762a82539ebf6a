// SPDX-License-Identifier: GPL-3.0-or-later
// Beta across blocks: Proposition 1 over the cluster.
#pragma once

#include <functional>
#include <string>

#include "absl/status/status.h"
#include "server/block_host.h"
#include "server/peer_stubs.h"

namespace ndmap::server {

class Walker {
 public:
  Walker(BlockHost* host, PeerStubs* peers) : host_(host), peers_(peers) {}

  // The walks of one request. Those that leave the block go on, together with the others that enter the same
  // block, in memory or by asking its server with `stay`; so a request never waits for one that waits for it.
  // Cost: a round for each crossing of the walk that crosses most. CANCELLED soon after
  // `gone` says true. Blocking.
  absl::Status Beta(const v1::BetaRequest& request, const std::function<bool()>& gone,
                    v1::BetaResponse& response);

 private:
  absl::Status InBlock(const v1::BetaRequest& request, const std::function<bool()>& gone,
                       v1::BetaResponse& response);
  absl::Status Ask(const std::string& address, const v1::BetaRequest& request,
                   const std::function<bool()>& gone, v1::BetaResponse& response);

  BlockHost* const host_;
  PeerStubs* const peers_;
};

}  // namespace ndmap::server

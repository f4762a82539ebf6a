// SPDX-License-Identifier: GPL-3.0-or-later
// All blocks of a map, here and on other servers, as somebody to ask: core's BlockAccess over the cluster.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "core/navigate/closure.h"
#include "ndmap/v1/navigate.pb.h"
#include "server/block_answers.h"
#include "server/peer_stubs.h"

namespace ndmap::server {

class RemoteBlocks final : public BlockAccess {
 public:
  // For one question of a client.
  RemoteBlocks(std::string map, BlockHost::MapInfo info, std::string self, BlockAnswers* answers,
               PeerStubs* peers, std::function<bool()> gone, uint64_t max_darts)
      : map_(std::move(map)),
        info_(std::move(info)),
        self_(std::move(self)),
        answers_(answers),
        peers_(peers),
        gone_(std::move(gone)),
        max_darts_(max_darts) {}

  uint32_t block_count() const override { return info_.block_count; }
  const std::string& map() const { return map_; }
  const BlockHost::MapInfo& info() const { return info_; }
  uint64_t max_darts() const { return max_darts_; }

  // Asks other servers at the same time while it asks the blocks here; one answer for each request, in order.
  // The requests' map is filled in. UNAVAILABLE naming the block and its server when that does not answer.
  absl::StatusOr<std::vector<v1::AskBlockResponse>> Ask(std::vector<v1::AskBlockRequest> requests);

  absl::StatusOr<std::vector<OrbitPiece>> Expand(absl::Span<const Question> questions) override;

 private:
  bool IsHere(uint32_t block) const {
    return info_.addresses[block].empty() || info_.addresses[block] == self_;
  }

  const std::string map_;
  const BlockHost::MapInfo info_;
  const std::string self_;
  BlockAnswers* const answers_;
  PeerStubs* const peers_;
  const std::function<bool()> gone_;
  const uint64_t max_darts_;
};

}  // namespace ndmap::server

// SPDX-License-Identifier: GPL-3.0-or-later
// Questions of clients about cells and neighbourhoods, answered for the whole map by the server that is
// asked.
#pragma once

#include <functional>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/navigate/dart_set.h"
#include "server/block_answers.h"
#include "server/peer_stubs.h"
#include "server/remote_blocks.h"

namespace ndmap::server {

inline constexpr uint64_t kDefaultQueryDarts = 400000;
// What fits into a message of 16 MiB between servers.
inline constexpr uint64_t kMostQueryDarts = 500000;

class Explorer {
 public:
  Explorer(BlockHost* host, PeerStubs* peers, uint64_t max_darts)
      : host_(host), peers_(peers), max_darts_(max_darts), answers_(host, max_darts) {}

  // Writes the answer in parts; a part that cannot be written ends it. When a block changes on the way it
  // begins again, some times, and then says ABORTED. Blocking.
  absl::Status Explore(const v1::ExploreRequest& request, const std::function<bool()>& gone,
                       const std::function<bool(const v1::ExploreResponse&)>& write);

  // The chunk of hexahedra around a dart of a block here, with the partners of its critical darts, in parts
  // of one version of the block; ABORTED when it changes on the way. Blocking.
  absl::Status FetchCells(const v1::FetchCellsRequest& request, const std::function<bool()>& gone,
                          const std::function<bool(const v1::FetchCellsResponse&)>& write);

  BlockAnswers& answers() { return answers_; }

 private:
  absl::StatusOr<std::vector<v1::ExploreResponse>> Once(const v1::ExploreRequest& request,
                                                        const std::function<bool()>& gone);

  BlockHost* const host_;
  PeerStubs* const peers_;
  const uint64_t max_darts_;
  BlockAnswers answers_;
};

}  // namespace ndmap::server

// SPDX-License-Identifier: GPL-3.0-or-later
#include "coordinator/placement.h"

#include <algorithm>

#include "absl/strings/str_cat.h"

namespace ndmap::coordinator {

absl::StatusOr<std::vector<v1::BlockPlacement>> Place(uint32_t blocks,
                                                      const std::vector<v1::Server>& servers) {
  std::vector<const v1::Server*> alive;
  for (const v1::Server& server : servers) {
    if (server.alive()) alive.push_back(&server);
  }
  if (alive.empty())
    return absl::UnavailableError("no block server is registered: start an ndmap-server first");
  std::sort(alive.begin(), alive.end(),
            [](const v1::Server* a, const v1::Server* b) { return a->server_id() < b->server_id(); });
  std::vector<v1::BlockPlacement> result(blocks);
  for (uint32_t b = 0; b < blocks; ++b) {
    const v1::Server& server = *alive[b % alive.size()];
    result[b].set_block(b);
    result[b].set_server_id(server.server_id());
    result[b].set_address(server.address());
    result[b].set_incarnation(server.incarnation());
  }
  return result;
}

absl::StatusOr<std::vector<v1::BlockPlacement>> CheckPlacement(
    const google::protobuf::RepeatedPtrField<v1::BlockPlacement>& placement, uint32_t blocks,
    const std::vector<v1::Server>& servers) {
  if (static_cast<uint32_t>(placement.size()) != blocks) {
    return absl::InvalidArgumentError(
        absl::StrCat("places of ", placement.size(), " blocks for a map of ", blocks));
  }
  std::vector<v1::BlockPlacement> result;
  for (const v1::BlockPlacement& given : placement) {
    if (given.block() != result.size()) {
      return absl::InvalidArgumentError(absl::StrCat(
          "the place of block ", given.block(), " where that of block ", result.size(), " was expected"));
    }
    const auto server = std::find_if(servers.begin(), servers.end(), [&](const v1::Server& s) {
      return s.server_id() == given.server_id() && s.incarnation() == given.incarnation() && s.alive();
    });
    if (server == servers.end()) {
      return absl::UnavailableError(absl::StrCat("server ", given.server_id(), ", where the piece of block ",
                                                 given.block(),
                                                 " was sent, is gone or was restarted: send the mesh again"));
    }
    result.push_back(given);
    result.back().set_address(server->address());
  }
  return result;
}

}  // namespace ndmap::coordinator

// SPDX-License-Identifier: GPL-3.0-or-later
#include "coordinator/placement.h"

#include <algorithm>

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

}  // namespace ndmap::coordinator

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "ndmap/v1/coordinator.pb.h"

namespace ndmap::coordinator {

// Block b on the server b mod P of the servers that are alive, in order of their numbers: the same for the
// same servers. UNAVAILABLE when there is none.
absl::StatusOr<std::vector<v1::BlockPlacement>> Place(uint32_t blocks,
                                                      const std::vector<v1::Server>& servers);

// The same servers again, from a client that has sent pieces of a mesh there: checked and as they are known
// here. INVALID_ARGUMENT unless it is one for each block, in order. UNAVAILABLE when a server is gone, or was
// restarted.
absl::StatusOr<std::vector<v1::BlockPlacement>> CheckPlacement(
    const google::protobuf::RepeatedPtrField<v1::BlockPlacement>& placement, uint32_t blocks,
    const std::vector<v1::Server>& servers);

}  // namespace ndmap::coordinator

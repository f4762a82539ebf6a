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

}  // namespace ndmap::coordinator

// SPDX-License-Identifier: GPL-3.0-or-later
// Whether a block is at the version that a question is about.
#pragma once

#include <cstdint>

#include "absl/status/status.h"
#include "core/map/block.h"

namespace ndmap::server {

// FAILED_PRECONDITION when the block is at another version than the one that the caller named; 0 names none.
absl::Status CheckVersion(const Block3& block, uint64_t version);

// ABORTED when the block is not at the version that the first step of a question met.
absl::Status CheckUnchanged(const Block3& block, uint64_t version);

}  // namespace ndmap::server

// SPDX-License-Identifier: GPL-3.0-or-later
// A part of many walks: as far as one block can follow them.
#pragma once

#include <functional>

#include "absl/status/status.h"
#include "ndmap/v1/navigate.pb.h"
#include "server/block_host.h"

namespace ndmap::server {

// Walks of one request, and letters of its word.
inline constexpr size_t kMaxWalks = 1 << 18;
inline constexpr size_t kMaxWord = 1 << 16;

// The answer to a WalkQuestion, in steps of about a millisecond and of one version of the block. NOT_FOUND
// for a dart that is not there, INVALID_ARGUMENT for a letter above 3 and columns that do not fit together.
// O(walks
// + letters). Blocks.
absl::Status AnswerWalk(BlockHost& host, const v1::AskBlockRequest& request,
                        const std::function<bool()>& gone, v1::AskBlockResponse& response);

}  // namespace ndmap::server

// SPDX-License-Identifier: GPL-3.0-or-later
// The nearest vertex of a map, of those that its blocks have found.
#pragma once

#include <cstddef>
#include <vector>

#include "absl/status/status.h"
#include "core/map/ids.h"
#include "core/navigate/dart_set.h"
#include "ndmap/v1/navigate.pb.h"
#include "server/remote_blocks.h"

namespace ndmap::server {

// The vertex of one block that is nearest to the point of an anchor.
struct NearestOfBlock {
  size_t anchor = 0;
  // Squared and rounded; it may be infinite.
  double distance = 0;
  CellId id;
  BlockId block;
  DartIndex dart;
};

// Adds to `set`, by anchor, a dart of the nearest, of those equally near of the one with the lowest id.
// Rounded distances that are too close to call are settled exactly by the points, for which their blocks are
// asked at the versions in `set`.
absl::Status ChooseNearest(RemoteBlocks& blocks, const v1::FindQuestion& anchors,
                           std::vector<NearestOfBlock> found, DartSet& set);

}  // namespace ndmap::server

// SPDX-License-Identifier: GPL-3.0-or-later
// Darts of several blocks, each block at one version.
#pragma once

#include <cstdint>
#include <vector>

#include "absl/container/btree_map.h"
#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/map/ids.h"

namespace ndmap {

struct DartSet {
  struct OfBlock {
    uint64_t version = 0;
    // Ascending, each once.
    std::vector<DartIndex> darts;

    friend bool operator==(const OfBlock&, const OfBlock&) = default;
  };
  absl::btree_map<BlockId, OfBlock> blocks;

  size_t size() const {
    size_t count = 0;
    for (const auto& [b, part] : blocks) count += part.darts.size();
    return count;
  }
  bool empty() const { return size() == 0; }

  friend bool operator==(const DartSet&, const DartSet&) = default;
};

}  // namespace ndmap

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>

#include "absl/container/flat_hash_set.h"

namespace ndmap::server {

// Which sequence numbers of one channel were seen. Memory: only what came out of order.
class SequenceFilter {
 public:
  // True the first time a number (1, 2, ...) comes. O(1) expected.
  bool FirstTime(uint64_t number) {
    if (number <= all_up_to_) return false;
    if (number > all_up_to_ + 1) return beyond_.insert(number).second;
    ++all_up_to_;
    while (!beyond_.empty() && beyond_.erase(all_up_to_ + 1) > 0) ++all_up_to_;
    return true;
  }

 private:
  uint64_t all_up_to_ = 0;
  absl::flat_hash_set<uint64_t> beyond_;
};

}  // namespace ndmap::server

// SPDX-License-Identifier: GPL-3.0-or-later
// Which of n things belong together: union and find.
#pragma once

#include <cstdint>
#include <numeric>
#include <vector>

namespace ndmap::internal {

class Classes {
 public:
  // At most 2^32 things.
  explicit Classes(uint64_t n) : parent_(n) { std::iota(parent_.begin(), parent_.end(), 0); }
  void Join(uint64_t a, uint64_t b) { parent_[Root(a)] = Root(b); }
  bool IsRoot(uint64_t a) const { return parent_[a] == a; }
  uint64_t Count() const {
    uint64_t count = 0;
    for (uint64_t i = 0; i < parent_.size(); ++i) count += IsRoot(i);
    return count;
  }

 private:
  uint32_t Root(uint64_t a) {
    uint32_t i = static_cast<uint32_t>(a);
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  std::vector<uint32_t> parent_;
};

}  // namespace ndmap::internal

// SPDX-License-Identifier: GPL-3.0-or-later
// A value for each dart or attribute of a map, for both storages: an array where handles are indices, a hash
// table where they are addresses.
#pragma once

#include <algorithm>
#include <cstddef>
#include <type_traits>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "core/map/handle_hash.h"

namespace ndmap {

// What was never set is T(). O(1); the array grows to the largest index that was set.
template <class Handle, class T>
class HandleTable {
  static constexpr bool kIndexed = requires(Handle h) { h.index; };

 public:
  // Room for the handles that a container has now, so that nothing is copied later.
  template <class Container>
  void Reserve(const Container& container) {
    if constexpr (kIndexed) {
      Resize(container.bound());
    } else {
      values_.reserve(container.size());
    }
  }
  T& operator[](Handle handle) {
    if constexpr (kIndexed) {
      if (handle.index >= values_.size()) Resize(size_t{handle.index} + 1);
      return values_[handle.index];
    } else {
      return values_[handle];
    }
  }
  T Get(Handle handle) const {
    if constexpr (kIndexed) {
      return handle.index < values_.size() ? values_[handle.index] : T();
    } else {
      const auto it = values_.find(handle);
      return it == values_.end() ? T() : it->second;
    }
  }

 private:
  void Resize(size_t size) {
    if (size > values_.capacity()) values_.reserve(std::max(size, 2 * values_.capacity()));
    if (size > values_.size()) values_.resize(size);
  }

  std::conditional_t<kIndexed, std::vector<T>, absl::flat_hash_map<Handle, T, HandleHash<Handle>>> values_;
};

}  // namespace ndmap

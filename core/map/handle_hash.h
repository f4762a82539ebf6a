// SPDX-License-Identifier: GPL-3.0-or-later
// Hash of dart and attribute handles, for both storages.
#pragma once

#include "absl/hash/hash.h"

namespace ndmap {

// Of one type, so that what merely converts to a handle is converted first.
template <class Handle>
struct HandleHash {
  size_t operator()(const Handle& handle) const {
    if constexpr (requires { handle.operator->(); }) {
      return absl::Hash<const void*>()(handle.operator->());
    } else {
      return absl::Hash<Handle>()(handle);
    }
  }
};

}  // namespace ndmap

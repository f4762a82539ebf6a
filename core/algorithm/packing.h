// SPDX-License-Identifier: GPL-3.0-or-later
// Fixed-size values in message payloads, as the bytes they have in memory (little-endian).
#pragma once

#include <bit>
#include <cstring>
#include <type_traits>

#include "absl/strings/string_view.h"

namespace ndmap {

static_assert(std::endian::native == std::endian::little, "payloads are little-endian");

template <class T>
absl::string_view BytesOf(const T& value) {
  static_assert(std::has_unique_object_representations_v<T> || std::is_aggregate_v<T>);
  static_assert(std::is_trivially_copyable_v<T>);
  return absl::string_view(reinterpret_cast<const char*>(&value), sizeof(T));
}

// False if the payload does not have T's size.
template <class T>
bool FromBytes(absl::string_view bytes, T* value) {
  static_assert(std::is_trivially_copyable_v<T>);
  if (bytes.size() != sizeof(T)) return false;
  std::memcpy(value, bytes.data(), sizeof(T));
  return true;
}

}  // namespace ndmap

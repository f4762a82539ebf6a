// SPDX-License-Identifier: GPL-3.0-or-later
// Columns of numbers that arrive one after the other, in chunks cut anywhere.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>
#include <vector>

#include "absl/strings/string_view.h"

namespace ndmap::service {

static_assert(std::endian::native == std::endian::little, "columns are little-endian on the wire");

// Copies what of `data`, which begins at byte `at` of all columns, belongs to the column [begin, begin +
// bytes). The column grows with what arrives.
template <class T>
void CopyInto(std::vector<T>& column, uint64_t begin, uint64_t bytes, uint64_t at, absl::string_view data) {
  const uint64_t from = std::max(begin, at), to = std::min(begin + bytes, at + data.size());
  if (from >= to) return;
  column.resize((to - begin + sizeof(T) - 1) / sizeof(T));
  std::memcpy(reinterpret_cast<char*>(column.data()) + (from - begin), data.data() + (from - at), to - from);
}

}  // namespace ndmap::service

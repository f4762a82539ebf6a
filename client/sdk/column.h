// SPDX-License-Identifier: Apache-2.0
// Columns of the wire: little-endian 32-bit numbers, one after the other.
#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "absl/types/span.h"

namespace ndmap::internal {

static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__);

// Reads one. What is left over at its end is not read.
class Column {
 public:
  explicit Column(const std::string& bytes) : bytes_(bytes) {}
  size_t size() const { return bytes_.size() / 4; }
  uint32_t operator[](size_t i) const {
    uint32_t value;
    std::memcpy(&value, bytes_.data() + 4 * i, sizeof(value));
    return value;
  }

 private:
  const std::string& bytes_;
};

inline void AssignColumn(absl::Span<const uint32_t> values, std::string* column) {
  column->assign(reinterpret_cast<const char*>(values.data()), 4 * values.size());
}

}  // namespace ndmap::internal

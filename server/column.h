// SPDX-License-Identifier: GPL-3.0-or-later
// Columns of the wire: little-endian 32-bit numbers, one after the other.
#pragma once

#include <cstdint>
#include <cstring>
#include <string>

#include "absl/strings/string_view.h"

namespace ndmap::server {

static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__);

inline void Append(std::string& column, uint32_t value) {
  char bytes[sizeof(value)];
  std::memcpy(bytes, &value, sizeof(value));
  column.append(bytes, sizeof(bytes));
}

inline void Set(std::string& column, size_t row, uint32_t value) {
  std::memcpy(column.data() + sizeof(value) * row, &value, sizeof(value));
}

// Reads one. What is left over at its end (IsWhole() tells) is not read.
class Column {
 public:
  explicit Column(absl::string_view bytes) : bytes_(bytes) {}
  bool IsWhole() const { return bytes_.size() % sizeof(uint32_t) == 0; }
  size_t size() const { return bytes_.size() / sizeof(uint32_t); }
  uint32_t operator[](size_t row) const {
    uint32_t value;
    std::memcpy(&value, bytes_.data() + sizeof(value) * row, sizeof(value));
    return value;
  }

 private:
  absl::string_view bytes_;
};

}  // namespace ndmap::server

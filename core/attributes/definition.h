// SPDX-License-Identifier: GPL-3.0-or-later
// What an attribute is: a named, typed column of values on the cells of one dimension, and what new cells get
// (docs/attributes.md).
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace ndmap {

// The numbers are those on the wire.
enum class ValueType : uint8_t { kDouble = 1, kInt64 = 2, kVec3 = 3, kCategory = 4 };
enum class SplitRule : uint8_t { kCopy = 1, kMean = 2, kMidpoint = 3, kZero = 4, kDivide = 5 };

// The bits of one value: a double's, an integer's, three doubles', or a category's code in its column.
using ValueWords = std::array<uint64_t, 3>;

struct AttributeDefinition {
  static constexpr size_t kMaxAttributes = 64;
  static constexpr size_t kMaxCategoryBytes = 64;
  static constexpr size_t kMaxCategories = 65536;

  std::string name;
  unsigned dimension = 3;
  ValueType type = ValueType::kDouble;
  SplitRule split = SplitRule::kCopy;
  // What every cell has at first: of all types but categories ...
  ValueWords fill{};
  // ... and of categories.
  std::string fill_text;
  // Names may be used again, numbers never are.
  uint64_t number = 0;

  // Words of one value.
  unsigned width() const { return type == ValueType::kVec3 ? 3 : 1; }
  friend bool operator==(const AttributeDefinition&, const AttributeDefinition&) = default;
};

// INVALID_ARGUMENT: a name, dimension or category that is none, or a rule that does not fit type or
// dimension.
absl::Status Validate(const AttributeDefinition& definition);

// Definitions as one text and back: how they travel as a parameter of the algorithm "attributes".
std::string EncodeDefinitions(const std::vector<AttributeDefinition>& definitions);
absl::StatusOr<std::vector<AttributeDefinition>> DecodeDefinitions(absl::string_view text);

}  // namespace ndmap

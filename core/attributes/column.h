// SPDX-License-Identifier: GPL-3.0-or-later
// The values of one attribute in one block, by row.
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "core/attributes/definition.h"
#include "core/map/growable_array.h"

namespace ndmap {

class Column {
 public:
  explicit Column(AttributeDefinition definition) : definition_(std::move(definition)) {
    Code("").IgnoreError();
    fill_ = definition_.fill;
    if (definition_.type == ValueType::kCategory) fill_ = {Code(definition_.fill_text).value(), 0, 0};
  }

  const AttributeDefinition& definition() const { return definition_; }
  unsigned width() const { return definition_.width(); }
  const ValueWords& fill() const { return fill_; }

  ValueWords Get(uint32_t row) const {
    ValueWords value{};
    for (unsigned c = 0; c < width(); ++c) value[c] = words_[size_t{row} * width() + c];
    return value;
  }
  void Set(uint32_t row, const ValueWords& value) {
    for (unsigned c = 0; c < width(); ++c) words_[size_t{row} * width() + c] = value[c];
  }
  // Room for that many rows; new ones hold anything.
  void Reserve(size_t rows) { words_.Reserve(rows * width()); }

  // The code of a category, which is taken up if it is new. RESOURCE_EXHAUSTED: too many. Code 0 is "".
  absl::StatusOr<uint64_t> Code(absl::string_view text) {
    const auto it = codes_.find(text);
    if (it != codes_.end()) return it->second;
    if (text.size() > AttributeDefinition::kMaxCategoryBytes) {
      return absl::InvalidArgumentError(absl::StrCat("a category of ", text.size(),
                                                     " bytes, expected at most ",
                                                     AttributeDefinition::kMaxCategoryBytes));
    }
    if (texts_.size() >= AttributeDefinition::kMaxCategories) {
      return absl::ResourceExhaustedError(absl::StrCat("attribute ", definition_.name, " has ", texts_.size(),
                                                       " different categories, no more are possible"));
    }
    texts_.emplace_back(text);
    codes_[texts_.back()] = texts_.size() - 1;
    return texts_.size() - 1;
  }
  const std::string& Text(uint64_t code) const { return texts_[std::min<size_t>(code, texts_.size() - 1)]; }

  // How many there are, the empty one included; whether a text is one of them.
  size_t categories() const { return texts_.size(); }
  bool Knows(absl::string_view text) const { return codes_.contains(text); }

  size_t bytes() const { return words_.capacity() * sizeof(uint64_t); }

 private:
  AttributeDefinition definition_;
  ValueWords fill_{};
  GrowableArray<uint64_t> words_;
  std::vector<std::string> texts_;
  absl::flat_hash_map<std::string, uint64_t> codes_;
};

}  // namespace ndmap

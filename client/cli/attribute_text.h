// SPDX-License-Identifier: GPL-3.0-or-later
// Attributes and their values as people and programs write and read them.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "client/cli/context.h"
#include "client/sdk/attributes.h"
#include "core/map/ids.h"

namespace ndmap::cli {

// "double", "mean", ... as the options take them.
std::vector<std::string> ValueTypeNames();
std::vector<std::string> SplitRuleNames();
std::string NameOf(v1::ValueType type);
std::string NameOf(v1::SplitRule rule);
// Of one of those names.
v1::ValueType ValueTypeOf(const std::string& name);
v1::SplitRule SplitRuleOf(const std::string& name);

// The attribute of that name; NOT_FOUND naming those that there are.
absl::StatusOr<v1::Attribute> FindAttribute(const std::vector<v1::Attribute>& attributes,
                                            const std::string& map, const std::string& name);

// A column of values that are told as text. INVALID_ARGUMENT names the text that is none.
class ColumnBuilder {
 public:
  explicit ColumnBuilder(v1::ValueType type) { column_.type = type; }
  // A vector is "1,2,3" here; "nan" and "inf" are numbers.
  absl::Status Add(absl::string_view text);
  // A vector, or what has one component.
  absl::Status Add(const std::vector<absl::string_view>& components);
  AttributeColumn Take() { return std::move(column_); }

 private:
  AttributeColumn column_;
  absl::flat_hash_map<std::string, uint32_t> codes_;
};
// A column with one value.
absl::StatusOr<AttributeColumn> OneValue(v1::ValueType type, absl::string_view text);

// The shortest text that reads back as the same number; also "nan", "inf", "-inf".
std::string NumberText(double number);
// Value `row` as one text, or as one text a component of a vector.
std::string ValueText(const AttributeColumn& column, size_t row);
std::vector<std::string> ValueTexts(const AttributeColumn& column, size_t row);
// Numbers that are not finite become null.
Json ValueAsJson(const AttributeColumn& column, size_t row);
// "name", of vectors "name:0", "name:1", "name:2", as ParaView calls components.
std::vector<std::string> Titles(const std::string& name, v1::ValueType type);

// NOT_FOUND about ids that a map has not; at most ten are named.
absl::Status MissingError(const std::string& map, uint64_t missing, const std::vector<std::string>& ids);

}  // namespace ndmap::cli

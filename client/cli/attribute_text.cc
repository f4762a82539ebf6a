// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/attribute_text.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/ascii.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"
#include "absl/strings/strip.h"
#include "client/cli/cell_report.h"
#include "client/cli/text.h"

namespace ndmap::cli {
namespace {

constexpr size_t kMostCategoryBytes = 64;

absl::Status NoValue(absl::string_view text, absl::string_view expected) {
  return absl::InvalidArgumentError(
      absl::StrCat("'", text.substr(0, 100), "' is no value, expected ", expected));
}

}  // namespace

std::vector<std::string> ValueTypeNames() { return {"double", "int64", "vec3", "category"}; }
std::vector<std::string> SplitRuleNames() { return {"copy", "mean", "midpoint", "zero", "divide"}; }

std::string NameOf(v1::ValueType type) {
  return absl::AsciiStrToLower(absl::StripPrefix(v1::ValueType_Name(type), "VALUE_TYPE_"));
}
std::string NameOf(v1::SplitRule rule) {
  if (rule == v1::SPLIT_RULE_UNSPECIFIED) rule = v1::SPLIT_RULE_COPY;
  return absl::AsciiStrToLower(absl::StripPrefix(v1::SplitRule_Name(rule), "SPLIT_RULE_"));
}

v1::ValueType ValueTypeOf(const std::string& name) {
  v1::ValueType type = v1::VALUE_TYPE_UNSPECIFIED;
  v1::ValueType_Parse(absl::StrCat("VALUE_TYPE_", absl::AsciiStrToUpper(name)), &type);
  return type;
}
v1::SplitRule SplitRuleOf(const std::string& name) {
  v1::SplitRule rule = v1::SPLIT_RULE_UNSPECIFIED;
  v1::SplitRule_Parse(absl::StrCat("SPLIT_RULE_", absl::AsciiStrToUpper(name)), &rule);
  return rule;
}

absl::StatusOr<v1::Attribute> FindAttribute(const std::vector<v1::Attribute>& attributes,
                                            const std::string& map, const std::string& name) {
  std::vector<std::string> names;
  for (const v1::Attribute& attribute : attributes) {
    if (attribute.name() == name) return attribute;
    names.push_back(attribute.name());
  }
  return absl::NotFoundError(absl::StrCat("map '", map, "' has no attribute '", name, "', it has ",
                                          names.empty() ? "none" : absl::StrJoin(names, ", ")));
}

absl::Status ColumnBuilder::Add(const std::vector<absl::string_view>& components) {
  if (column_.type != v1::VALUE_TYPE_VEC3 && components.size() == 1) return Add(components[0]);
  double value[3] = {};
  bool good = column_.type == v1::VALUE_TYPE_VEC3 && components.size() == 3;
  for (size_t c = 0; good && c < 3; ++c) good = absl::SimpleAtod(components[c], &value[c]);
  if (!good) return NoValue(absl::StrJoin(components, ","), "three numbers, for example 1,2.5,-3");
  column_.doubles.insert(column_.doubles.end(), value, value + 3);
  return absl::OkStatus();
}

absl::Status ColumnBuilder::Add(absl::string_view text) {
  switch (column_.type) {
    case v1::VALUE_TYPE_DOUBLE: {
      double value = 0;
      if (!absl::SimpleAtod(text, &value)) return NoValue(text, "a number");
      column_.doubles.push_back(value);
      return absl::OkStatus();
    }
    case v1::VALUE_TYPE_INT64: {
      int64_t value = 0;
      if (!absl::SimpleAtoi(text, &value)) return NoValue(text, "a whole number of 64 bits");
      column_.integers.push_back(value);
      return absl::OkStatus();
    }
    case v1::VALUE_TYPE_VEC3:
      return Add(std::vector<absl::string_view>(absl::StrSplit(text, ',')));
    default: {
      if (text.size() > kMostCategoryBytes) return NoValue(text, "a text of at most 64 bytes");
      const auto [it, added] = codes_.try_emplace(text, static_cast<uint32_t>(column_.categories.size()));
      if (added) column_.categories.emplace_back(text);
      column_.codes.push_back(it->second);
      return absl::OkStatus();
    }
  }
}

absl::StatusOr<AttributeColumn> OneValue(v1::ValueType type, absl::string_view text) {
  ColumnBuilder builder(type);
  if (absl::Status s = builder.Add(text); !s.ok()) return s;
  return builder.Take();
}

std::string NumberText(double number) {
  if (std::isfinite(number)) return ExactNumber(number);
  return std::isnan(number) ? "nan" : number > 0 ? "inf" : "-inf";
}

std::vector<std::string> ValueTexts(const AttributeColumn& column, size_t row) {
  switch (column.type) {
    case v1::VALUE_TYPE_DOUBLE:
      return {NumberText(column.doubles[row])};
    case v1::VALUE_TYPE_VEC3:
      return {NumberText(column.doubles[3 * row]), NumberText(column.doubles[3 * row + 1]),
              NumberText(column.doubles[3 * row + 2])};
    case v1::VALUE_TYPE_INT64:
      return {absl::StrCat(column.integers[row])};
    default:
      return {column.categories[column.codes[row]]};
  }
}

std::string ValueText(const AttributeColumn& column, size_t row) {
  return absl::StrJoin(ValueTexts(column, row), ",");
}

Json ValueAsJson(const AttributeColumn& column, size_t row) {
  switch (column.type) {
    case v1::VALUE_TYPE_DOUBLE:
      return column.doubles[row];
    case v1::VALUE_TYPE_VEC3:
      return Json::array({column.doubles[3 * row], column.doubles[3 * row + 1], column.doubles[3 * row + 2]});
    case v1::VALUE_TYPE_INT64:
      return column.integers[row];
    default:
      return column.categories[column.codes[row]];
  }
}

std::vector<std::string> Titles(const std::string& name, v1::ValueType type) {
  if (type != v1::VALUE_TYPE_VEC3) return {name};
  return {absl::StrCat(name, ":0"), absl::StrCat(name, ":1"), absl::StrCat(name, ":2")};
}

absl::Status MissingError(const std::string& map, uint64_t missing, const std::vector<std::string>& ids) {
  const size_t shown = std::min<size_t>(ids.size(), 10);
  return absl::NotFoundError(absl::StrCat(
      "map '", map, "' lacks ", FormatCount(static_cast<int64_t>(missing)),
      " of the cells: ", absl::StrJoin(ids.begin(), ids.begin() + static_cast<std::ptrdiff_t>(shown), ", "),
      missing > shown ? " and others" : ""));
}

}  // namespace ndmap::cli

// SPDX-License-Identifier: GPL-3.0-or-later
#include "service/attributes.h"

#include <bit>

#include "absl/strings/str_cat.h"

namespace ndmap::service {
namespace {

bool Fits(const v1::Values& values, ValueType type, size_t count) {
  const auto is = [](int size, size_t expected) { return static_cast<size_t>(size) == expected; };
  const size_t doubles = type == ValueType::kDouble ? count : type == ValueType::kVec3 ? 3 * count : 0;
  const bool category = type == ValueType::kCategory;
  return is(values.doubles_size(), doubles) &&
         is(values.integers_size(), type == ValueType::kInt64 ? count : 0) &&
         is(values.codes_size(), category ? count : 0) && (category || values.categories_size() == 0);
}

}  // namespace

absl::string_view NameOf(ValueType type) {
  switch (type) {
    case ValueType::kDouble:
      return "double";
    case ValueType::kInt64:
      return "int64";
    case ValueType::kVec3:
      return "vec3";
    case ValueType::kCategory:
      return "category";
  }
  return "none";
}

absl::Status CheckValues(const v1::Values& values, ValueType type, size_t count) {
  if (!Fits(values, type, count)) {
    return absl::InvalidArgumentError(
        absl::StrCat("expected ", count, " values of type ", NameOf(type), ", given ", values.doubles_size(),
                     " doubles, ", values.integers_size(), " integers, ", values.codes_size(), " codes of ",
                     values.categories_size(), " categories (a vec3 is three doubles)"));
  }
  if (values.categories_size() > static_cast<int>(AttributeDefinition::kMaxCategories)) {
    return absl::InvalidArgumentError(absl::StrCat(values.categories_size(), " categories, expected at most ",
                                                   AttributeDefinition::kMaxCategories));
  }
  for (const std::string& text : values.categories()) {
    if (text.size() > AttributeDefinition::kMaxCategoryBytes) {
      return absl::InvalidArgumentError(absl::StrCat("a category of ", text.size(),
                                                     " bytes, expected at most ",
                                                     AttributeDefinition::kMaxCategoryBytes));
    }
  }
  for (uint32_t code : values.codes()) {
    if (code >= static_cast<uint32_t>(values.categories_size())) {
      return absl::InvalidArgumentError(
          absl::StrCat("code ", code, " of ", values.categories_size(), " categories"));
    }
  }
  return absl::OkStatus();
}

ValueWords NumberAt(const v1::Values& values, ValueType type, int k) {
  const auto real = [&values](int i) { return std::bit_cast<uint64_t>(values.doubles(i)); };
  if (type == ValueType::kInt64) return {static_cast<uint64_t>(values.integers(k)), 0, 0};
  if (type == ValueType::kDouble) return {real(k), 0, 0};
  return {real(3 * k), real(3 * k + 1), real(3 * k + 2)};
}

void AddNumber(ValueType type, const ValueWords& value, v1::Values& values) {
  if (type == ValueType::kInt64) {
    values.add_integers(static_cast<int64_t>(value[0]));
    return;
  }
  const unsigned width = type == ValueType::kVec3 ? 3 : 1;
  for (unsigned c = 0; c < width; ++c) values.add_doubles(std::bit_cast<double>(value[c]));
}

absl::StatusOr<AttributeDefinition> DefinitionFromWire(const v1::Attribute& wire) {
  AttributeDefinition d;
  d.name = wire.name();
  d.dimension = wire.dimension();
  d.number = wire.number();
  if (wire.type() == v1::VALUE_TYPE_UNSPECIFIED || !v1::ValueType_IsValid(wire.type())) {
    return absl::InvalidArgumentError(
        absl::StrCat("type ", static_cast<int>(wire.type()),
                     " of an attribute, expected double (1), int64 (2), vec3 (3) or category (4)"));
  }
  if (!v1::SplitRule_IsValid(wire.split())) {
    return absl::InvalidArgumentError(
        absl::StrCat("rule ", static_cast<int>(wire.split()),
                     " of an attribute, expected copy (1), mean (2), midpoint (3), zero (4) or divide (5)"));
  }
  d.type = static_cast<ValueType>(wire.type());
  if (wire.split() != v1::SPLIT_RULE_UNSPECIFIED) d.split = static_cast<SplitRule>(wire.split());
  if (absl::Status s = Validate(d); !s.ok()) return s;
  if (wire.has_fill()) {
    if (absl::Status s = CheckValues(wire.fill(), d.type, 1); !s.ok()) {
      return absl::InvalidArgumentError(absl::StrCat("fill of attribute ", d.name, ": ", s.message()));
    }
    if (d.type == ValueType::kCategory) {
      d.fill_text = wire.fill().categories(static_cast<int>(wire.fill().codes(0)));
    } else {
      d.fill = NumberAt(wire.fill(), d.type, 0);
    }
  }
  return d;
}

void ToWire(const AttributeDefinition& definition, v1::Attribute& wire) {
  wire.set_name(definition.name);
  wire.set_dimension(definition.dimension);
  wire.set_type(static_cast<v1::ValueType>(definition.type));
  wire.set_split(static_cast<v1::SplitRule>(definition.split));
  wire.set_number(definition.number);
  if (definition.type == ValueType::kCategory) {
    wire.mutable_fill()->add_codes(0);
    wire.mutable_fill()->add_categories(definition.fill_text);
  } else {
    AddNumber(definition.type, definition.fill, *wire.mutable_fill());
  }
}

}  // namespace ndmap::service

// SPDX-License-Identifier: GPL-3.0-or-later
// Attributes and their values as they are on the wire.
#pragma once

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/attributes/definition.h"
#include "ndmap/v1/attributes.pb.h"

namespace ndmap::service {

// Values and ids in one message.
inline constexpr int kMaxPart = 65536;

// "double", "int64", "vec3", "category".
absl::string_view NameOf(ValueType type);

// INVALID_ARGUMENT: no type or rule, a fill that is not one value of the type, or what core's Validate()
// says.
absl::StatusOr<AttributeDefinition> DefinitionFromWire(const v1::Attribute& wire);
void ToWire(const AttributeDefinition& definition, v1::Attribute& wire);

// INVALID_ARGUMENT unless these are `count` values of the type and nothing else, each code one of a category
// that is there, and each category short enough. O(values).
absl::Status CheckValues(const v1::Values& values, ValueType type, size_t count);
// Value k of values that were checked; not for categories.
ValueWords NumberAt(const v1::Values& values, ValueType type, int k);
// Adds a value; not for categories.
void AddNumber(ValueType type, const ValueWords& value, v1::Values& values);

}  // namespace ndmap::service

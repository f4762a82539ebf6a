// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/io/piece_fields.h"

#include <algorithm>
#include <bit>

#include "absl/strings/str_cat.h"

namespace ndmap {
namespace {

VtuField::Type FieldType(ValueType type) {
  switch (type) {
    case ValueType::kDouble:
      return VtuField::Type::kDoubles;
    case ValueType::kInt64:
      return VtuField::Type::kIntegers;
    case ValueType::kVec3:
      return VtuField::Type::kVectors;
    case ValueType::kCategory:
      break;
  }
  return VtuField::Type::kTexts;
}

}  // namespace

std::string FieldName(const std::string& attribute) {
  for (const char* own : {"id", "block", "level", "state"}) {
    if (attribute == own) return absl::StrCat(attribute, " (attribute)");
  }
  return attribute;
}

bool PieceFields::IsChosen(const Column& column) const {
  return !chosen_ || std::find(chosen_->begin(), chosen_->end(), column.definition().name) != chosen_->end();
}

absl::Status PieceFields::Look(const AttributeStore& store) {
  if (absl::Status s = store.CheckReadable(); !s.ok()) return s;
  table_ = &store.table(dimension_);
  std::vector<uint64_t> numbers;
  for (const auto& column : table_->columns()) numbers.push_back(column->definition().number);
  if (begun_) {
    return numbers == numbers_ ? absl::OkStatus()
                               : absl::AbortedError("attributes came or went while the block was exported");
  }
  begun_ = true;
  numbers_ = std::move(numbers);
  for (size_t i = 0; i < table_->columns().size(); ++i) {
    const auto& column = table_->columns()[i];
    if (!IsChosen(*column)) continue;
    columns_.push_back(i);
    VtuField field;
    field.name = FieldName(column->definition().name);
    field.type = FieldType(column->definition().type);
    fields_.push_back(std::move(field));
  }
  return absl::OkStatus();
}

void PieceFields::Add(const CellId& id) {
  const uint32_t row = table_->Find(id);
  if (row == AttributeTable::kNoRow) {
    without_values_ = id;
    return;
  }
  for (size_t i = 0; i < fields_.size(); ++i) {
    const Column& column = *table_->columns()[columns_[i]];
    const ValueWords value = column.Get(row);
    VtuField& field = fields_[i];
    switch (field.type) {
      case VtuField::Type::kDoubles:
      case VtuField::Type::kVectors:
        for (unsigned c = 0; c < column.width(); ++c)
          field.doubles.push_back(std::bit_cast<double>(value[c]));
        break;
      case VtuField::Type::kIntegers:
        field.integers.push_back(std::bit_cast<int64_t>(value[0]));
        break;
      case VtuField::Type::kTexts:
        field.texts.push_back(column.Text(value[0]));
        break;
    }
  }
}

absl::Status PieceFields::Check() const {
  if (!without_values_) return absl::OkStatus();
  return absl::AbortedError(
      absl::StrCat("cell ", without_values_->ToString(),
                   " is new: it has no values of attributes until the job that changes the map has ended"));
}

}  // namespace ndmap

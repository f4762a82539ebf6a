// SPDX-License-Identifier: Apache-2.0
// Columns of values: between the vectors of a program and messages.
#include <limits>
#include <utility>

#include "absl/container/flat_hash_map.h"
#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "client/sdk/attributes.h"

namespace ndmap {
namespace {

std::string TypeName(v1::ValueType type) {
  return absl::AsciiStrToLower(absl::StripPrefix(v1::ValueType_Name(type), "VALUE_TYPE_"));
}

// A column without values is of every type.
absl::Status CheckType(const AttributeColumn& column, v1::ValueType wanted) {
  if (column.type == wanted || column.type == v1::VALUE_TYPE_UNSPECIFIED) return absl::OkStatus();
  return absl::FailedPreconditionError(absl::StrCat("values of '", column.name, "' are of type ",
                                                    TypeName(column.type), ", not ", TypeName(wanted)));
}

// The type that so many values for so many cells have; false if they have none.
bool SetValues(const v1::Values& values, size_t cells, AttributeColumn* column) {
  const auto size = [](const auto& field) { return static_cast<size_t>(field.size()); };
  column->doubles.assign(values.doubles().begin(), values.doubles().end());
  column->integers.assign(values.integers().begin(), values.integers().end());
  column->codes.assign(values.codes().begin(), values.codes().end());
  column->categories.assign(values.categories().begin(), values.categories().end());
  const size_t doubles = size(values.doubles()), integers = size(values.integers()),
               codes = size(values.codes());
  if (cells == 0) return doubles + integers + codes == 0;
  if (doubles == cells && integers + codes == 0) {
    column->type = v1::VALUE_TYPE_DOUBLE;
  } else if (doubles == 3 * cells && integers + codes == 0) {
    column->type = v1::VALUE_TYPE_VEC3;
  } else if (integers == cells && doubles + codes == 0) {
    column->type = v1::VALUE_TYPE_INT64;
  } else if (codes == cells && doubles + integers == 0) {
    column->type = v1::VALUE_TYPE_CATEGORY;
    for (uint32_t code : column->codes) {
      if (code >= column->categories.size()) return false;
    }
  } else {
    return false;
  }
  return true;
}

}  // namespace

v1::CellSelection TheseCells(const CellIds& ids) {
  v1::CellSelection select;
  select.mutable_ids()->mutable_hi()->Add(ids.hi.begin(), ids.hi.end());
  select.mutable_ids()->mutable_lo()->Add(ids.lo.begin(), ids.lo.end());
  return select;
}

v1::CellSelection AllCells() {
  v1::CellSelection select;
  select.mutable_all();
  return select;
}

v1::CellSelection CellsOfLevels(uint32_t lowest, uint32_t highest) {
  v1::CellSelection select = AllCells();
  select.set_by_level(true);
  select.set_lowest_level(lowest);
  select.set_highest_level(highest);
  return select;
}

v1::CellSelection CellsOf(const v1::ExploreRequest& question) {
  v1::CellSelection select;
  *select.mutable_query() = question;
  return select;
}

AttributeColumn AttributeColumn::Doubles(std::vector<double> values) {
  AttributeColumn column;
  column.type = v1::VALUE_TYPE_DOUBLE;
  column.doubles = std::move(values);
  return column;
}

AttributeColumn AttributeColumn::Integers(std::vector<int64_t> values) {
  AttributeColumn column;
  column.type = v1::VALUE_TYPE_INT64;
  column.integers = std::move(values);
  return column;
}

AttributeColumn AttributeColumn::Vectors(absl::Span<const std::array<double, 3>> values) {
  AttributeColumn column;
  column.type = v1::VALUE_TYPE_VEC3;
  for (const std::array<double, 3>& value : values)
    column.doubles.insert(column.doubles.end(), value.begin(), value.end());
  return column;
}

AttributeColumn AttributeColumn::Texts(absl::Span<const std::string> values) {
  AttributeColumn column;
  column.type = v1::VALUE_TYPE_CATEGORY;
  absl::flat_hash_map<absl::string_view, uint32_t> known;
  for (const std::string& value : values) {
    const auto [it, added] = known.try_emplace(value, static_cast<uint32_t>(column.categories.size()));
    if (added) column.categories.push_back(value);
    column.codes.push_back(it->second);
  }
  return column;
}

size_t AttributeColumn::size() const {
  switch (type) {
    case v1::VALUE_TYPE_DOUBLE:
      return doubles.size();
    case v1::VALUE_TYPE_VEC3:
      return doubles.size() / 3;
    case v1::VALUE_TYPE_INT64:
      return integers.size();
    case v1::VALUE_TYPE_CATEGORY:
      return codes.size();
    default:
      return 0;
  }
}

absl::StatusOr<absl::Span<const double>> AttributeColumn::AsDoubles() const {
  if (absl::Status s = CheckType(*this, v1::VALUE_TYPE_DOUBLE); !s.ok()) return s;
  return absl::MakeConstSpan(doubles);
}

absl::StatusOr<absl::Span<const int64_t>> AttributeColumn::AsIntegers() const {
  if (absl::Status s = CheckType(*this, v1::VALUE_TYPE_INT64); !s.ok()) return s;
  return absl::MakeConstSpan(integers);
}

absl::StatusOr<std::vector<std::array<double, 3>>> AttributeColumn::AsVectors() const {
  if (absl::Status s = CheckType(*this, v1::VALUE_TYPE_VEC3); !s.ok()) return s;
  std::vector<std::array<double, 3>> values(doubles.size() / 3);
  for (size_t i = 0; i < values.size(); ++i)
    values[i] = {doubles[3 * i], doubles[3 * i + 1], doubles[3 * i + 2]};
  return values;
}

absl::StatusOr<std::vector<absl::string_view>> AttributeColumn::AsTexts() const {
  if (absl::Status s = CheckType(*this, v1::VALUE_TYPE_CATEGORY); !s.ok()) return s;
  std::vector<absl::string_view> values;
  values.reserve(codes.size());
  for (uint32_t code : codes) {
    if (code >= categories.size()) {
      return absl::FailedPreconditionError(
          absl::StrCat("values of '", name, "': code ", code, " of ", categories.size(), " categories"));
    }
    values.push_back(categories[code]);
  }
  return values;
}

namespace internal {

absl::StatusOr<CellValues> ToCellValues(const v1::ReadAttributesResponse& part,
                                        const std::vector<std::string>& names, absl::string_view who) {
  const auto wrong = [&](absl::string_view what) {
    return absl::DataLossError(absl::StrCat(who, " sent values that make no sense: ", what));
  };
  CellValues values;
  values.cells.hi.assign(part.cell_hi().begin(), part.cell_hi().end());
  values.cells.lo.assign(part.cell_lo().begin(), part.cell_lo().end());
  if (values.cells.hi.size() != values.cells.lo.size()) return wrong("half an id");
  if (static_cast<size_t>(part.columns_size()) != names.size()) {
    return wrong(absl::StrCat(part.columns_size(), " columns for ", names.size(), " names"));
  }
  for (size_t i = 0; i < names.size(); ++i) {
    AttributeColumn column;
    column.name = names[i];
    if (!SetValues(part.columns(static_cast<int>(i)), values.cells.size(), &column)) {
      return wrong(absl::StrCat("'", names[i], "' has no value for each of ", values.cells.size(), " cells"));
    }
    values.columns.push_back(std::move(column));
  }
  for (uint32_t place : part.missing()) {
    if (place >= values.cells.size()) return wrong("a place beyond the end");
    values.missing.push_back(place);
  }
  return values;
}

v1::Values ToValues(const AttributeColumn& column, size_t begin, size_t end) {
  v1::Values values;
  const size_t width = column.type == v1::VALUE_TYPE_VEC3 ? 3 : 1;
  const auto part = [&](const auto& all, size_t each, auto* field) {
    if (all.empty()) return;
    field->Add(all.begin() + static_cast<std::ptrdiff_t>(begin * each),
               all.begin() + static_cast<std::ptrdiff_t>(end * each));
  };
  part(column.doubles, width, values.mutable_doubles());
  part(column.integers, 1, values.mutable_integers());
  constexpr uint32_t kNew = std::numeric_limits<uint32_t>::max();
  std::vector<uint32_t> renumbered(column.codes.empty() ? 0 : column.categories.size(), kNew);
  for (size_t i = begin; i < end && i < column.codes.size(); ++i) {
    uint32_t& code = renumbered[column.codes[i]];
    if (code == kNew) {
      code = static_cast<uint32_t>(values.categories_size());
      values.add_categories(column.categories[column.codes[i]]);
    }
    values.add_codes(code);
  }
  return values;
}

}  // namespace internal
}  // namespace ndmap

// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/attribute_columns.h"

#include <algorithm>
#include <bit>
#include <utility>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "core/attributes/cell_measure.h"
#include "server/cell_details.h"
#include "service/attributes.h"

namespace ndmap::server {
namespace {

using Kind = AskedColumn::Kind;

constexpr int kMaxNames = 64;

Point3 CentreOf(Block3& block, DartIndex dart, unsigned dimension) {
  auto& map = block.map();
  return CellMeasure<Block3>(map).CentreOf(DartAt(map, dart), dimension);
}
double VolumeOf(Block3& block, DartIndex dart) {
  auto& map = block.map();
  return CellMeasure<Block3>(map).VolumeOf(map.attribute<3>(DartAt(map, dart)));
}

struct BuiltIn {
  absl::string_view name;
  Kind kind;
  ValueType type;
  // Only of hexahedra.
  bool of_hexahedra;
};
constexpr BuiltIn kBuiltIns[] = {{"@point", Kind::kPoint, ValueType::kVec3, false},
                                 {"@level", Kind::kLevel, ValueType::kInt64, false},
                                 {"@block", Kind::kBlock, ValueType::kInt64, false},
                                 {"@volume", Kind::kVolume, ValueType::kDouble, true},
                                 {"@state", Kind::kState, ValueType::kCategory, true}};

absl::Status NoAttribute(const AttributeTable& table, unsigned dimension, const std::string& name) {
  std::string there;
  for (const auto& column : table.columns()) absl::StrAppend(&there, column->definition().name, ", ");
  return absl::NotFoundError(absl::StrCat(
      "no attribute \"", absl::CHexEscape(name.substr(0, 128)), "\" of cells of dimension ", dimension,
      "; there are ", there, "@point, @level, @block", dimension == 3 ? ", @volume, @state" : ""));
}

}  // namespace

size_t AskedColumn::bytes() const {
  constexpr size_t kCategory = AttributeDefinition::kMaxCategoryBytes + 16;
  return type == ValueType::kCategory ? kCategory : width() * sizeof(double);
}

absl::StatusOr<std::vector<AskedColumn>> ResolveColumns(const AttributeStore& store, unsigned dimension,
                                                        const Names& names) {
  if (dimension > 3) {
    return absl::InvalidArgumentError(absl::StrCat("cells of dimension ", dimension, ", expected 0 to 3"));
  }
  if (names.size() > kMaxNames) {
    return absl::InvalidArgumentError(absl::StrCat(names.size(), " names, expected at most ", kMaxNames));
  }
  const AttributeTable& table = store.table(dimension);
  std::vector<AskedColumn> columns;
  for (const std::string& name : names) {
    if (const Column* there = table.Find(name); there != nullptr) {
      columns.push_back({name, Kind::kAttribute, there->definition().type});
      continue;
    }
    const auto* built_in = std::find_if(std::begin(kBuiltIns), std::end(kBuiltIns),
                                        [&](const BuiltIn& b) { return b.name == name; });
    if (built_in == std::end(kBuiltIns)) return NoAttribute(table, dimension, name);
    if (built_in->of_hexahedra && dimension != 3) {
      return absl::InvalidArgumentError(
          absl::StrCat(name, " is of hexahedra, not of cells of dimension ", dimension));
    }
    columns.push_back({name, built_in->kind, built_in->type});
  }
  return columns;
}

absl::StatusOr<RowView> RowView::Make(Block3& block, const AttributeStore& store, unsigned dimension,
                                      const std::vector<AskedColumn>& columns, bool whole) {
  if (absl::Status s = store.CheckReadable(); !s.ok()) return s;
  const bool of_map =
      whole || std::any_of(columns.begin(), columns.end(), [](const AskedColumn& c) { return c.of_map(); });
  if (of_map && block.version() != store.block_version()) {
    return absl::AbortedError(absl::StrCat(
        "block ", block.id().value,
        " has changed since its attributes were brought up to date, so points, volumes and states of its "
        "cells cannot be told until the job that changes the map has ended"));
  }
  RowView view(&block, &store.table(dimension), dimension, columns);
  for (const AskedColumn& column : columns) {
    const Column* attribute = nullptr;
    if (column.kind == Kind::kAttribute) {
      attribute = store.table(dimension).Find(column.name);
      if (attribute == nullptr || attribute->definition().type != column.type) {
        return absl::AbortedError(
            absl::StrCat("attribute ", column.name, " was dropped or defined anew: ask again"));
      }
    }
    view.attributes_.push_back(attribute);
  }
  return view;
}

RowView RowView::Of(Block3* block, unsigned dimension, const std::vector<AskedColumn>& columns,
                    absl::Span<const FoundCell> cells) {
  RowView view(block, nullptr, dimension, columns);
  view.cells_ = cells;
  view.attributes_.resize(columns.size());
  return view;
}

ValueWords RowView::Get(size_t column, uint32_t row) const {
  switch ((*columns_)[column].kind) {
    case Kind::kAttribute:
      return attributes_[column]->Get(row);
    case Kind::kPoint: {
      const Point3 p = block_ == nullptr ? cells_[row].point : CentreOf(*block_, dart(row), dimension_);
      return {std::bit_cast<uint64_t>(p[0]), std::bit_cast<uint64_t>(p[1]), std::bit_cast<uint64_t>(p[2])};
    }
    case Kind::kLevel:
      return {static_cast<uint64_t>(id(row).level()), 0, 0};
    case Kind::kBlock:
      return {block_of(row), 0, 0};
    case Kind::kVolume:
      return {std::bit_cast<uint64_t>(VolumeOf(*block_, dart(row))), 0, 0};
    case Kind::kState:
      break;
  }
  return {};
}

uint64_t RowView::CodeOf(size_t column, uint32_t row) const {
  if (attributes_[column] != nullptr) return attributes_[column]->Get(row)[0];
  auto& map = block_->map();
  return static_cast<uint64_t>(map.info<3>(DartAt(map, dart(row))).state);
}

absl::string_view RowView::TextOf(size_t column, uint64_t code) const {
  if (attributes_[column] != nullptr) return attributes_[column]->Text(code);
  return StateName(static_cast<CellState>(code));
}

PartBuilder::PartBuilder(const std::vector<AskedColumn>& columns) : columns_(columns) {
  size_t bytes = 2 * sizeof(uint64_t);
  for (const AskedColumn& column : columns) bytes += column.bytes();
  most_ = std::min(kCells, kBytes / bytes);
  Clear();
}

void PartBuilder::Clear() {
  part_.Clear();
  for (size_t k = 0; k < columns_.size(); ++k) part_.add_columns();
  texts_.assign(columns_.size(), {});
  cells_ = 0;
}

void PartBuilder::BeginBlock() {
  for (Texts& texts : texts_) texts.codes.clear();
}

void PartBuilder::Add(const RowView& view, uint32_t row) {
  ++cells_;
  for (size_t k = 0; k < columns_.size(); ++k) {
    v1::Values& values = *part_.mutable_columns(static_cast<int>(k));
    if (columns_[k].type != ValueType::kCategory) {
      service::AddNumber(columns_[k].type, view.Get(k, row), values);
      continue;
    }
    const uint64_t code = view.CodeOf(k, row);
    const auto [it, made] = texts_[k].codes.try_emplace(code, 0);
    if (made) {
      const std::string text(view.TextOf(k, code));
      const auto [place, added] =
          texts_[k].places.try_emplace(text, static_cast<uint32_t>(values.categories_size()));
      if (added) values.add_categories(text);
      it->second = place->second;
    }
    values.add_codes(it->second);
  }
}

size_t RowsAStep(const std::vector<AskedColumn>& columns) {
  size_t cost = 1;
  for (const AskedColumn& column : columns) cost += column.of_map() ? 8 : 1;
  return std::max<size_t>(32, 8192 / cost);
}

}  // namespace ndmap::server

// SPDX-License-Identifier: GPL-3.0-or-later
// Attributes of a block as fields of a piece: a value for each point or cell, in the order in which these are
// added.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "core/attributes/table.h"
#include "core/io/vtu_writer.h"
#include "core/map/ids.h"

namespace ndmap {

// Names of attributes; nothing: all.
using ChosenAttributes = std::optional<std::vector<std::string>>;

// The array's name for an attribute: its own, unless pieces have an array of that name themselves. No
// attribute's name has a space.
std::string FieldName(const std::string& attribute);

// The attributes of one dimension. Reading goes in steps, between which the block works for others: Look()
// begins each, Add() may follow until it ends.
class PieceFields {
 public:
  // `chosen`: of any dimension.
  explicit PieceFields(unsigned dimension, ChosenAttributes chosen = std::nullopt)
      : dimension_(dimension), chosen_(std::move(chosen)) {}

  // ABORTED while attributes are brought up to date, or when there are other ones than at the first step.
  absl::Status Look(const AttributeStore& store);
  // The values of a cell. O(attributes).
  void Add(const CellId& id);
  // ABORTED when a cell was added that is so new that it has no values yet.
  absl::Status Check() const;
  bool empty() const { return fields_.empty(); }
  std::vector<VtuField> Take() { return std::move(fields_); }

 private:
  bool IsChosen(const Column& column) const;

  const unsigned dimension_;
  const ChosenAttributes chosen_;
  bool begun_ = false;
  // Of the attributes, in the order of the fields.
  std::vector<uint64_t> numbers_;
  std::vector<VtuField> fields_;
  // By field, among the table's.
  std::vector<size_t> columns_;
  std::optional<CellId> without_values_;
  // Good for one step.
  const AttributeTable* table_ = nullptr;
};

}  // namespace ndmap

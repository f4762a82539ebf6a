// SPDX-License-Identifier: GPL-3.0-or-later
// Attributes of a block as fields of a piece: a value for each point or cell, in the order in which these are
// added.
#pragma once

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "core/attributes/table.h"
#include "core/io/vtu_writer.h"
#include "core/map/ids.h"

namespace ndmap {

// The attributes of one dimension. Reading goes in steps, between which the block works for others: Look()
// begins each, Add() may follow until it ends.
class PieceFields {
 public:
  explicit PieceFields(unsigned dimension) : dimension_(dimension) {}

  // ABORTED while attributes are brought up to date, or when there are other ones than at the first step.
  absl::Status Look(const AttributeStore& store);
  // The values of a cell. O(attributes).
  void Add(const CellId& id);
  // ABORTED when a cell was added that is so new that it has no values yet.
  absl::Status Check() const;
  bool empty() const { return fields_.empty(); }
  std::vector<VtuField> Take() { return std::move(fields_); }

 private:
  const unsigned dimension_;
  bool begun_ = false;
  // Of the attributes, in the order of the fields.
  std::vector<uint64_t> numbers_;
  std::vector<VtuField> fields_;
  std::optional<CellId> without_values_;
  // Good for one step.
  const AttributeTable* table_ = nullptr;
};

}  // namespace ndmap

// SPDX-License-Identifier: GPL-3.0-or-later
// What the names of a question about values mean: attributes, and what the map itself knows of its cells.
#pragma once

#include <string>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/types/span.h"
#include "core/attributes/table.h"
#include "core/geometry/surface.h"
#include "core/map/block.h"
#include "ndmap/v1/attributes.pb.h"

namespace ndmap::server {

using Names = google::protobuf::RepeatedPtrField<std::string>;

// A name that was understood.
struct AskedColumn {
  enum class Kind { kAttribute, kPoint, kLevel, kBlock, kVolume, kState };
  std::string name;
  Kind kind = Kind::kAttribute;
  ValueType type = ValueType::kDouble;

  unsigned width() const { return type == ValueType::kVec3 ? 3 : type == ValueType::kCategory ? 0 : 1; }
  // Bytes of a value on the wire, at most.
  size_t bytes() const;
  // What is read from the map's darts rather than from rows.
  bool of_map() const { return kind == Kind::kPoint || kind == Kind::kVolume || kind == Kind::kState; }
};

// NOT_FOUND: no such attribute. INVALID_ARGUMENT: too many names, or one that is not for this dimension.
absl::StatusOr<std::vector<AskedColumn>> ResolveColumns(const AttributeStore& store, unsigned dimension,
                                                        const Names& names);

// A cell of a dimension that has no attributes, and so no rows.
struct FoundCell {
  CellId id;
  DartIndex dart;
  uint32_t block = 0;
  // Only where it is asked for and the block is not at hand.
  Point3 point{};
};

// The rows of a dimension in one block, for one step; or cells that were found without rows.
class RowView {
 public:
  // ABORTED: they are being brought up to date, the columns are no more what they were, or the block has
  // changed since (when something `of_map` is asked, or `whole`).
  static absl::StatusOr<RowView> Make(Block3& block, const AttributeStore& store, unsigned dimension,
                                      const std::vector<AskedColumn>& columns, bool whole = false);
  // All outlive the view. `block`: whose cells they are, at the version at which they were found; null: of
  // any blocks, and what is asked of them is points, levels and blocks.
  static RowView Of(Block3* block, unsigned dimension, const std::vector<AskedColumn>& columns,
                    absl::Span<const FoundCell> cells);

  size_t size() const { return table_ == nullptr ? cells_.size() : table_->size(); }
  CellId id(uint32_t row) const { return table_ == nullptr ? cells_[row].id : table_->id(row); }
  DartIndex dart(uint32_t row) const { return table_ == nullptr ? cells_[row].dart : table_->dart(row); }
  uint32_t block_of(uint32_t row) const { return table_ == nullptr ? cells_[row].block : block_->id().value; }
  // Another block has the cell, too, and counts it.
  bool CountsElsewhere(uint32_t row) const {
    return table_ != nullptr && table_->Is(row, AttributeTable::kElsewhere);
  }
  // kNoRow where there are no rows.
  uint32_t Find(const CellId& id) const {
    return table_ == nullptr ? AttributeTable::kNoRow : table_->Find(id);
  }
  Block3& block() const { return *block_; }
  // A number.
  ValueWords Get(size_t column, uint32_t row) const;
  // Of a category: the same for the same text in one block.
  uint64_t CodeOf(size_t column, uint32_t row) const;
  absl::string_view TextOf(size_t column, uint64_t code) const;

 private:
  RowView(Block3* block, const AttributeTable* table, unsigned dimension,
          const std::vector<AskedColumn>& columns)
      : block_(block), table_(table), dimension_(dimension), columns_(&columns) {}

  Block3* block_;
  const AttributeTable* table_;
  absl::Span<const FoundCell> cells_;
  unsigned dimension_;
  const std::vector<AskedColumn>* columns_;
  // By column; null for what the map knows.
  std::vector<const Column*> attributes_;
};

// Fills a part of an answer, row by row; texts are shared by the part.
class PartBuilder {
 public:
  // Bytes of values in a part, and cells.
  static constexpr size_t kBytes = size_t{4} << 20;
  static constexpr size_t kCells = 1 << 15;

  explicit PartBuilder(const std::vector<AskedColumn>& columns);

  // Cells that fit into one part.
  size_t most() const { return most_; }
  bool full() const { return cells_ == most_; }
  bool empty() const { return cells_ == 0; }
  // Another block's codes mean other texts.
  void BeginBlock();
  // The values of one row; the caller adds the cell's id or place to part().
  void Add(const RowView& view, uint32_t row);
  v1::ReadBlocksResponse& part() { return part_; }
  // Begins the next.
  void Clear();

 private:
  struct Texts {
    // Codes of the block, and texts, to places in the part.
    absl::flat_hash_map<uint64_t, uint32_t> codes;
    absl::flat_hash_map<std::string, uint32_t> places;
  };
  const std::vector<AskedColumn>& columns_;
  size_t most_;
  size_t cells_ = 0;
  v1::ReadBlocksResponse part_;
  std::vector<Texts> texts_;
};

// Rows in a step of about a millisecond.
size_t RowsAStep(const std::vector<AskedColumn>& columns);

}  // namespace ndmap::server

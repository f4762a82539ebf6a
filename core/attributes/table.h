// SPDX-License-Identifier: GPL-3.0-or-later
// The attributes of one block: for each dimension the block's cells in rows, found by id, and the columns of
// values. A row is an id, a dart, flags and one value of each column; nothing here reads the map.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "core/attributes/column.h"
#include "core/attributes/definition.h"
#include "core/map/growable_array.h"
#include "core/map/ids.h"

namespace ndmap {

class AttributeTable {
 public:
  static constexpr uint32_t kNoRow = 0xffffffff;
  enum Flag : uint8_t {
    // The cell counts in another block, which has it too.
    kElsewhere = 1,
    // While rows are brought up to date: the cell is still there; the other blocks were told of it.
    kSeen = 2,
    kTold = 4,
  };

  size_t size() const { return size_; }
  // O(1).
  uint32_t Find(const CellId& id) const;
  // A row for a new cell, with the fill values. Throws std::bad_alloc.
  uint32_t Add(const CellId& id);
  // The last row takes its number. O(columns).
  void Remove(uint32_t row);

  CellId id(uint32_t row) const { return CellId::FromWords(hi_[row], lo_[row]); }
  // A dart of the cell, when the table was last brought up to date.
  DartIndex dart(uint32_t row) const { return DartIndex{darts_[row]}; }
  void set_dart(uint32_t row, DartIndex dart) { darts_[row] = dart.value; }
  bool Is(uint32_t row, Flag flag) const { return (flags_[row] & flag) != 0; }
  void Mark(uint32_t row, Flag flag) { flags_[row] |= flag; }
  void Unmark(uint32_t row, unsigned flags) { flags_[row] &= static_cast<uint8_t>(~flags); }

  std::vector<std::unique_ptr<Column>>& columns() { return columns_; }
  const std::vector<std::unique_ptr<Column>>& columns() const { return columns_; }
  // nullptr if there is none.
  Column* Find(absl::string_view name) const;
  Column* FindNumber(uint64_t number) const;
  // A column whose rows hold anything as yet: see NewColumn.
  Column* AddColumn(const AttributeDefinition& definition);

  void Clear();
  // Bytes of rows and columns.
  size_t bytes() const;

 private:
  // Many small tables: growing one is a short step.
  static constexpr size_t kShards = 256;
  static size_t ShardOf(const CellId& id) {
    return static_cast<size_t>(((id.lo() ^ id.hi() * 0x9e3779b97f4a7c15u) * 0xff51afd7ed558ccdu) >> 56);
  }
  void Reserve(size_t rows);

  size_t size_ = 0;
  size_t reserved_ = 0;
  GrowableArray<uint64_t> hi_, lo_;
  GrowableArray<uint32_t> darts_;
  GrowableArray<uint8_t> flags_;
  std::array<absl::flat_hash_map<CellId, uint32_t>, kShards> rows_;
  std::vector<std::unique_ptr<Column>> columns_;
};

// A column to be filled.
struct NewColumn {
  Column* column = nullptr;
  // Its rows, and how many of them have the fill value.
  size_t rows = 0;
  size_t filled = 0;

  // Up to `most` more; true when all are.
  bool Fill(size_t most);
};

// All attributes of a block. Only the block's thread touches it.
class AttributeStore {
 public:
  AttributeTable& table(unsigned dimension) { return tables_[dimension]; }
  const AttributeTable& table(unsigned dimension) const { return tables_[dimension]; }

  // Columns come and go until they are those of `definitions`. Returns the new ones; their rows are to be
  // filled before anybody reads them. O(attributes).
  std::vector<NewColumn> Define(const std::vector<AttributeDefinition>& definitions);

  // Between the two calls rows come and go, and nobody else is to look. `version`: of the block, whose darts
  // the rows then name.
  void BeginUpdate() { updating_ = true; }
  void EndUpdate(uint64_t version) {
    updating_ = false;
    block_version_ = version;
  }
  uint64_t block_version() const { return block_version_; }
  // ABORTED while it is being brought up to date.
  absl::Status CheckReadable() const;

  // Writes come with numbers that rise; false for one that is late.
  bool AcceptWrite(uint64_t sequence) {
    if (sequence <= last_write_) return false;
    last_write_ = sequence;
    return true;
  }
  size_t bytes() const;

 private:
  std::array<AttributeTable, 4> tables_;
  bool updating_ = false;
  uint64_t block_version_ = 0;
  uint64_t last_write_ = 0;
};

}  // namespace ndmap

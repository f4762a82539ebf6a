// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/attributes/table.h"

#include <algorithm>
#include <new>

namespace ndmap {

uint32_t AttributeTable::Find(const CellId& id) const {
  const auto& shard = rows_[ShardOf(id)];
  const auto it = shard.find(id);
  return it == shard.end() ? kNoRow : it->second;
}

void AttributeTable::Reserve(size_t rows) {
  if (rows <= reserved_) return;
  if (rows >= kNoRow) throw std::bad_alloc();
  const size_t more = std::max(rows, reserved_ + reserved_ / 2);
  hi_.Reserve(more);
  lo_.Reserve(more);
  darts_.Reserve(more);
  flags_.Reserve(more);
  for (auto& column : columns_) column->Reserve(more);
  reserved_ = more;
}

uint32_t AttributeTable::Add(const CellId& id) {
  Reserve(size_ + 1);
  const auto row = static_cast<uint32_t>(size_);
  rows_[ShardOf(id)].emplace(id, row);
  hi_[row] = id.hi();
  lo_[row] = id.lo();
  darts_[row] = DartIndex::kNone;
  flags_[row] = 0;
  for (auto& column : columns_) column->Set(row, column->fill());
  ++size_;
  return row;
}

void AttributeTable::Remove(uint32_t row) {
  const CellId gone = id(row);
  rows_[ShardOf(gone)].erase(gone);
  const auto last = static_cast<uint32_t>(--size_);
  if (row == last) return;
  const CellId moved = id(last);
  rows_[ShardOf(moved)][moved] = row;
  hi_[row] = hi_[last];
  lo_[row] = lo_[last];
  darts_[row] = darts_[last];
  flags_[row] = flags_[last];
  for (auto& column : columns_) column->Set(row, column->Get(last));
}

Column* AttributeTable::Find(absl::string_view name) const {
  for (const auto& column : columns_) {
    if (column->definition().name == name) return column.get();
  }
  return nullptr;
}

Column* AttributeTable::FindNumber(uint64_t number) const {
  for (const auto& column : columns_) {
    if (column->definition().number == number) return column.get();
  }
  return nullptr;
}

Column* AttributeTable::AddColumn(const AttributeDefinition& definition) {
  auto column = std::make_unique<Column>(definition);
  column->Reserve(std::max<size_t>(reserved_, 1));
  columns_.push_back(std::move(column));
  return columns_.back().get();
}

bool NewColumn::Fill(size_t most) {
  for (; most > 0 && filled < rows; --most) column->Set(static_cast<uint32_t>(filled++), column->fill());
  return filled == rows;
}

void AttributeTable::Clear() { *this = AttributeTable(); }

size_t AttributeTable::bytes() const {
  size_t sum = hi_.capacity() * 8 + lo_.capacity() * 8 + darts_.capacity() * 4 + flags_.capacity();
  for (const auto& shard : rows_) sum += shard.capacity() * (sizeof(std::pair<CellId, uint32_t>) + 1);
  for (const auto& column : columns_) sum += column->bytes();
  return sum;
}

std::vector<NewColumn> AttributeStore::Define(const std::vector<AttributeDefinition>& definitions) {
  std::vector<NewColumn> added;
  for (unsigned i = 0; i < tables_.size(); ++i) {
    AttributeTable& table = tables_[i];
    const auto wanted = [&](const std::unique_ptr<Column>& column) {
      return std::find(definitions.begin(), definitions.end(), column->definition()) != definitions.end();
    };
    auto& columns = table.columns();
    columns.erase(std::remove_if(columns.begin(), columns.end(), [&](const auto& c) { return !wanted(c); }),
                  columns.end());
    for (const AttributeDefinition& definition : definitions) {
      if (definition.dimension == i && table.FindNumber(definition.number) == nullptr)
        added.push_back({table.AddColumn(definition), table.size(), 0});
    }
    if (columns.empty()) table.Clear();
  }
  return added;
}

absl::Status AttributeStore::CheckReadable() const {
  if (!updating_) return absl::OkStatus();
  return absl::AbortedError("the map's attributes are being brought up to date: try again in a moment");
}

size_t AttributeStore::bytes() const {
  size_t sum = 0;
  for (const AttributeTable& table : tables_) sum += table.bytes();
  return sum;
}

}  // namespace ndmap

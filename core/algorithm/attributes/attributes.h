// SPDX-License-Identifier: GPL-3.0-or-later
// Brings the attributes of a block up to date with its cells and with the list of attributes: new cells get
// values from those that they were made of (core/attributes/inherit.h), rows of cells that are gone go. What
// a cell gets follows from its id and the values before, which are the same in all blocks that share it; so
// no value travels. Blocks only settle which of them counts a shared cell, the lowest: each tells an arbiter,
// which follows from the id, of its cells on faces that are not closed in the block.
//
// Parameter: definitions (EncodeDefinitions). Counts: values_0 ... values_3, the cells of each dimension that
// have a row, each once in the whole map; new_values, rows made in all blocks.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "core/algorithm/block_algorithm.h"
#include "core/algorithm/packing.h"
#include "core/attributes/inherit.h"
#include "core/attributes/table.h"
#include "core/map/block.h"
#include "core/map/partial_scan.h"
#include "core/names/cell_names.h"

namespace ndmap {

template <class BlockT>
class Attributes final : public BlockAlgorithm {
 public:
  using Lcc = typename BlockT::Lcc;
  using Dart = typename BlockT::Dart;
  using Cell = typename BlockT::Types::Cell;
  static constexpr unsigned n = BlockT::n;
  static_assert(n == 2 || n == 3);
  // The label is the id of a cell, the payload its dimension. To the arbiter: the sender has it. From the
  // arbiter: a lower block has it.
  enum MessageKind : uint8_t { kHave = 1, kCountedElsewhere = 2 };

  static absl::StatusOr<std::unique_ptr<BlockAlgorithm>> Make(const Parameters& parameters,
                                                              const Environment& environment, BlockT& block) {
    absl::StatusOr<std::string> text = parameters.Text("definitions");
    if (!text.ok()) return text.status();
    absl::StatusOr<std::vector<AttributeDefinition>> definitions = DecodeDefinitions(*text);
    if (!definitions.ok()) return definitions.status();
    bool parts = false;
    for (const AttributeDefinition& d : *definitions) {
      parts = parts || d.dimension < n;
      if (d.dimension <= n) continue;
      return absl::InvalidArgumentError(absl::StrCat("attribute \"", d.name, "\" is of cells of dimension ",
                                                     d.dimension, ", and the map has dimension ", n));
    }
    if (parts && environment.initial == nullptr) {
      return absl::FailedPreconditionError(
          "attributes of vertices, edges and faces need the initial cells, which this map was made without");
    }
    auto store = environment.attributes;
    if (store == nullptr) store = std::make_shared<AttributeStore>();
    return std::make_unique<Attributes>(*std::move(definitions), environment, std::move(store), block);
  }

  Attributes(std::vector<AttributeDefinition> definitions, const Environment& environment,
             std::shared_ptr<AttributeStore> store, BlockT& block)
      : definitions_(std::move(definitions)),
        self_(environment.self),
        block_count_(environment.block_count),
        initial_(environment.initial),
        store_(std::move(store)),
        block_(block),
        map_(block.map()),
        cells_(map_.template attributes<n>()) {
    if (initial_ != nullptr) names_.emplace(map_, *initial_);
  }

  bool changes_map() const override { return false; }

  // A step is some rows of a new column.
  absl::StatusOr<bool> Start(size_t budget) override {
    if (!begun_) Begin();
    while (!new_columns_.empty() && budget-- > 0) {
      if (new_columns_.back().Fill(kRowsAStep)) new_columns_.pop_back();
    }
    return new_columns_.empty();
  }

  absl::Status Receive(BlockId from, const Message& message, Outbox& out) override {
    uint8_t dimension = 0;
    const CellId id = CellId::FromWords(message.label.root, message.label.path);
    if (!FromBytes(message.payload, &dimension) || dimension > n || !id.IsWellFormed() ||
        (message.kind != kHave && message.kind != kCountedElsewhere)) {
      return absl::InvalidArgumentError(
          absl::StrCat("attributes: message kind ", message.kind, " from block ", from.value));
    }
    if (message.kind == kHave) {
      Arbitrate(from, id, dimension, out);
    } else {
      CountedElsewhere(id, dimension);
    }
    return absl::OkStatus();
  }

  // A step is a hexahedron, then a row.
  absl::StatusOr<size_t> Work(size_t budget, Outbox& out) override {
    size_t left = budget;
    if (scanning_ && cells_.Next(&left, [&](Cell cell) { Visit(cell, out); })) {
      scanning_ = false;
      sweeping_ = 0;
    }
    while (!scanning_ && sweeping_ < 4 && left > 0) Sweep(&left);
    return budget - left;
  }

  bool HasWork() const override { return scanning_ || sweeping_ < 4; }
  // It is short, and half of it would be of no use to anybody: it goes on.
  void Cancel() override {}

  absl::StatusOr<bool> Finish(size_t budget) override {
    for (; counting_ < 4 && budget > 0; --budget) {
      const AttributeTable& table = store_->table(counting_);
      if (counted_ == table.size()) {
        report_.counts[absl::StrCat("values_", counting_)] = here_;
        ++counting_;
        counted_ = 0;
        here_ = 0;
      } else if (!table.Is(static_cast<uint32_t>(counted_++), AttributeTable::kElsewhere)) {
        ++here_;
      }
    }
    if (counting_ < 4) return false;
    report_.counts["new_values"] = new_rows_;
    store_->EndUpdate(block_.version());
    return true;
  }

  Report report() const override { return report_; }

 private:
  static constexpr size_t kRowsAStep = 256;

  void Begin() {
    begun_ = true;
    store_->BeginUpdate();
    new_columns_ = store_->Define(definitions_);
    for (unsigned i = 0; i < 4; ++i) {
      wanted_[i] = !store_->table(i).columns().empty();
      if (wanted_[i]) inheritors_[i].emplace(store_->table(i), initial_.get());
    }
    scanning_ = wanted_[0] || wanted_[1] || wanted_[2] || wanted_[3];
  }

  void Visit(Cell cell, Outbox& out) {
    const auto& info = map_.template info_of_attribute<n>(cell);
    if (wanted_[n]) See(n, info.id, info.reference);
    bool parts = false;
    for (unsigned i = 0; i < n; ++i) parts = parts || wanted_[i];
    if (!parts) return;
    const size_t darts = names_->Look(cell);
    for (size_t k = 0; k < darts; ++k) {
      const Dart dart = names_->dart(k);
      const bool open = block_count_ > 1 && map_.template is_free<n>(dart);
      for (unsigned i = 0; i < n; ++i) {
        if (!wanted_[i]) continue;
        const CellId id = names_->Name(k, i);
        const uint32_t row = See(i, id, dart);
        if (open && !store_->table(i).Is(row, AttributeTable::kTold)) {
          store_->table(i).Mark(row, AttributeTable::kTold);
          Tell(id, i, out);
        }
      }
    }
  }

  uint32_t See(unsigned i, const CellId& id, Dart dart) {
    AttributeTable& table = store_->table(i);
    uint32_t row = table.Find(id);
    if (row == AttributeTable::kNoRow) {
      row = table.Add(id);
      inheritors_[i]->Fill(row);
      ++new_rows_;
    } else if (!table.Is(row, AttributeTable::kSeen)) {
      table.Unmark(row, AttributeTable::kElsewhere);
    }
    if (!table.Is(row, AttributeTable::kSeen)) {
      table.Mark(row, AttributeTable::kSeen);
      table.set_dart(row, IndexOf(map_, dart));
    }
    return row;
  }

  BlockId ArbiterOf(const CellId& id) const {
    const uint64_t mixed = (id.hi() * 0x9e3779b97f4a7c15u ^ id.lo()) * 0xc4ceb9fe1a85ec53u;
    return BlockId{static_cast<uint32_t>((mixed >> 32) % block_count_)};
  }

  void Tell(const CellId& id, unsigned dimension, Outbox& out) {
    const BlockId arbiter = ArbiterOf(id);
    if (arbiter == self_) {
      Arbitrate(self_, id, static_cast<uint8_t>(dimension), out);
    } else {
      Send(arbiter, kHave, id, static_cast<uint8_t>(dimension), out);
    }
  }
  static void Send(BlockId to, MessageKind kind, const CellId& id, uint8_t dimension, Outbox& out) {
    out.Send(to, {kind, {id.hi(), id.lo()}, BytesOf(dimension)});
  }

  void Arbitrate(BlockId from, const CellId& id, uint8_t dimension, Outbox& out) {
    const auto [it, made] = lowest_.try_emplace(id, from);
    if (made || it->second == from) return;
    const BlockId loser = std::max(it->second, from);
    it->second = std::min(it->second, from);
    if (loser == self_) {
      CountedElsewhere(id, dimension);
    } else {
      Send(loser, kCountedElsewhere, id, dimension, out);
    }
  }
  // The row is there: it was told of. A duplicate may come when it is gone.
  void CountedElsewhere(const CellId& id, unsigned dimension) {
    AttributeTable& table = store_->table(dimension);
    const uint32_t row = table.Find(id);
    if (row != AttributeTable::kNoRow) table.Mark(row, AttributeTable::kElsewhere);
  }

  // Rows of cells that were not seen go.
  void Sweep(size_t* left) {
    AttributeTable& table = store_->table(sweeping_);
    for (; *left > 0 && swept_ < table.size(); --*left) {
      const auto row = static_cast<uint32_t>(swept_);
      if (table.Is(row, AttributeTable::kSeen)) {
        table.Unmark(row, AttributeTable::kSeen | AttributeTable::kTold);
        ++swept_;
      } else {
        table.Remove(row);
      }
    }
    if (swept_ < table.size()) return;
    if (inheritors_[sweeping_].has_value()) inheritors_[sweeping_]->Clear();
    ++sweeping_;
    swept_ = 0;
  }

  const std::vector<AttributeDefinition> definitions_;
  const BlockId self_;
  const uint32_t block_count_;
  const std::shared_ptr<const InitialCells> initial_;
  const std::shared_ptr<AttributeStore> store_;
  BlockT& block_;
  Lcc& map_;
  PartialScan<typename Lcc::template Attribute_range<n>::type> cells_;
  // Null without initial cells; then nothing but n-cells is wanted.
  std::optional<CellNames<BlockT>> names_;
  bool begun_ = false;
  std::vector<NewColumn> new_columns_;
  std::array<bool, 4> wanted_{};
  std::array<std::optional<Inheritor>, 4> inheritors_;
  bool scanning_ = false;
  // The table and row that are swept; after the scan.
  unsigned sweeping_ = 4;
  size_t swept_ = 0;
  // Of cells that this block arbitrates: the lowest block that has them.
  absl::flat_hash_map<CellId, BlockId> lowest_;
  unsigned counting_ = 0;
  size_t counted_ = 0;
  int64_t here_ = 0;
  int64_t new_rows_ = 0;
  Report report_;
};

}  // namespace ndmap

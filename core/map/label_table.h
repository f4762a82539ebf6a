// SPDX-License-Identifier: GPL-3.0-or-later
// What a block knows of its critical darts, found by dart and by label: a row for each, and two tables of
// numbers of rows. Only critical darts pay, about 40 bytes each.
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>

#include "absl/container/flat_hash_set.h"
#include "absl/hash/hash.h"
#include "core/map/flat_pool.h"
#include "core/map/handle_hash.h"
#include "core/map/ids.h"

namespace ndmap {

// What a critical dart knows of its partner.
struct Critical {
  Label label;
  // The partner's block; none with broadcast routing.
  BlockId peer;
  // The sign of its (n-1)-cell: the same on all darts of the cell in this block, opposite on their partners.
  bool positive = false;

  friend bool operator==(const Critical&, const Critical&) = default;
};

template <class Dart>
class LabelTable {
 public:
  struct Row {
    Label label;
    Dart dart;
    uint32_t positive : 1;
    uint32_t peer : 31;  // All bits set: none.

    Row(Dart d, const Critical& c)
        : label(c.label), dart(d), positive(c.positive), peer(c.peer.value & kNoPeer) {}
    Critical critical() const { return {label, peer == kNoPeer ? BlockId() : BlockId{peer}, positive != 0}; }
  };
  using Rows = internal::FlatPool<Row>;
  // Of one critical dart: its row, and a number and a byte in two tables that are half full.
  static constexpr size_t kMostBytes = sizeof(Row) + 1 + 4 * (sizeof(uint32_t) + 1);

  LabelTable() = default;
  LabelTable(const LabelTable&) = delete;
  LabelTable& operator=(const LabelTable&) = delete;

  // Neither the dart nor the label is here yet. O(1) expected.
  void Insert(Dart d, const Critical& c) {
    const uint32_t row = rows_.emplace(Row(d, c)).index;
    by_dart_.insert(row);
    by_label_.insert(row);
  }
  // The row of a dart that is here. O(1) expected.
  const Row& Of(Dart d) const { return At(*by_dart_.find(d)); }
  // Null if there is none. O(1) expected.
  const Row* Find(const Label& label) const {
    const auto it = by_label_.find(label);
    return it == by_label_.end() ? nullptr : &At(*it);
  }
  // Gives a dart that is here another label, which is not. O(1) expected.
  void Relabel(Dart d, const Label& label) {
    const uint32_t row = *by_dart_.find(d);
    by_label_.erase(row);
    rows_[Handle(row)].label = label;
    by_label_.insert(row);
  }
  // Forgets a dart that is here. O(1) expected.
  void Erase(Dart d) {
    const auto it = by_dart_.find(d);
    const uint32_t row = *it;
    by_label_.erase(row);
    by_dart_.erase(it);
    rows_.erase(Handle(row));
  }
  void Clear() {
    by_dart_.clear();
    by_label_.clear();
    rows_.clear();
  }

  // All rows, in no order that means anything.
  const Rows& rows() const { return rows_; }
  // Bytes of the rows ever used since the last Clear() and of both tables. O(1).
  size_t allocated_bytes() const {
    return rows_.allocated_bytes() + (by_dart_.capacity() + by_label_.capacity()) * (sizeof(uint32_t) + 1);
  }

 private:
  using Handle = typename Rows::Handle;
  static constexpr uint32_t kNoPeer = ~uint32_t{0} >> 1;

  // A row's number stands for its key, and the key itself is looked up.
  struct DartHash {
    using is_transparent = void;
    const LabelTable* table;
    size_t operator()(Dart d) const { return HandleHash<Dart>()(d); }
    size_t operator()(uint32_t row) const { return (*this)(table->At(row).dart); }
  };
  struct DartEqual {
    using is_transparent = void;
    const LabelTable* table;
    bool operator()(uint32_t a, uint32_t b) const { return a == b; }
    bool operator()(uint32_t a, Dart d) const { return table->At(a).dart == d; }
    bool operator()(Dart d, uint32_t a) const { return table->At(a).dart == d; }
  };
  struct LabelHash {
    using is_transparent = void;
    const LabelTable* table;
    size_t operator()(const Label& label) const { return absl::Hash<Label>()(label); }
    size_t operator()(uint32_t row) const { return (*this)(table->At(row).label); }
  };
  struct LabelEqual {
    using is_transparent = void;
    const LabelTable* table;
    bool operator()(uint32_t a, uint32_t b) const { return a == b; }
    bool operator()(uint32_t a, const Label& label) const { return table->At(a).label == label; }
    bool operator()(const Label& label, uint32_t a) const { return table->At(a).label == label; }
  };

  const Row& At(uint32_t row) const { return rows_[Handle(row)]; }

  Rows rows_;
  absl::flat_hash_set<uint32_t, DartHash, DartEqual> by_dart_{0, DartHash{this}, DartEqual{this}};
  absl::flat_hash_set<uint32_t, LabelHash, LabelEqual> by_label_{0, LabelHash{this}, LabelEqual{this}};
};

}  // namespace ndmap

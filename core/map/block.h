// SPDX-License-Identifier: GPL-3.0-or-later
// One block of an n-dimensional distributed combinatorial map (n-dmap; Damiand et al., Algorithms 11(7):105,
// 2018, Definition 1), for any n. The whole model in one screen:
//
//  * A map is cut into k blocks. Each block is an n-map of its own (a CGAL map: darts and beta links).
//  * Where the cut went through an (n-1)-cell, its darts on both sides are *critical*: n-free in their
//  blocks, and
//    carrying a label that exactly one dart of another block, the *partner*, carries too.
//  * Proposition 1: the global map is the union of the blocks' darts. beta_1 ... beta_{n-1} are the blocks'
//  own; beta_n is
//    the block's own for a non-critical dart, and for a critical dart it is the partner. Nobody ever rebuilds
//    it.
//  * With direct routing a critical dart knows the block that has its partner; with broadcast routing it does
//  not.
//  * The two sides of a critical (n-1)-cell have opposite signs, which is how both derive the same labels
//    when they split it (core/algorithm/refine/label.h).
//
// A block is used by one thread at a time.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/map/dart_index.h"
#include "core/map/ids.h"
#include "core/map/label_table.h"
#include "core/map/map_types.h"

namespace ndmap {

template <class Types_>
class Block {
 public:
  using Types = Types_;
  using Lcc = typename Types::Lcc;
  using Dart = typename Types::Dart;
  static constexpr unsigned n = Types::n;

  explicit Block(BlockId id) : id_(id) {}
  Block(const Block&) = delete;
  Block& operator=(const Block&) = delete;

  BlockId id() const { return id_; }
  Lcc& map() { return map_; }
  const Lcc& map() const { return map_; }

  // Constant time: one mark.
  bool IsCritical(Dart d) const { return map_.is_marked(d, mark_); }
  // Of a critical dart. O(1) expected.
  Critical critical(Dart d) const { return labels_.Of(d).critical(); }
  // The dart with this label; null if there is none. O(1) expected.
  Dart Find(const Label& label) const {
    const auto* row = labels_.Find(label);
    return row == nullptr ? Dart(Lcc::null_handle) : row->dart;
  }
  // Makes d critical. d is n-free and not critical, the label is not in use here.
  void SetCritical(Dart d, const Critical& c) {
    map_.mark(d, mark_);
    labels_.Insert(d, c);
  }
  // Gives a critical dart another label, which is not in use here.
  void Relabel(Dart d, const Label& label) { labels_.Relabel(d, label); }
  // Makes a critical dart an ordinary n-free one: a boundary of the map.
  void ClearCritical(Dart d) {
    labels_.Erase(d);
    map_.unmark(d, mark_);
  }
  // Erases everything.
  void Clear() {
    labels_.Clear();
    map_.clear();
    Touch();
  }
  size_t critical_count() const { return labels_.rows().size(); }
  // The critical darts, each with its `label` and `dart`, in no order that means anything.
  using Labels = typename LabelTable<Dart>::Rows;
  const Labels& labels() const { return labels_.rows(); }

  // Raised by every change and never used twice: a dart reference made at another version is stale.
  uint64_t version() const { return version_; }
  void Touch() { ++version_; }
  // After a rollback: continues above every version that was ever handed out.
  void set_version(uint64_t version) { version_ = version; }

  // Bytes that the block's content takes, tables included: what a memory limit is compared with. O(1).
  size_t AccountedBytes() const { return AllocatedBytes(map_) + labels_.allocated_bytes(); }
  // The same by part: MemoryOf (core/map/memory.h).
  const LabelTable<Dart>& label_table() const { return labels_; }

 private:
  BlockId id_;
  Lcc map_;
  typename Lcc::size_type mark_ = map_.get_new_mark();
  LabelTable<Dart> labels_;
  uint64_t version_ = 1;
};

// What services host: surfaces and volumes.
using Block2 = Block<MapTypes<2, StorageKind::kFlat>>;
using Block2OnCgalStorage = Block<MapTypes<2, StorageKind::kCgal>>;
using Block3 = Block<MapTypes<3, StorageKind::kFlat>>;
using Block3OnCgalStorage = Block<MapTypes<3, StorageKind::kCgal>>;

}  // namespace ndmap

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
#include <utility>

#include "absl/container/flat_hash_map.h"
#include "absl/container/flat_hash_set.h"
#include "core/map/dart_index.h"
#include "core/map/ids.h"
#include "core/map/map_types.h"

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
  const Critical& critical(Dart d) const { return critical_.find(IndexOf(map_, d))->second; }
  // The dart with this label; null if there is none. O(1) expected.
  Dart Find(const Label& label) const {
    auto it = darts_.find(label);
    return it == darts_.end() ? Dart(Lcc::null_handle) : it->second;
  }
  // Makes d critical. d is n-free and not critical, the label is not in use here.
  void SetCritical(Dart d, const Critical& c) {
    map_.mark(d, mark_);
    critical_.emplace(IndexOf(map_, d), c);
    darts_.emplace(c.label, d);
  }
  // Gives a critical dart another label, which is not in use here.
  void Relabel(Dart d, const Label& label) {
    Critical& c = critical_.find(IndexOf(map_, d))->second;
    darts_.erase(c.label);
    c.label = label;
    darts_.emplace(label, d);
  }
  // Makes a critical dart an ordinary n-free one: a boundary of the map.
  void ClearCritical(Dart d) {
    auto it = critical_.find(IndexOf(map_, d));
    darts_.erase(it->second.label);
    critical_.erase(it);
    map_.unmark(d, mark_);
  }
  // Erases everything.
  void Clear() {
    critical_.clear();
    darts_.clear();
    map_.clear();
    Touch();
  }
  size_t critical_count() const { return critical_.size(); }
  const absl::flat_hash_map<Label, Dart>& labels() const { return darts_; }

  // Raised by every change and never used twice: a dart reference made at another version is stale.
  uint64_t version() const { return version_; }
  void Touch() { ++version_; }
  // After a rollback: continues above every version that was ever handed out.
  void set_version(uint64_t version) { version_ = version; }

  // Bytes that the block's content takes, tables included: what a memory limit is compared with. O(1).
  size_t AccountedBytes() const {
    constexpr size_t kCriticalBytes =
        sizeof(std::pair<DartIndex, Critical>) + sizeof(std::pair<Label, Dart>) + 2;
    // Hash tables are between 7/16 and 7/8 full.
    return AllocatedBytes(map_) + critical_.size() * kCriticalBytes * 3 / 2;
  }

 private:
  BlockId id_;
  Lcc map_;
  typename Lcc::size_type mark_ = map_.get_new_mark();
  absl::flat_hash_map<DartIndex, Critical> critical_;
  absl::flat_hash_map<Label, Dart> darts_;
  uint64_t version_ = 1;
};

// What services host: surfaces and volumes.
using Block2 = Block<MapTypes<2, StorageKind::kFlat>>;
using Block2OnCgalStorage = Block<MapTypes<2, StorageKind::kCgal>>;
using Block3 = Block<MapTypes<3, StorageKind::kFlat>>;
using Block3OnCgalStorage = Block<MapTypes<3, StorageKind::kCgal>>;

}  // namespace ndmap

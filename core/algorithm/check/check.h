// SPDX-License-Identifier: GPL-3.0-or-later
// The checker of Definition 1 (n-dmap), all properties, for any n, block against block: nobody gathers the
// map.
//
// In the block: its map is valid (core/map/validity.h); every critical dart is n-free (2) and its (n-1)-cell
// is critical altogether with one sign and one peer (1); dart and label tables agree. Between blocks, a
// message for each critical dart to its peer with its sign, its two points and the labels of beta_i(d), 0 <=
// i <= n-2: the peer has exactly one dart with that label and gets exactly one such message (3), of the
// opposite sign, its dart runs between the same points the other way, and for n >= 3 the labels are those of
// beta_i^-1 of its dart (4).
//
// Counts: darts, critical_darts, findings; of a cancelled check: cancelled, and findings if there are any.
#pragma once

#include <array>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "core/algorithm/block_algorithm.h"
#include "core/algorithm/packing.h"
#include "core/map/block.h"
#include "core/map/partial_scan.h"
#include "core/map/validity.h"

namespace ndmap {

template <class BlockT>
class Check final : public BlockAlgorithm {
 public:
  using Types = typename BlockT::Types;
  using Lcc = typename BlockT::Lcc;
  using Dart = typename BlockT::Dart;
  static constexpr unsigned n = BlockT::n;
  enum MessageKind : uint8_t { kAnnounce = 1 };

  // What a critical dart tells its partner. Labels of {0, 0} stand for a beta_i that is not critical; for n =
  // 2 there is nothing to tell of them: beta_0 lies on another edge.
  struct Announcement {
    uint64_t positive = 0;
    typename Types::Coordinates start{};
    typename Types::Coordinates end{};
    std::array<Label, n - 1> labels{};
  };

  static absl::StatusOr<std::unique_ptr<BlockAlgorithm>> Make(const Parameters&,
                                                              const Environment& environment, BlockT& block) {
    return std::make_unique<Check>(environment.routing, block);
  }

  Check(Routing routing, BlockT& block)
      : routing_(routing),
        block_(block),
        map_(block.map()),
        validity_(map_),
        table_(block.labels()),
        unheard_(block.labels()) {}

  bool changes_map() const override { return false; }

  absl::StatusOr<bool> Start(size_t) override {
    heard_.reserve(block_.critical_count());
    return true;
  }

  absl::Status Receive(BlockId from, const Message& message, Outbox&) override {
    Announcement theirs;
    if (message.kind != kAnnounce || !FromBytes(message.payload, &theirs)) {
      return absl::InvalidArgumentError(absl::StrCat("check: message kind ", message.kind, " of ",
                                                     message.payload.size(), " bytes from block ",
                                                     from.value));
    }
    const Dart d = block_.Find(message.label);
    if (d == Lcc::null_handle) {
      if (routing_ == Routing::kDirect)
        Find(message.label, absl::StrCat("is not here, but in block ", from.value));
      return absl::OkStatus();
    }
    auto [it, first] = heard_.emplace(IndexOf(map_, d), from);
    if (!first) {
      // A duplicate says nothing new; two senders are two partners.
      if (it->second != from) {
        Find(message.label,
             absl::StrCat("is in block ", it->second.value, " and in block ", from.value, " too"));
      }
      return absl::OkStatus();
    }
    Compare(d, from, message.label, theirs);
    return absl::OkStatus();
  }

  absl::StatusOr<size_t> Work(size_t budget, Outbox& out) override {
    size_t left = budget;
    for (; left > 0 && next_ < DartIndexBound(map_); --left) {
      const Dart d = DartAt(map_, DartIndex{next_++});
      if (d == Lcc::null_handle) continue;
      ++darts_;
      FindFault(d, validity_.At(d));
      if (block_.IsCritical(d)) CheckCritical(d, out);
    }
    if (left > 0 && !table_done_) {
      table_done_ = table_.Next(&left, [this](auto it) { CheckEntry(it->label, it->dart); });
      if (table_done_) FindFault(Lcc::null_handle, validity_.AtEnd());
    }
    return budget - left;
  }

  bool HasWork() const override { return !cancelled_ && !table_done_; }
  void Cancel() override { cancelled_ = true; }

  absl::StatusOr<bool> Finish(size_t budget) override {
    if (cancelled_ || heard_.size() == block_.labels().size()) return true;
    return unheard_.Next(&budget, [this](auto it) {
      if (!heard_.contains(IndexOf(map_, it->dart))) Find(it->label, "has no partner in another block");
    });
  }

  Report report() const override {
    Report report = report_;
    if (cancelled_) {
      report.counts["cancelled"] = 1;
      return report;
    }
    report.counts["darts"] = darts_;
    report.counts["critical_darts"] = static_cast<int64_t>(block_.critical_count());
    report.counts.try_emplace("findings", 0);
    return report;
  }

 private:
  void Find(const Label& label, absl::string_view what) {
    report_.Find(absl::StrCat("block ", block_.id().value, ": label ", ToString(label), " ", what));
  }

  // A fault of the block's own map, at a dart or in all.
  void FindFault(Dart d, const std::string& fault) {
    if (fault.empty()) return;
    report_.Find(absl::StrCat(
        "block ", block_.id().value, ": its map is not valid: ",
        d == Lcc::null_handle ? "" : absl::StrCat("dart ", IndexOf(map_, d).value, ": "), fault));
  }

  void CheckEntry(const Label& label, Dart d) {
    if (!map_.is_dart_used(d) || !block_.IsCritical(d) || block_.critical(d).label != label) {
      Find(label, "stands in the table for a dart that does not carry it");
    }
  }

  void CheckCritical(Dart d, Outbox& out) {
    const Critical& c = block_.critical(d);
    if (!map_.template is_free<n>(d)) Find(c.label, "is on a dart that is not n-free");
    if (block_.Find(c.label) != d) Find(c.label, "is on a dart that the table does not name");
    // Complete (n-1)-cells: closed under beta_1 ... beta_{n-2}.
    for (unsigned i = 1; i + 2 <= n; ++i) {
      if (map_.is_free(d, i)) continue;
      const Dart e = map_.beta(d, static_cast<int>(i));
      if (!block_.IsCritical(e)) {
        Find(c.label, "is in an (n-1)-cell that is not critical altogether");
      } else if (block_.critical(e).positive != c.positive || block_.critical(e).peer != c.peer) {
        Find(c.label, "is in an (n-1)-cell of two signs or two peers");
      }
    }
    Announcement mine;
    mine.positive = c.positive ? 1 : 0;
    mine.start = Coordinates(d);
    if (!map_.template is_free<1>(d)) mine.end = Coordinates(map_.template beta<1>(d));
    if constexpr (n >= 3) {
      for (unsigned i = 0; i + 2 <= n; ++i) mine.labels[i] = LabelOfBeta(d, i);
    }
    const Message message{kAnnounce, c.label, BytesOf(mine)};
    if (routing_ == Routing::kBroadcast) {
      out.Broadcast(message);
    } else {
      out.Send(c.peer, message);
    }
  }

  void Compare(Dart d, BlockId from, const Label& label, const Announcement& theirs) {
    const Critical& c = block_.critical(d);
    if (routing_ == Routing::kDirect && c.peer != from) {
      Find(label, absl::StrCat("is in block ", from.value, ", expected in block ", c.peer.value));
    }
    if ((theirs.positive != 0) == c.positive) Find(label, "has the same sign on both sides");
    if (theirs.end != Coordinates(d) ||
        (!map_.template is_free<1>(d) && theirs.start != Coordinates(map_.template beta<1>(d)))) {
      Find(label, absl::StrCat("runs between other points in block ", from.value));
    }
    if constexpr (n >= 3) {
      for (unsigned i = 0; i + 2 <= n; ++i) {
        const unsigned inverse = i == 0 ? 1 : i == 1 ? 0 : i;
        if (theirs.labels[i] != LabelOfBeta(d, inverse)) {
          Find(label, absl::StrCat("contradicts block ", from.value, " at beta ", i));
        }
      }
    }
  }

  Label LabelOfBeta(Dart d, unsigned i) const {
    if (map_.is_free(d, i)) return Label();
    const Dart e = map_.beta(d, static_cast<int>(i));
    return block_.IsCritical(e) ? block_.critical(e).label : Label();
  }

  typename Types::Coordinates Coordinates(Dart d) const {
    typename Types::Coordinates x{};
    if (map_.template attribute<0>(d) == Lcc::null_handle) return x;
    const auto& p = map_.point(d);
    for (unsigned c = 0; c < Types::kAmbient; ++c) x[c] = p[static_cast<int>(c)];
    return x;
  }

  const Routing routing_;
  BlockT& block_;
  Lcc& map_;
  ValidityCheck<Lcc> validity_;
  using Table = const typename BlockT::Labels;
  PartialScan<Table> table_;
  PartialScan<Table> unheard_;
  bool table_done_ = false;
  bool cancelled_ = false;
  uint32_t next_ = 0;
  int64_t darts_ = 0;
  absl::flat_hash_map<DartIndex, BlockId> heard_;
  Report report_;
};

}  // namespace ndmap

// SPDX-License-Identifier: GPL-3.0-or-later
// The canonical hash of the global map, version 1: for every dart, XXH3-128 of the little-endian tuple
// (volume id, exact bits of its start and end point, and for beta_1, beta_2, beta_3 the target's volume id,
// start and end point, or zeros when free), summed modulo 2^128 over all darts. Where beta_3 of a critical
// dart leads to is asked of the peer, never predicted. So blocks add up their sums, and neither their number
// nor the order of messages nor the numbering of darts matters.
//
// In a map of dimension 2 the tuple has the face's id in place of the volume's, and ends after beta_2, which
// is what is asked of the peer.
//
// Counts: darts. Digest: the sum. A cancelled hash has neither: its count is cancelled.
#pragma once

#include <xxhash.h>

#include <array>
#include <memory>

#include "absl/container/flat_hash_set.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "core/algorithm/block_algorithm.h"
#include "core/algorithm/packing.h"
#include "core/map/block.h"

namespace ndmap {

template <class BlockT>
class Hash final : public BlockAlgorithm {
 public:
  using Lcc = typename BlockT::Lcc;
  using Dart = typename BlockT::Dart;
  static constexpr unsigned n = BlockT::n;
  static_assert(n == 2 || n == 3, "version 1 is defined for 2-maps and 3-maps");

  // A dart as its neighbours see it: 64 bytes.
  struct Seen {
    uint64_t id_lo = 0;
    uint64_t id_hi = 0;
    std::array<double, 3> start{};
    std::array<double, 3> end{};
  };
  enum MessageKind : uint8_t { kSeen = 1 };

  static absl::StatusOr<std::unique_ptr<BlockAlgorithm>> Make(const Parameters&,
                                                              const Environment& environment, BlockT& block) {
    return std::make_unique<Hash>(environment.routing, block);
  }

  Hash(Routing routing, BlockT& block) : routing_(routing), block_(block), map_(block.map()) {}

  bool changes_map() const override { return false; }

  absl::StatusOr<bool> Start(size_t) override {
    // A table that grows is copied in one go.
    answered_.reserve(block_.critical_count());
    return true;
  }

  absl::Status Receive(BlockId from, const Message& message, Outbox&) override {
    Seen beyond;
    if (message.kind != kSeen || !FromBytes(message.payload, &beyond)) {
      return absl::InvalidArgumentError(absl::StrCat("hash: message kind ", message.kind, " of ",
                                                     message.payload.size(), " bytes from block ",
                                                     from.value));
    }
    const Dart d = block_.Find(message.label);
    if (d == Lcc::null_handle) {
      // Broadcast to everybody.
      if (routing_ == Routing::kBroadcast) return absl::OkStatus();
      return absl::InternalError(absl::StrCat("block ", block_.id().value, ": no dart with label ",
                                              ToString(message.label), ", which block ", from.value, " has"));
    }
    if (answered_.insert(IndexOf(map_, d)).second) AddDart(d, beyond);
    return absl::OkStatus();
  }

  absl::StatusOr<size_t> Work(size_t budget, Outbox& out) override {
    size_t steps = 0;
    for (; steps < budget && HasWork(); ++steps) {
      const Dart d = DartAt(map_, DartIndex{next_++});
      if (d == Lcc::null_handle) continue;
      ++darts_;
      if (!block_.IsCritical(d)) {
        AddDart(d, map_.template is_free<n>(d) ? Seen() : See(map_.template beta<n>(d)));
        continue;
      }
      const Seen seen = See(d);
      const Critical& c = block_.critical(d);
      const Message message{kSeen, c.label, BytesOf(seen)};
      if (routing_ == Routing::kBroadcast) {
        out.Broadcast(message);
      } else {
        out.Send(c.peer, message);
      }
    }
    return steps;
  }

  bool HasWork() const override { return !cancelled_ && next_ < DartIndexBound(map_); }
  void Cancel() override { cancelled_ = true; }

  absl::StatusOr<bool> Finish(size_t) override {
    // Peers were cancelled as well and may not have answered.
    if (cancelled_ || answered_.size() == block_.critical_count()) return true;
    return absl::InternalError(absl::StrCat("block ", block_.id().value, ": ", answered_.size(), " of ",
                                            block_.critical_count(), " critical darts were answered for"));
  }

  Report report() const override {
    Report report;
    // A sum over some of the darts is the hash of no map.
    if (cancelled_) {
      report.counts["cancelled"] = 1;
      return report;
    }
    report.counts["darts"] = darts_;
    report.digest = sum_;
    return report;
  }

 private:
  std::array<double, 3> Point(Dart d) const {
    const auto& p = map_.point(d);
    return {p.x(), p.y(), p.z()};
  }

  Seen See(Dart d) const {
    const CellId id = map_.template info_of_attribute<n>(map_.template attribute<n>(d)).id;
    return {id.lo(), id.hi(), Point(d), Point(map_.template beta<1>(d))};
  }

  void AddDart(Dart d, const Seen& beyond) {
    std::array<Seen, n + 1> tuple = {See(d), See(map_.template beta<1>(d))};
    if constexpr (n == 3) tuple[2] = See(map_.template beta<2>(d));
    tuple[n] = beyond;
    const XXH128_hash_t hash = XXH3_128bits(&tuple, sizeof(tuple));
    sum_.Add({hash.high64, hash.low64});
  }

  const Routing routing_;
  BlockT& block_;
  Lcc& map_;
  uint32_t next_ = 0;
  int64_t darts_ = 0;
  bool cancelled_ = false;
  absl::flat_hash_set<DartIndex> answered_;
  Digest sum_;
};

}  // namespace ndmap

// SPDX-License-Identifier: GPL-3.0-or-later
// The part of a cell that lies in one block. An i-cell is an orbit (Damiand and Lienhardt, Combinatorial
// Maps, 2014, Definition 3): for i > 0 of all betas but beta_i; for i = 0 the darts that start at the vertex.
// A block follows it to its critical darts and says through which labels it goes on in other blocks.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "absl/container/flat_hash_set.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/types/span.h"
#include "core/map/block.h"

namespace ndmap {

// A dart to begin at.
struct OrbitSeed {
  enum class Kind : uint8_t {
    kDart,        // the dart with this index
    kLabel,       // the critical dart with this label
    kAfterLabel,  // beta_1 of the critical dart with this label
  };
  Kind kind = Kind::kDart;
  DartIndex dart;
  Label label;
};

// The orbit goes on in another block, at the seed {kind, label} there.
struct OrbitCrossing {
  Label label;
  OrbitSeed::Kind kind = OrbitSeed::Kind::kLabel;
  // Not valid with broadcast routing: any other block may hold the label.
  BlockId peer;
};

struct OrbitPiece {
  // The block's, while the piece was made.
  uint64_t version = 0;
  // Each once, in no order.
  std::vector<DartIndex> darts;
  std::vector<OrbitCrossing> crossings;
  // Which seeds named labels that are not in this block, by their place in the question.
  std::vector<uint32_t> not_here;
};

// The union of the orbits of some seeds, a few darts at a time.
template <class BlockT>
class OrbitExpander {
 public:
  using Lcc = typename BlockT::Lcc;
  using Dart = typename BlockT::Dart;
  static constexpr unsigned n = BlockT::n;

  // i <= n. Stops with RESOURCE_EXHAUSTED above `most` darts. The seeds must stay where they are.
  OrbitExpander(unsigned i, absl::Span<const OrbitSeed> seeds, size_t most)
      : i_(i), seeds_(seeds), most_(most) {}

  // Up to `budget` darts; true when all are found. NOT_FOUND: no dart with this index. ABORTED: the block
  // changed since the first step. O(budget).
  absl::StatusOr<bool> Step(BlockT& block, size_t budget) {
    if (i_ > n) {
      return absl::InvalidArgumentError(
          absl::StrCat("a cell of dimension ", i_, " in a map of dimension ", int{n}));
    }
    if (piece_.version == 0) piece_.version = block.version();
    if (piece_.version != block.version()) {
      return absl::AbortedError(absl::StrCat("block ", block.id().value, " changed during the query"));
    }
    for (size_t k = 0; k < budget; ++k) {
      if (!stack_.empty()) {
        const Dart d = stack_.back();
        stack_.pop_back();
        Visit(block, d);
      } else if (next_seed_ < seeds_.size()) {
        if (absl::Status s = Begin(block, next_seed_++); !s.ok()) return s;
      } else {
        return true;
      }
      if (piece_.darts.size() > most_) {
        return absl::ResourceExhaustedError(
            absl::StrCat("more than ", most_, " darts in block ", block.id().value));
      }
    }
    return stack_.empty() && next_seed_ == seeds_.size();
  }

  // After Step() was true.
  OrbitPiece Take() { return std::move(piece_); }

 private:
  absl::Status Begin(BlockT& block, size_t k) {
    auto& map = block.map();
    const OrbitSeed& seed = seeds_[k];
    if (seed.kind == OrbitSeed::Kind::kDart) {
      const Dart d = DartAt(map, seed.dart);
      if (d == Lcc::null_handle) {
        return absl::NotFoundError(
            absl::StrCat("block ", block.id().value, " has no dart ", seed.dart.value));
      }
      Push(map, d);
      return absl::OkStatus();
    }
    const Dart d = block.Find(seed.label);
    if (d == Lcc::null_handle) {
      piece_.not_here.push_back(static_cast<uint32_t>(k));
    } else {
      Push(map, seed.kind == OrbitSeed::Kind::kLabel ? d : map.template beta<1>(d));
    }
    return absl::OkStatus();
  }

  void Push(Lcc& map, Dart d) {
    if (d == map.null_dart_handle) return;
    const DartIndex index = IndexOf(map, d);
    if (!seen_.insert(index).second) return;
    piece_.darts.push_back(index);
    stack_.push_back(d);
  }

  void Visit(BlockT& block, Dart d) {
    auto& map = block.map();
    if (i_ == 0) {
      VisitVertex(block, d);
      return;
    }
    for (unsigned j = 0; j < n; ++j) {
      if (j == i_ || (j == 0 && i_ == 1)) continue;
      Push(map, map.beta(d, static_cast<int>(j)));
    }
    if (i_ == n) return;
    if (block.IsCritical(d)) {
      Cross(block, d, OrbitSeed::Kind::kLabel);
    } else {
      Push(map, map.template beta<n>(d));
    }
  }

  // beta_j turns darts over: beta_j of the dart that ends here starts here, and so does the dart after beta_j
  // of one that starts here.
  void VisitVertex(BlockT& block, Dart d) {
    auto& map = block.map();
    const Dart before = map.template beta<0>(d);
    for (unsigned j = 2; j <= n; ++j) {
      if (j == n && before != map.null_dart_handle && block.IsCritical(before)) {
        Cross(block, before, OrbitSeed::Kind::kLabel);
      } else {
        Push(map, map.beta(before, static_cast<int>(j)));
      }
      if (j == n && block.IsCritical(d)) {
        Cross(block, d, OrbitSeed::Kind::kAfterLabel);
      } else if (!map.is_free(d, j)) {
        Push(map, map.template beta<1>(map.beta(d, static_cast<int>(j))));
      }
    }
  }

  void Cross(BlockT& block, Dart d, OrbitSeed::Kind kind) {
    const Critical& c = block.critical(d);
    piece_.crossings.push_back({c.label, kind, c.peer});
  }

  const unsigned i_;
  const absl::Span<const OrbitSeed> seeds_;
  const size_t most_;
  size_t next_seed_ = 0;
  absl::flat_hash_set<DartIndex> seen_;
  std::vector<Dart> stack_;
  OrbitPiece piece_;
};

}  // namespace ndmap

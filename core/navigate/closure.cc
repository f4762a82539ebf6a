// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/navigate/closure.h"

#include <algorithm>
#include <tuple>
#include <utility>

#include "absl/container/btree_map.h"
#include "absl/container/flat_hash_map.h"
#include "absl/container/flat_hash_set.h"
#include "absl/strings/str_cat.h"

namespace ndmap {
namespace {

class Closing {
 public:
  Closing(BlockAccess& access, unsigned i, size_t most) : access_(access), i_(i), most_(most) {}

  absl::StatusOr<DartSet> Run(const DartSet& start) {
    for (const auto& [b, part] : start.blocks) {
      if (part.darts.empty()) continue;
      versions_[b] = part.version;
      for (DartIndex d : part.darts) next_[b].push_back({OrbitSeed::Kind::kDart, d, {}});
      askers_[b].resize(part.darts.size(), b);
    }
    while (!next_.empty()) {
      if (absl::Status s = Round(); !s.ok()) return s;
    }
    DartSet result;
    for (auto& [b, darts] : found_) {
      DartSet::OfBlock& part = result.blocks[b];
      part.version = versions_[b];
      part.darts.assign(darts.begin(), darts.end());
      std::sort(part.darts.begin(), part.darts.end());
    }
    return result;
  }

 private:
  // Label, kind and the block that says so.
  using Crossing = std::tuple<Label, OrbitSeed::Kind, uint32_t>;

  // Where one side comes to the partner itself, the other comes to the dart after its own.
  OrbitSeed::Kind FromTheOtherSide(OrbitSeed::Kind kind) const {
    if (i_ > 0) return kind;
    return kind == OrbitSeed::Kind::kLabel ? OrbitSeed::Kind::kAfterLabel : OrbitSeed::Kind::kLabel;
  }

  void Ask(BlockId block, const OrbitCrossing& crossing, BlockId asker) {
    next_[block].push_back({crossing.kind, {}, crossing.label});
    askers_[block].push_back(asker);
  }

  absl::Status Round() {
    std::vector<BlockAccess::Question> questions;
    for (auto& [b, seeds] : next_) questions.push_back({b, versions_[b], i_, std::move(seeds)});
    const auto askers = std::exchange(askers_, {});
    next_.clear();
    absl::StatusOr<std::vector<OrbitPiece>> pieces = access_.Expand(questions);
    if (!pieces.ok()) return pieces.status();
    // With broadcast routing every other block was asked; one of them must know the label.
    absl::flat_hash_map<Crossing, uint32_t> answers;
    for (size_t q = 0; q < questions.size(); ++q) {
      const OrbitPiece& piece = (*pieces)[q];
      if (absl::Status s = Take(questions[q].block, piece); !s.ok()) return s;
      std::vector<bool> missing(questions[q].seeds.size());
      for (uint32_t k : piece.not_here) missing[k] = true;
      for (size_t k = 0; k < questions[q].seeds.size(); ++k) {
        const OrbitSeed& seed = questions[q].seeds[k];
        if (seed.kind == OrbitSeed::Kind::kDart) continue;
        const BlockId asker = askers.at(questions[q].block)[k];
        answers[{seed.label, seed.kind, asker.value}] += missing[k] ? 0 : 1;
      }
    }
    for (const auto& [crossing, count] : answers) {
      if (count == 1) continue;
      return absl::UnavailableError(absl::StrCat("label ", ToString(std::get<Label>(crossing)), " has ",
                                                 count, " partners at the moment: the map is being changed"));
    }
    return absl::OkStatus();
  }

  absl::Status Take(BlockId b, const OrbitPiece& piece) {
    uint64_t& version = versions_[b];
    if (version == 0) version = piece.version;
    if (version != piece.version) {
      return absl::AbortedError(absl::StrCat("block ", b.value, " changed during the query"));
    }
    absl::flat_hash_set<DartIndex>& found = found_[b];
    for (DartIndex d : piece.darts) count_ += found.insert(d).second ? 1 : 0;
    if (count_ > most_) {
      return absl::ResourceExhaustedError(absl::StrCat("the cells have more than ", most_, " darts"));
    }
    for (const OrbitCrossing& crossing : piece.crossings) {
      if (!crossed_.insert({crossing.label, crossing.kind, b.value}).second) continue;
      if (crossing.peer.valid()) {
        if (crossing.peer.value >= access_.block_count()) {
          return absl::InternalError(absl::StrCat("block ", b.value, " names block ", crossing.peer.value,
                                                  " of ", access_.block_count(), " as a peer"));
        }
        // The peer will name it from its side: the way back.
        crossed_.insert({crossing.label, FromTheOtherSide(crossing.kind), crossing.peer.value});
        Ask(crossing.peer, crossing, b);
        continue;
      }
      for (uint32_t other = 0; other < access_.block_count(); ++other) {
        if (other != b.value) Ask(BlockId{other}, crossing, b);
      }
    }
    return absl::OkStatus();
  }

  BlockAccess& access_;
  const unsigned i_;
  const size_t most_;
  size_t count_ = 0;
  absl::btree_map<BlockId, uint64_t> versions_;
  absl::btree_map<BlockId, std::vector<OrbitSeed>> next_;
  // Of each of these seeds, who asks.
  absl::btree_map<BlockId, std::vector<BlockId>> askers_;
  absl::btree_map<BlockId, absl::flat_hash_set<DartIndex>> found_;
  absl::flat_hash_set<Crossing> crossed_;
};

}  // namespace

absl::StatusOr<DartSet> Close(BlockAccess& access, unsigned i, const DartSet& start, size_t most) {
  return Closing(access, i, most).Run(start);
}

}  // namespace ndmap

// SPDX-License-Identifier: GPL-3.0-or-later
// Counts the cells of the global map: hexahedra by level and state, darts, critical darts, and vertices,
// which blocks share: each block numbers its own, neighbours tell each other the lowest number of every
// vertex on a critical face until nothing changes, and a vertex is counted where its own number is the
// lowest. Exact for any cut.
//
// Counts: hexahedra, level_L, cut, inside, outside, unclassified, darts, critical_darts, vertices,
// accounted_bytes.
#pragma once

#include <memory>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "core/algorithm/block_algorithm.h"
#include "core/algorithm/packing.h"
#include "core/map/block.h"
#include "core/map/handle_hash.h"

namespace ndmap {

template <class BlockT>
class Count final : public BlockAlgorithm {
 public:
  using Lcc = typename BlockT::Lcc;
  using Dart = typename BlockT::Dart;
  using Vertex = typename BlockT::Types::Vertex;
  // (block, number in the block).
  using Number = uint64_t;
  enum MessageKind : uint8_t { kLowest = 1 };

  static absl::StatusOr<std::unique_ptr<BlockAlgorithm>> Make(const Parameters&,
                                                              const Environment& environment, BlockT& block) {
    return std::make_unique<Count>(environment.routing, block);
  }

  Count(Routing routing, BlockT& block) : routing_(routing), block_(block), map_(block.map()) {}

  absl::Status Start() override {
    uint32_t next = 0;
    for (const auto& [label, d] : block_.labels()) {
      auto [it, made] = shared_.try_emplace(map_.template attribute<0>(d));
      if (made) it->second.lowest = it->second.own = Number{block_.id().value} << 32 | next++;
      it->second.darts.push_back(d);
      if (made) changed_.push_back(it->first);
    }
    CountCells();
    return absl::OkStatus();
  }

  absl::Status Receive(BlockId from, const Message& message, Outbox&) override {
    Number lowest = 0;
    if (message.kind != kLowest || !FromBytes(message.payload, &lowest)) {
      return absl::InvalidArgumentError(
          absl::StrCat("count: message kind ", message.kind, " from block ", from.value));
    }
    const Dart d = block_.Find(message.label);
    if (d == Lcc::null_handle) {
      if (routing_ == Routing::kBroadcast) return absl::OkStatus();
      return absl::InternalError(absl::StrCat("block ", block_.id().value, ": no dart with label ",
                                              ToString(message.label), ", which block ", from.value, " has"));
    }
    // The partner starts where this dart ends.
    const Vertex v = map_.template attribute<0>(map_.template beta<1>(d));
    const auto it = shared_.find(v);
    if (it == shared_.end()) {
      return absl::InternalError(absl::StrCat("block ", block_.id().value, ": the face of label ",
                                              ToString(message.label), " is not critical altogether"));
    }
    Shared& shared = it->second;
    if (lowest < shared.lowest) {
      if (shared.told) changed_.push_back(v);
      shared.lowest = lowest;
      shared.told = false;
    }
    return absl::OkStatus();
  }

  absl::StatusOr<size_t> Work(size_t budget, Outbox& out) override {
    size_t steps = 0;
    for (; steps < budget && !changed_.empty(); ++steps) {
      Shared& shared = shared_.find(changed_.back())->second;
      changed_.pop_back();
      shared.told = true;
      for (Dart d : shared.darts) {
        const Critical& c = block_.critical(d);
        const Message message{kLowest, c.label, BytesOf(shared.lowest)};
        if (routing_ == Routing::kBroadcast) {
          out.Broadcast(message);
        } else {
          out.Send(c.peer, message);
        }
      }
    }
    return steps;
  }

  bool HasWork() const override { return !changed_.empty(); }
  void Cancel() override { changed_.clear(); }

  absl::Status Finish() override {
    int64_t vertices = static_cast<int64_t>(map_.template number_of_attributes<0>());
    for (const auto& [v, shared] : shared_) {
      if (shared.lowest != shared.own) --vertices;
    }
    report_.counts["vertices"] = vertices;
    return absl::OkStatus();
  }

  Report report() const override { return report_; }

 private:
  // A vertex on critical faces.
  struct Shared {
    Number own = 0;
    Number lowest = 0;
    bool told = false;
    // Critical darts that start at it.
    std::vector<Dart> darts;
  };

  void CountCells() {
    auto& counts = report_.counts;
    counts["darts"] = static_cast<int64_t>(map_.number_of_darts());
    counts["critical_darts"] = static_cast<int64_t>(block_.critical_count());
    counts["accounted_bytes"] = static_cast<int64_t>(block_.AccountedBytes());
    counts["hexahedra"] = static_cast<int64_t>(map_.template number_of_attributes<3>());
    std::array<int64_t, CellId::kMaxLevel + 1> levels{};
    std::array<int64_t, 5> states{};
    auto& cells = map_.template attributes<3>();
    for (auto it = cells.begin(); it != cells.end(); ++it) {
      const auto& info = map_.template info_of_attribute<3>(it);
      ++levels[info.id.level()];
      ++states[static_cast<size_t>(info.state)];
    }
    for (size_t l = 0; l < levels.size(); ++l) {
      if (levels[l] != 0) counts[absl::StrCat("level_", l)] = levels[l];
    }
    counts["cut"] = states[static_cast<size_t>(CellState::kCut)];
    counts["inside"] = states[static_cast<size_t>(CellState::kInside)];
    counts["outside"] = states[static_cast<size_t>(CellState::kOutside)];
    counts["unclassified"] =
        states[static_cast<size_t>(CellState::kUnknown)] + states[static_cast<size_t>(CellState::kClear)];
  }

  const Routing routing_;
  BlockT& block_;
  Lcc& map_;
  absl::flat_hash_map<Vertex, Shared, HandleHash<Vertex>> shared_;
  std::vector<Vertex> changed_;
  Report report_;
};

}  // namespace ndmap

// SPDX-License-Identifier: GPL-3.0-or-later
// Counts the cells of the global map: hexahedra by level, all cells by kind and state, darts, critical darts,
// and vertices, which blocks share: each block numbers its own, neighbours tell each other the lowest number
// of every vertex on a critical (n-1)-cell until nothing changes, and a vertex is counted where its own
// number is the lowest. Exact for any cut.
//
// Counts: hexahedra, level_L (of them), tetrahedra, pyramids, prisms (where there are any), cut, inside,
// outside, unclassified (cells of all kinds), darts, critical_darts, vertices, accounted_bytes; of a
// cancelled count: cancelled, alone. In a map of dimension 2, in place of those before darts: faces, of them
// triangles, quadrilaterals and polygons (larger ones), edges, boundary_edges.
#pragma once

#include <algorithm>
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
#include "core/map/handle_hash.h"
#include "core/map/partial_scan.h"

namespace ndmap {

template <class BlockT>
class Count final : public BlockAlgorithm {
 public:
  using Lcc = typename BlockT::Lcc;
  using Dart = typename BlockT::Dart;
  using Vertex = typename BlockT::Types::Vertex;
  using Cell = typename BlockT::Types::Cell;
  // (block, number in the block).
  using Number = uint64_t;
  static constexpr unsigned n = BlockT::n;
  static_assert(n == 2 || n == 3);
  // Of the vertex where the critical dart starts; of that where it ends.
  enum MessageKind : uint8_t { kLowest = 1, kLowestAtEnd = 2 };

  static absl::StatusOr<std::unique_ptr<BlockAlgorithm>> Make(const Parameters&,
                                                              const Environment& environment, BlockT& block) {
    return std::make_unique<Count>(environment.routing, block);
  }

  Count(Routing routing, BlockT& block)
      : routing_(routing),
        block_(block),
        map_(block.map()),
        labels_(block.labels()),
        cells_(map_.template attributes<n>()) {}

  bool changes_map() const override { return false; }

  absl::StatusOr<bool> Start(size_t budget) override {
    if (cancelled_) return true;
    const bool all_labels = labels_.Next(&budget, [this](auto entry) {
      const Dart d = entry->dart;
      Share(map_.template attribute<0>(d), {d, kLowest});
      // In a 3-map the dart after it is critical too.
      if (n == 2) Share(map_.template attribute<0>(map_.template beta<1>(d)), {d, kLowestAtEnd});
    });
    if (!all_labels || !cells_.Next(&budget, [&](Cell cell) { CountCell(cell, &budget); })) return false;
    CountAll();
    return true;
  }

  absl::Status Receive(BlockId from, const Message& message, Outbox&) override {
    Number lowest = 0;
    if ((message.kind != kLowest && message.kind != kLowestAtEnd) || !FromBytes(message.payload, &lowest)) {
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
    const Vertex v = map_.template attribute<0>(message.kind == kLowest ? map_.template beta<1>(d) : d);
    const auto it = shared_.find(v);
    if (it == shared_.end() && cancelled_) return absl::OkStatus();
    if (it == shared_.end()) {
      return absl::InternalError(absl::StrCat("block ", block_.id().value, ": the face of label ",
                                              ToString(message.label), " is not critical altogether"));
    }
    Shared& shared = it->second;
    if (lowest < shared.lowest && !cancelled_) {
      if (shared.lowest == shared.own) ++counted_elsewhere_;
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
      for (const auto& [d, kind] : shared.ends) {
        const Critical& c = block_.critical(d);
        const Message message{kind, c.label, BytesOf(shared.lowest)};
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
  void Cancel() override {
    cancelled_ = true;
    changed_.clear();
  }

  absl::StatusOr<bool> Finish(size_t) override {
    report_.counts["vertices"] =
        static_cast<int64_t>(map_.template number_of_attributes<0>()) - counted_elsewhere_;
    return true;
  }

  Report report() const override {
    if (!cancelled_) return report_;
    Report report;
    report.counts["cancelled"] = 1;
    return report;
  }

 private:
  // A vertex on critical faces.
  struct Shared {
    Number own = 0;
    Number lowest = 0;
    bool told = false;
    // Critical darts that start (or, in a 2-map, end) at it.
    std::vector<std::pair<Dart, MessageKind>> ends;
  };

  void Share(Vertex v, const std::pair<Dart, MessageKind>& end) {
    const Number own = Number{block_.id().value} << 32 | shared_.size();
    auto [it, made] = shared_.try_emplace(v);
    if (made) it->second.lowest = it->second.own = own;
    it->second.ends.push_back(end);
    if (made) changed_.push_back(v);
  }

  // Lowers the budget when it took more than a step.
  void CountCell(Cell cell, size_t* budget) {
    if constexpr (n == 2) {
      CountFace(map_.template info_of_attribute<2>(cell).reference, budget);
      return;
    }
    const auto& info = map_.template info_of_attribute<n>(cell);
    ++kinds_[static_cast<size_t>(info.kind)];
    if (info.kind == CellKind::kHexahedron) ++levels_[info.id.level()];
    ++states_[static_cast<size_t>(info.state)];
  }

  void CountFace(Dart d, size_t* budget) {
    constexpr size_t kSidesAStep = 64;
    size_t sides = 0;
    const Dart first = d;
    do {
      ++sides;
      if (!map_.template is_free<2>(d)) {
        ++glued_;
      } else if (!block_.IsCritical(d)) {
        ++boundary_edges_;
      } else if (block_.critical(d).positive) {
        ++cut_edges_;
      }
      d = map_.template beta<1>(d);
    } while (d != first);
    ++kinds_[std::min<size_t>(sides, 5) - 3];
    *budget -= std::min(*budget - 1, sides / kSidesAStep);
  }

  void CountAll() {
    auto& counts = report_.counts;
    counts["darts"] = static_cast<int64_t>(map_.number_of_darts());
    counts["critical_darts"] = static_cast<int64_t>(block_.critical_count());
    counts["accounted_bytes"] = static_cast<int64_t>(block_.AccountedBytes());
    if (n == 2) {
      counts["faces"] = kinds_[0] + kinds_[1] + kinds_[2];
      counts["triangles"] = kinds_[0];
      counts["quadrilaterals"] = kinds_[1];
      counts["polygons"] = kinds_[2];
      counts["edges"] = glued_ / 2 + cut_edges_ + boundary_edges_;
      counts["boundary_edges"] = boundary_edges_;
      return;
    }
    for (size_t k = 0; k < kinds_.size(); ++k) {
      const auto kind = static_cast<CellKind>(k);
      if (kinds_[k] == 0 && kind != CellKind::kHexahedron) continue;
      counts[std::string(ShapeOf(kind).plural)] = kinds_[k];
    }
    for (size_t l = 0; l < levels_.size(); ++l) {
      if (levels_[l] != 0) counts[absl::StrCat("level_", l)] = levels_[l];
    }
    const auto in_state = [this](CellState state) { return states_[static_cast<size_t>(state)]; };
    counts["cut"] = in_state(CellState::kCut);
    counts["inside"] = in_state(CellState::kInside);
    counts["outside"] = in_state(CellState::kOutside);
    counts["unclassified"] = in_state(CellState::kUnknown) + in_state(CellState::kClear);
  }

  const Routing routing_;
  BlockT& block_;
  Lcc& map_;
  PartialScan<const typename BlockT::Labels> labels_;
  PartialScan<typename Lcc::template Attribute_range<n>::type> cells_;
  bool cancelled_ = false;
  absl::flat_hash_map<Vertex, Shared, HandleHash<Vertex>> shared_;
  // Shared vertices of which another block has a lower number.
  int64_t counted_elsewhere_ = 0;
  std::vector<Vertex> changed_;
  std::array<int64_t, CellId::kMaxLevel + 1> levels_{};
  // Of a 2-map: triangles, quadrilaterals, larger ones.
  std::array<int64_t, kCellKinds> kinds_{};
  // Of a 2-map: darts that are glued in the block, edges of which this block has the positive side, edges
  // with one face.
  int64_t glued_ = 0;
  int64_t cut_edges_ = 0;
  int64_t boundary_edges_ = 0;
  std::array<int64_t, 5> states_{};
  Report report_;
};

}  // namespace ndmap

// SPDX-License-Identifier: GPL-3.0-or-later
// Erases the cells that are not wanted, hexahedra and others, in every block at once, and tells the
// neighbours' blocks that the shared faces are boundary now: RemoveFace(l), l any label of the face. Both
// sides may erase at once, so a label that is absent means that there is nothing to do. A phase of its own.
// In a map of dimension 2: faces in place of cells, edges in place of faces, and no states, so that the ones
// to erase must be listed.
//
// Parameters: keep: inside, cut, outside, or several of them with commas (default "inside,cut"), or all; or
// cells: the ids of those to erase, in text form, separated by spaces, whatever their state. Counts: removed,
// hexahedra or faces (left), accounted_bytes.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/container/flat_hash_set.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_split.h"
#include "core/algorithm/block_algorithm.h"
#include "core/map/block.h"
#include "core/map/handle_hash.h"
#include "core/map/partial_scan.h"

namespace ndmap {

enum TrimMessage : uint8_t { kRemoveFace = 1 };

template <class BlockT>
class Trim final : public BlockAlgorithm {
 public:
  using Lcc = typename BlockT::Lcc;
  using Dart = typename BlockT::Dart;
  using Cell = typename BlockT::Types::Cell;
  using Vertex = typename BlockT::Types::Vertex;
  static constexpr unsigned n = BlockT::n;

  static absl::StatusOr<std::unique_ptr<BlockAlgorithm>> Make(const Parameters& parameters,
                                                              const Environment& environment, BlockT& block) {
    const std::string text = parameters.TextOr("keep", "inside,cut");
    Keep keep;
    for (absl::string_view word : absl::StrSplit(text, ',')) {
      if (word == "inside" || word == "all") keep.inside = true;
      if (word == "cut" || word == "all") keep.cut = true;
      if (word == "outside" || word == "all") keep.outside = true;
      if (word != "inside" && word != "cut" && word != "outside" && word != "all") {
        return absl::InvalidArgumentError(
            absl::StrCat("parameter 'keep' is '", text, "', expected inside, cut, outside or all"));
      }
    }
    auto trim = std::make_unique<Trim>(keep, environment.routing, block);
    if (!parameters.Has("cells")) {
      if (n == 2 && text != "all") {
        return absl::FailedPreconditionError(
            "faces of a surface are not inside, cut or outside: parameter 'cells' must list those to erase");
      }
      return trim;
    }
    absl::StatusOr<absl::flat_hash_set<CellId>> cells = ParseCellIds(parameters.TextOr("cells", ""));
    if (!cells.ok()) return cells.status();
    for (const CellId& id : *cells) {
      if (id.is_polygon() == (n == 2)) continue;
      return absl::InvalidArgumentError(absl::StrCat(
          "parameter 'cells' has ", id.ToString(), ", which no cell of a map of dimension ", n, " is named"));
    }
    trim->listed_ = *std::move(cells);
    return trim;
  }

  struct Keep {
    bool inside = false;
    bool cut = false;
    bool outside = false;
  };

  Trim(Keep keep, Routing routing, BlockT& block)
      : keep_(keep),
        routing_(routing),
        block_(block),
        map_(block.map()),
        scan_(map_.template attributes<n>()) {}

  absl::StatusOr<bool> Start(size_t budget) override {
    if (cancelled_) return true;
    absl::Status status;
    const bool all = scan_.Next(&budget, [&](Cell cell) { status.Update(Look(cell)); });
    if (!status.ok()) return status;
    return all;
  }

  absl::Status Receive(BlockId from, const Message& message, Outbox&) override {
    if (message.kind != kRemoveFace) {
      return absl::InvalidArgumentError(
          absl::StrCat("trim: message kind ", message.kind, " from block ", from.value));
    }
    const Dart d = block_.Find(message.label);
    if (d == Lcc::null_handle) return absl::OkStatus();
    ClearFace(d);
    block_.Touch();
    return absl::OkStatus();
  }

  absl::StatusOr<size_t> Work(size_t budget, Outbox& out) override {
    size_t steps = 0;
    for (; steps < budget && !todo_.empty(); ++steps) {
      RemoveCell(todo_.back(), out);
      todo_.pop_back();
    }
    for (; steps < budget && todo_.empty() && !order_.empty(); ++steps) {
      const Dart d = order_.back();
      order_.pop_back();
      if (touched_.contains(d)) SplitVertex(d);
    }
    block_.Touch();
    return steps;
  }

  bool HasWork() const override { return !todo_.empty() || !order_.empty(); }
  void Cancel() override {
    cancelled_ = true;
    todo_.clear();
  }
  absl::StatusOr<bool> Finish(size_t) override { return true; }

  Report report() const override {
    Report report;
    report.counts["removed"] = removed_;
    report.counts[n == 2 ? "faces" : "hexahedra"] =
        static_cast<int64_t>(map_.template number_of_attributes<n>()) - others_;
    report.counts["accounted_bytes"] = static_cast<int64_t>(block_.AccountedBytes());
    return report;
  }

 private:
  bool Kept(CellState state) const {
    switch (state) {
      case CellState::kInside:
        return keep_.inside;
      case CellState::kCut:
        return keep_.cut;
      default:
        return keep_.outside;
    }
  }

  // Whether the cell is to go.
  absl::Status Look(Cell cell) {
    const auto& info = map_.template info_of_attribute<n>(cell);
    if (n == 3 && info.kind != CellKind::kHexahedron) ++others_;
    if (listed_.has_value()) {
      if (listed_->contains(info.id)) todo_.push_back(cell);
      return absl::OkStatus();
    }
    const bool all = keep_.inside && keep_.cut && keep_.outside;
    if (!all && (info.state == CellState::kUnknown || info.state == CellState::kClear)) {
      return absl::FailedPreconditionError(
          absl::StrCat("block ", block_.id().value, ": cell ", info.id.ToString(), " is not classified"));
    }
    if (!Kept(info.state)) todo_.push_back(cell);
    return absl::OkStatus();
  }

  void RemoveCell(Cell cell, Outbox& out) {
    if (n == 3 && map_.template info_of_attribute<n>(cell).kind != CellKind::kHexahedron) --others_;
    Gather(map_.template info_of_attribute<n>(cell).reference);
    for (Dart d : darts_) {
      if (block_.IsCritical(d)) {
        TellRemoved(d, out);
      } else if (!map_.template is_free<n>(d)) {
        const Dart beyond = map_.template beta<n>(d);
        Touch(beyond);
        // In a 3-map the dart after it is beyond the same face.
        if constexpr (n == 2) Touch(map_.template beta<1>(beyond));
        map_.template unlink_beta_for_involution<n>(d);
      }
    }
    for (Dart d : darts_) {
      touched_.erase(d);
      map_.erase_dart(d);
    }
    ++removed_;
  }

  void Touch(Dart d) {
    if (touched_.insert(d).second) order_.push_back(d);
  }

  // All darts of the cell of d, into darts_.
  void Gather(Dart d) {
    darts_.clear();
    const auto mark = map_.get_new_mark();
    map_.mark(d, mark);
    darts_.push_back(d);
    for (size_t i = 0; i < darts_.size(); ++i) {
      for (int j = 1; j < static_cast<int>(n); ++j) {
        const Dart e = map_.beta(darts_[i], j);
        if (map_.is_marked(e, mark)) continue;
        map_.mark(e, mark);
        darts_.push_back(e);
      }
    }
    for (Dart e : darts_) map_.unmark(e, mark);
    map_.free_mark(mark);
  }

  // One message a face: any label names it.
  void TellRemoved(Dart d, Outbox& out) {
    const Critical c = block_.critical(d);
    if (routing_ == Routing::kBroadcast) {
      out.Broadcast({kRemoveFace, c.label, {}});
    } else {
      out.Send(c.peer, {kRemoveFace, c.label, {}});
    }
    ClearFace(d);
  }

  // The (n-1)-cell of a critical dart is boundary now.
  void ClearFace(Dart d) {
    Dart e = d;
    do {
      if (block_.IsCritical(e)) block_.ClearCritical(e);
      if constexpr (n == 3) e = map_.template beta<1>(e);
    } while (e != d);
  }

  // Where cells were removed the n-cells around a vertex may hang together no longer: each part gets a vertex
  // of its own, as CGAL's 0-cells do. Every such part has a dart that lost its neighbour. O(darts around the
  // vertex).
  void SplitVertex(Dart d) {
    const Vertex v = map_.template attribute<0>(d);
    const auto mark = map_.get_new_mark();
    darts_.clear();
    auto visit = [&](Dart e) {
      if (map_.is_marked(e, mark)) return;
      map_.mark(e, mark);
      darts_.push_back(e);
    };
    visit(d);
    for (size_t i = 0; i < darts_.size(); ++i) {
      const Dart e = darts_[i];
      const Dart before = map_.template beta<0>(e);
      for (int j = 2; j <= static_cast<int>(n); ++j) {
        if (!map_.is_free(e, static_cast<unsigned>(j))) visit(map_.beta(e, j, 1));
        if (!map_.is_free(before, static_cast<unsigned>(j))) visit(map_.beta(before, j));
      }
    }
    Vertex own = v;
    if (darts_.size() != map_.template get_attribute_ref_counting<0>(v)) {
      own = map_.template create_attribute<0>(map_.point_of_vertex_attribute(v));
      map_.template info_of_attribute<0>(own) = map_.template info_of_attribute<0>(v);
    }
    for (Dart e : darts_) {
      map_.unmark(e, mark);
      touched_.erase(e);
      map_.template set_dart_attribute<0>(e, own);
    }
    // The dart that the vertex knew may be gone.
    map_.template set_dart_of_attribute<0>(own, d);
    map_.free_mark(mark);
  }

  const Keep keep_;
  std::optional<absl::flat_hash_set<CellId>> listed_;
  const Routing routing_;
  BlockT& block_;
  Lcc& map_;
  PartialScan<typename Lcc::template Attribute_range<n>::type> scan_;
  bool cancelled_ = false;
  std::vector<Cell> todo_;
  std::vector<Dart> darts_;
  // Darts at whose vertices something was lost (those whose dart beyond their (n-1)-cell was) and that are
  // still here; and all that ever were, in order.
  absl::flat_hash_set<Dart, HandleHash<Dart>> touched_;
  std::vector<Dart> order_;
  int64_t removed_ = 0;
  // Cells that are no hexahedra.
  int64_t others_ = 0;
};

}  // namespace ndmap

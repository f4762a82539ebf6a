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
#include "core/map/handle_table.h"
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
    // A table that grows is copied in one go.
    if (todo_.empty()) {
      doomed_.Reserve(map_.template attributes<n>());
      whole_.Reserve(map_.template attributes<0>());
    }
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
    const auto mark = map_.get_new_mark();
    for (; steps < budget && !todo_.empty(); ++steps) {
      RemoveCell(todo_.back(), mark, out);
      todo_.pop_back();
    }
    for (; steps < budget && !spared_.empty(); ++steps) {
      Spare(spared_.back(), mark);
      spared_.pop_back();
    }
    for (; steps < budget && todo_.empty() && !touched_.empty(); ++steps) {
      SplitVertex(touched_.back(), mark);
      touched_.pop_back();
    }
    map_.free_mark(mark);
    block_.Touch();
    return steps;
  }

  bool HasWork() const override { return !todo_.empty() || !spared_.empty() || !touched_.empty(); }
  void Cancel() override {
    cancelled_ = true;
    if (removed_ > 0) spared_.insert(spared_.end(), todo_.begin(), todo_.end());
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

  void Doom(Cell cell) {
    todo_.push_back(cell);
    doomed_[cell] = 1;
  }

  // Whether the cell is to go.
  absl::Status Look(Cell cell) {
    const auto& info = map_.template info_of_attribute<n>(cell);
    if (n == 3 && info.kind != CellKind::kHexahedron) ++others_;
    if (listed_.has_value()) {
      if (listed_->contains(info.id)) Doom(cell);
      return absl::OkStatus();
    }
    const bool all = keep_.inside && keep_.cut && keep_.outside;
    if (!all && (info.state == CellState::kUnknown || info.state == CellState::kClear)) {
      return absl::FailedPreconditionError(
          absl::StrCat("block ", block_.id().value, ": cell ", info.id.ToString(), " is not classified"));
    }
    if (!Kept(info.state)) Doom(cell);
    return absl::OkStatus();
  }

  // All its darts are erased; what it was glued to is n-free then. O(its darts).
  void RemoveCell(Cell cell, typename Lcc::size_type mark, Outbox& out) {
    if (n == 3 && map_.template info_of_attribute<n>(cell).kind != CellKind::kHexahedron) --others_;
    Gather(map_.template info_of_attribute<n>(cell).reference, mark);
    for (size_t i = 0; i < faces_.size(); ++i) {
      const size_t end = i + 1 < faces_.size() ? faces_[i + 1] : darts_.size();
      if (block_.IsCritical(darts_[faces_[i]])) {
        TellRemoved(darts_[faces_[i]], out);
      } else if (!map_.template is_free<n>(darts_[faces_[i]])) {
        Release(faces_[i], end);
      }
    }
    // The marks go with the darts.
    for (Dart d : darts_) map_.erase_dart(d);
    ++removed_;
  }

  // Unlinks an (n-1)-cell of the cell to be erased. Only what stays has to be looked at again.
  void Release(size_t first, size_t end) {
    const bool stays = doomed_.Get(map_.template attribute<n>(map_.template beta<n>(darts_[first]))) == 0;
    for (size_t i = first; i < end; ++i) {
      if (stays) Touch(map_.template beta<n>(darts_[i]));
      map_.template unlink_beta_for_involution<n>(darts_[i]);
    }
  }

  // Looks again at the vertex of a dart that has no dart beyond its (n-1)-cell any more.
  void Touch(Dart d) {
    touched_.push_back(d);
    // In a 3-map the vertex at its end is that of the dart after it, which is in the same (n-1)-cell.
    if constexpr (n == 2) touched_.push_back(map_.template beta<1>(d));
  }

  // All darts of the cell of d, one (n-1)-cell after the other, into darts_, and where these begin into
  // faces_; all are marked with a mark that no dart of the cell had.
  void Gather(Dart d, typename Lcc::size_type mark) {
    darts_.clear();
    faces_.clear();
    GatherCircle(d, mark);
    if constexpr (n == 3) {
      for (size_t i = 0; i < darts_.size(); ++i) {
        const Dart e = map_.template beta<2>(darts_[i]);
        if (!map_.is_marked(e, mark)) GatherCircle(e, mark);
      }
    }
  }
  void GatherCircle(Dart d, typename Lcc::size_type mark) {
    Dart e = d;
    do {
      if (n == 2 || e == d) faces_.push_back(darts_.size());
      map_.mark(e, mark);
      darts_.push_back(e);
      e = map_.template beta<1>(e);
    } while (e != d);
  }

  // A cell that was to go and stays after all: it may have lost neighbours.
  void Spare(Cell cell, typename Lcc::size_type mark) {
    Gather(map_.template info_of_attribute<n>(cell).reference, mark);
    for (Dart e : darts_) {
      map_.unmark(e, mark);
      if (map_.template is_free<n>(e)) Touch(e);
    }
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
  // vertex), once a part.
  void SplitVertex(Dart d, typename Lcc::size_type mark) {
    const Vertex v = map_.template attribute<0>(d);
    if (whole_.Get(v) != 0) return;
    darts_.clear();
    const auto visit = [&](Dart e) {
      if (map_.is_marked(e, mark)) return;
      map_.mark(e, mark);
      darts_.push_back(e);
    };
    visit(d);
    for (size_t i = 0; i < darts_.size(); ++i) {
      // In a volume from face to face around the vertex, which comes back, and over faces to the next
      // volumes: that reaches all. Around the vertex of a surface it may come to an end.
      const Dart e = darts_[i];
      if (!map_.template is_free<2>(e)) visit(map_.template beta<2, 1>(e));
      if constexpr (n == 3) {
        if (!map_.template is_free<3>(e)) visit(map_.template beta<3, 1>(e));
      }
    }
    if constexpr (n == 2) {
      // The other way round from where it began; after a whole round there is nothing new.
      for (Dart e = map_.template beta<0>(d); !map_.template is_free<2>(e); e = map_.template beta<0>(e)) {
        e = map_.template beta<2>(e);
        if (map_.is_marked(e, mark)) break;
        visit(e);
      }
    }
    for (Dart e : darts_) map_.unmark(e, mark);
    Vertex own = v;
    if (darts_.size() != map_.template get_attribute_ref_counting<0>(v)) {
      own = map_.template create_attribute<0>(map_.point_of_vertex_attribute(v));
      map_.template info_of_attribute<0>(own) = map_.template info_of_attribute<0>(v);
      for (Dart e : darts_) map_.template set_dart_attribute<0>(e, own);
    }
    // The dart that the vertex knew may be gone.
    map_.template set_dart_of_attribute<0>(own, d);
    whole_[own] = 1;
  }

  const Keep keep_;
  std::optional<absl::flat_hash_set<CellId>> listed_;
  const Routing routing_;
  BlockT& block_;
  Lcc& map_;
  PartialScan<typename Lcc::template Attribute_range<n>::type> scan_;
  bool cancelled_ = false;
  // Cells to be erased, and whether a cell was ever one of them.
  std::vector<Cell> todo_;
  HandleTable<Cell, uint8_t> doomed_;
  // After a cancel: cells that were to be erased.
  std::vector<Cell> spared_;
  std::vector<Dart> darts_;
  std::vector<size_t> faces_;
  // Darts of cells that stay, at whose vertices something was lost.
  std::vector<Dart> touched_;
  // Vertices all darts of which hang together.
  HandleTable<Vertex, uint8_t> whole_;
  int64_t removed_ = 0;
  // Cells that are no hexahedra.
  int64_t others_ = 0;
};

}  // namespace ndmap

// SPDX-License-Identifier: GPL-3.0-or-later
// Adaptive 1:8 refinement of the hexahedra of one block, with the messages that keep the neighbours' copies
// of shared edges and faces equal (Damiand et al. 2018, Algorithms 1-3, made independent of order;
// docs/protocol.md):
//
//   SplitEdge(l)    the edge with label l is split
//   SplitFace(l0)   the face that has l0 among its four edge labels is split, and so are its edges
//
// Other cells of a mesh stay whole; their edges and faces are split by hexahedra beside them.
//
// Every handler is idempotent, and two operations give the same map and labels in either order, so the global
// map depends only on which hexahedra were refined. What arrives for a label that is not made yet is kept and
// tried again when the label is made.
//
// Parameters: depth (0 ... 29): hexahedra of levels 0 ... depth - 1 are refined where the oracle says so;
// level: only those of this level (a phase a level, as published); without it all, children included, in one
// phase; children: digits, and of that level only the cells with one of these child numbers (of initial
// cells: numbers modulo 8), so that a level is refined a part at a time; oracle and its parameters
// (oracle.h); memory_limit: accounted bytes above which no own refinement begins (0: none). Counts: refined,
// refined_at_boundary (those with a face that another block has, too), cells_tested, messages_kept,
// stopped_by_memory (0 or 1), accounted_bytes; of an oracle that was given a list also listed (ids in it that
// the phase refines if they are there, told by block 0 alone so that the sum counts each once) and
// listed_found (those that this block had, when the phase began or since).
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/container/flat_hash_set.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "core/algorithm/block_algorithm.h"
#include "core/algorithm/refine/children.h"
#include "core/algorithm/refine/oracle.h"
#include "core/algorithm/refine/subdivider.h"
#include "core/map/memory.h"
#include "core/map/partial_scan.h"

namespace ndmap {

enum RefineMessage : uint8_t { kSplitEdge = 1, kSplitFace = 2 };

template <class BlockT>
class Refine final : public BlockAlgorithm {
 public:
  using Lcc = typename BlockT::Lcc;
  using Dart = typename BlockT::Dart;
  using Cell = typename BlockT::Types::Cell;
  using F = Frame<BlockT>;

  struct Options {
    int depth = 0;
    // kAllLevels: children are refined in the same phase.
    static constexpr int kAllLevels = -1;
    int level = kAllLevels;
    size_t memory_limit = 0;
    // A bit for each child number.
    uint32_t children = 0xff;
  };

  static absl::StatusOr<std::unique_ptr<BlockAlgorithm>> Make(const Parameters& parameters,
                                                              const Environment& environment, BlockT& block) {
    Options options;
    absl::StatusOr<int64_t> depth = parameters.Integer("depth", 0, CellId::kMaxLevel);
    if (!depth.ok()) {
      return absl::Status(
          depth.status().code(),
          absl::StrCat(depth.status().message(), " (ids of cells hold ", CellId::kMaxLevel, " levels)"));
    }
    absl::StatusOr<int64_t> level =
        parameters.IntegerOr("level", Options::kAllLevels, Options::kAllLevels, CellId::kMaxLevel - 1);
    if (!level.ok()) return level.status();
    absl::StatusOr<int64_t> limit =
        parameters.IntegerOr("memory_limit", 0, 0, std::numeric_limits<int64_t>::max());
    if (!limit.ok()) return limit.status();
    options.depth = static_cast<int>(*depth);
    options.level = static_cast<int>(*level);
    options.memory_limit = static_cast<size_t>(*limit);
    if (parameters.Has("children")) {
      absl::StatusOr<uint32_t> children = ParseChildren(parameters.TextOr("children", ""));
      if (!children.ok()) return children.status();
      if (options.level == Options::kAllLevels) {
        return absl::InvalidArgumentError("parameter 'children' without parameter 'level'");
      }
      options.children = *children;
    }
    absl::StatusOr<std::unique_ptr<RefineOracle>> oracle =
        MakeOracle(parameters, environment, [&block] { return VertexBox(block); });
    if (!oracle.ok()) return oracle.status();
    return std::make_unique<Refine>(options, environment, *std::move(oracle), block);
  }

  Refine(Options options, const Environment& environment, std::unique_ptr<RefineOracle> oracle, BlockT& block)
      : options_(options),
        routing_(environment.routing),
        oracle_(std::move(oracle)),
        block_(block),
        map_(block.map()),
        subdivider_(block),
        cells_(map_.template attributes<3>()),
        labels_(block.labels()) {}

  absl::StatusOr<bool> Start(size_t budget) override {
    // The roots are needed when it was cancelled, too: others may have begun to split.
    if (routing_ == Routing::kBroadcast &&
        !labels_.Next(&budget, [this](auto it) { roots_.insert(it->label.root); })) {
      return false;
    }
    absl::Status status;
    const bool all = cancelled_ || cells_.Next(&budget, [&](Cell cell) {
      const auto& info = map_.template info_of_attribute<3>(cell);
      if (info.kind != CellKind::kHexahedron) {
        if (oracle_->Lists(info.id)) status.Update(NotRefined(info.id, info.kind));
        return;
      }
      if (IsOfPhase(info.id)) todo_.push_back(cell);
    });
    if (!status.ok()) return status;
    return all;
  }

  absl::Status Receive(BlockId from, const Message& message, Outbox& out) override {
    if (message.kind != kSplitEdge && message.kind != kSplitFace) {
      return absl::InvalidArgumentError(
          absl::StrCat("refine: message kind ", message.kind, " from block ", from.value));
    }
    const int level = LabelLevel(message.label);
    if (message.label.path == 0 || level >= kMaxLabelLevel) {
      return absl::InvalidArgumentError(
          absl::StrCat("refine: label ", ToString(message.label), " from block ", from.value));
    }
    if (routing_ == Routing::kBroadcast && !roots_.contains(message.label.root)) {
      return absl::OkStatus();
    }
    absl::Status status = Handle(message.kind, message.label, out);
    if (status.ok()) status = RetryKept(out);
    return status;
  }

  absl::StatusOr<size_t> Work(size_t budget, Outbox& out) override {
    size_t steps = 0;
    while (steps < budget && !todo_.empty()) {
      const Cell cell = todo_.back();
      todo_.pop_back();
      ++steps;
      ++tested_;
      if (oracle_->Lists(map_.template info_of_attribute<3>(cell).id)) ++listed_found_;
      if (!IsToBeRefined(cell)) continue;
      if (options_.memory_limit != 0 &&
          block_.AccountedBytes() + SplitBytes(block_) > options_.memory_limit) {
        stopped_by_memory_ = true;
        todo_.clear();
        break;
      }
      RefineCell(cell, F::Of(map_, cell), out);
      if (absl::Status status = RetryKept(out); !status.ok()) return status;
      steps += 3;
    }
    return steps;
  }

  bool HasWork() const override { return !todo_.empty(); }
  void Cancel() override {
    cancelled_ = true;
    todo_.clear();
  }

  absl::StatusOr<bool> Finish(size_t) override {
    if (kept_count_ == 0) return true;
    return absl::InternalError(absl::StrCat("block ", block_.id().value, ": ", kept_count_,
                                            " messages still wait at the end of the phase, one for label ",
                                            ToString(kept_.begin()->first)));
  }

  Report report() const override {
    Report report;
    report.counts["refined"] = refined_;
    report.counts["refined_at_boundary"] = refined_at_boundary_;
    report.counts["cells_tested"] = tested_;
    report.counts["messages_kept"] = ever_kept_;
    report.counts["stopped_by_memory"] = stopped_by_memory_ ? 1 : 0;
    report.counts["accounted_bytes"] = static_cast<int64_t>(block_.AccountedBytes());
    const auto listed = oracle_->CountListed([this](const CellId& id) { return IsOfPhase(id); });
    if (listed.has_value()) {
      report.counts["listed"] = block_.id().value == 0 ? static_cast<int64_t>(*listed) : 0;
      report.counts["listed_found"] = listed_found_;
    }
    return report;
  }

  // For tests: messages that wait now.
  size_t kept_count() const { return kept_count_; }

 private:
  // An upper estimate of what one refinement adds to a block's accounted bytes.
  static size_t SplitBytes(const BlockT& block) {
    constexpr size_t kDarts = 640, kVertices = 64, kCells = 8, kLabels = 32;
    return BytesToGrow(block, kDarts, kVertices, kCells) + kLabels * LabelTable<Dart>::kMostBytes;
  }

  // Whether cells of this id are refined in this phase if the oracle says so.
  bool IsOfPhase(const CellId& id) const {
    const int level = id.level();
    return level < options_.depth && (options_.level == Options::kAllLevels || level == options_.level) &&
           (options_.children >> ChildNumber(id) & 1) != 0;
  }

  static unsigned ChildNumber(const CellId& id) {
    return id.level() == 0 ? static_cast<unsigned>(id.initial() % 8) : id.last_digit();
  }

  static absl::StatusOr<uint32_t> ParseChildren(const std::string& text) {
    uint32_t children = 0;
    for (const char c : text) {
      if (c >= '0' && c <= '7') children |= uint32_t{1} << (c - '0');
    }
    if (!text.empty() && text.find_first_not_of("01234567") == std::string::npos) return children;
    return absl::InvalidArgumentError(
        absl::StrCat("parameter 'children' is '", text, "', expected digits 0 to 7"));
  }

  static absl::Status NotRefined(const CellId& id, CellKind kind) {
    return absl::InvalidArgumentError(absl::StrCat("cell ", id.ToString(), " is to be refined and is a ",
                                                   ShapeOf(kind).name, ": only hexahedra are"));
  }

  // Asks the oracle, unless it has told of the cell already.
  bool IsToBeRefined(Cell cell) {
    auto& info = map_.template info_of_attribute<3>(cell);
    if (oracle_->tells_cut() && info.state != CellState::kUnknown) return info.state == CellState::kCut;
    const bool refine = oracle_->Refine(info.id, F::Of(map_, cell).Corners(map_));
    if (oracle_->tells_cut()) {
      info.state = refine ? CellState::kCut : CellState::kClear;
      block_.Touch();
    }
    return refine;
  }

  void RefineCell(Cell cell, const F& frame, Outbox& out) {
    const int l = frame.level;
    std::array<bool, hexahedron::kFaces> whole;
    bool at_boundary = false;
    for (unsigned f = 0; f < hexahedron::kFaces; ++f) {
      const Dart d = frame.first[hexahedron::Role(f, 0)];
      whole[f] = frame.whole || F::FaceIsWhole(map_, d, l);
      at_boundary = at_boundary || block_.IsCritical(d);
    }
    for (unsigned role = 0; role < hexahedron::kRoles; ++role) {
      // Each edge has two roles; and a neighbour may have split it.
      if (hexahedron::kAcross[role] < role) continue;
      if (!frame.whole && F::EndLevel(map_, frame.first[role]) > l) continue;
      // A face of this cell that has a whole edge is whole and is told by its SplitFace.
      for (const auto& split : subdivider_.SplitEdge(frame.first[role])) {
        if (map_.template attribute<3>(split.dart) != cell) Tell(kSplitEdge, split.label, split.dart, out);
      }
    }
    for (unsigned f = 0; f < hexahedron::kFaces; ++f) {
      if (!whole[f]) continue;
      const Dart d = frame.first[hexahedron::Role(f, 0)];
      const bool critical = block_.IsCritical(d);
      const Label name = critical ? subdivider_.FaceName(d, l) : Label();
      subdivider_.SplitFace(d, l);
      if (critical) Tell(kSplitFace, name, d, out);
    }
    const CellId id = map_.template info_of_attribute<3>(cell).id;
    const std::array<Point3, 8> corners = frame.Corners(map_);
    const std::array<Cell, 8> children = subdivider_.SplitVolume(cell, frame, corners);
    if (oracle_->tells_cut()) {
      // Together they cost little more than one of them.
      const std::array<bool, 8> cut = oracle_->CutEach(ChildBoxes(corners));
      for (unsigned c = 0; c < 8; ++c) {
        map_.template info_of_attribute<3>(children[c]).state = cut[c] ? CellState::kCut : CellState::kClear;
      }
    }
    ++refined_;
    if (at_boundary) ++refined_at_boundary_;
    block_.Touch();
    if (options_.level != Options::kAllLevels || id.level() + 1 >= options_.depth) return;
    todo_.insert(todo_.end(), children.begin(), children.end());
  }

  void Tell(RefineMessage kind, const Label& label, Dart critical, Outbox& out) {
    if (routing_ == Routing::kBroadcast) {
      out.Broadcast({kind, label, {}});
    } else {
      out.Send(block_.critical(critical).peer, {kind, label, {}});
    }
  }

  // The dart with this label, or the first part of its edge if that is split by now; null if neither is here.
  Dart Resolve(Label label) const {
    while (true) {
      const Dart d = block_.Find(label);
      if (d != Lcc::null_handle || LabelLevel(label) == kMaxLabelLevel) return d;
      label = ChildLabel(label, 0);
    }
  }

  absl::Status Handle(uint8_t kind, const Label& label, Outbox& out) {
    if (kind == kSplitFace) return HandleSplitFace(label, out);
    HandleSplitEdge(label, out);
    return absl::OkStatus();
  }

  void HandleSplitEdge(const Label& label, Outbox& out) {
    const Dart d = block_.Find(label);
    if (d == Lcc::null_handle) {
      if (Resolve(ChildLabel(label, 0)) == Lcc::null_handle) Keep(kSplitEdge, label);
      return;
    }
    for (const auto& split : subdivider_.SplitEdge(d)) {
      if (split.dart != d) Tell(kSplitEdge, split.label, split.dart, out);
    }
    block_.Touch();
  }

  absl::Status HandleSplitFace(const Label& label, Outbox& out) {
    const int l = LabelLevel(label);
    if (Resolve(ChildLabel(label, 2)) != Lcc::null_handle) return absl::OkStatus();
    const Dart d = Resolve(label);
    if (d == Lcc::null_handle) {
      Keep(kSplitFace, label);
      return absl::OkStatus();
    }
    // A label that ends in 2 is made together with the four faces of its level, and a fresh one with its
    // face, so this does not happen; if it did, splitting would corrupt the map.
    if (!F::FaceIsWhole(map_, d, l)) {
      return absl::InternalError(absl::StrCat("block ", block_.id().value, ": the face to split at label ",
                                              ToString(label), " does not have four vertices of level ", l,
                                              " or less"));
    }
    Dart corner = d;
    while (F::StartLevel(map_, corner) > l) corner = map_.template beta<1>(corner);
    Dart x = corner;
    do {
      // x leaves a corner; is its edge one dart still?
      const Dart next = map_.template beta<1>(x);
      if (F::StartLevel(map_, next) <= l) {
        for (const auto& split : subdivider_.SplitEdge(x)) {
          if (split.dart != x) Tell(kSplitEdge, split.label, split.dart, out);
        }
      }
      do {
        x = map_.template beta<1>(x);
      } while (F::StartLevel(map_, x) > l);
    } while (x != corner);
    subdivider_.SplitFace(corner, l);
    block_.Touch();
    return absl::OkStatus();
  }

  void Keep(uint8_t kind, const Label& label) {
    kept_[label].push_back(kind);
    ++kept_count_;
    ++ever_kept_;
  }

  // Tries again what waited for labels that were made meanwhile.
  absl::Status RetryKept(Outbox& out) {
    std::vector<Label>& made = subdivider_.made_labels();
    for (size_t i = 0; i < made.size() && kept_count_ > 0; ++i) {
      auto it = kept_.find(made[i]);
      if (it == kept_.end()) continue;
      const std::vector<uint8_t> kinds = std::move(it->second);
      kept_.erase(it);
      kept_count_ -= kinds.size();
      const Label label = made[i];
      for (uint8_t kind : kinds) {
        if (absl::Status status = Handle(kind, label, out); !status.ok()) return status;
      }
    }
    made.clear();
    return absl::OkStatus();
  }

  const Options options_;
  const Routing routing_;
  const std::unique_ptr<RefineOracle> oracle_;
  BlockT& block_;
  Lcc& map_;
  Subdivider<BlockT> subdivider_;
  PartialScan<typename Lcc::template Attribute_range<3>::type> cells_;
  PartialScan<const typename BlockT::Labels> labels_;
  bool cancelled_ = false;
  std::vector<Cell> todo_;
  // Roots held when the phase began; with broadcast routing, everything else is somebody else's.
  absl::flat_hash_set<uint64_t> roots_;
  absl::flat_hash_map<Label, std::vector<uint8_t>> kept_;
  size_t kept_count_ = 0;
  int64_t ever_kept_ = 0;
  int64_t refined_ = 0;
  int64_t refined_at_boundary_ = 0;
  int64_t tested_ = 0;
  int64_t listed_found_ = 0;
  bool stopped_by_memory_ = false;
};

}  // namespace ndmap

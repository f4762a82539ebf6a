// SPDX-License-Identifier: GPL-3.0-or-later
// Makes a block's part of a mesh from its piece: its own cells and nothing else. Labels follow from the
// cells' numbers in the whole mesh, so nobody is asked: of two cells that share a face the lower number is
// the positive side, and the root of each pair of darts is (0, 24 * that number + its dart's number in the
// cell).
//
// No parameters. Counts: cells, hexahedra, critical_darts.
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "core/algorithm/block_algorithm.h"
#include "core/algorithm/refine/label.h"
#include "core/map/block.h"
#include "core/map/link.h"
#include "core/names/mesh_cells.h"

namespace ndmap {

template <class BlockT>
class Load final : public BlockAlgorithm {
 public:
  using Lcc = typename BlockT::Lcc;
  using Dart = typename BlockT::Dart;

  static absl::StatusOr<std::unique_ptr<BlockAlgorithm>> Make(const Parameters&,
                                                              const Environment& environment, BlockT& block) {
    if (environment.initial == nullptr || environment.initial->mesh() == nullptr) {
      return absl::FailedPreconditionError(
          absl::StrCat("block ", environment.self.value, " has no piece of a mesh to make its cells from"));
    }
    return std::make_unique<Load>(environment.initial, environment.routing, block);
  }

  // `initial` is of a mesh.
  Load(std::shared_ptr<const InitialCells> initial, Routing routing, BlockT& block)
      : initial_(std::move(initial)),
        mesh_(initial_->mesh()),
        routing_(routing),
        block_(block),
        map_(block.map()) {}

  absl::StatusOr<bool> Start(size_t) override {
    if (map_.number_of_darts() != 0) {
      return absl::FailedPreconditionError(absl::StrCat("block ", block_.id().value, " is not empty"));
    }
    count_ = static_cast<uint32_t>(mesh_->piece().mesh.cells());
    return true;
  }

  absl::Status Receive(BlockId from, const Message&, Outbox&) override {
    return absl::InvalidArgumentError(
        absl::StrCat("load: a message from block ", from.value, ", expected none"));
  }

  absl::StatusOr<size_t> Work(size_t budget, Outbox&) override {
    size_t steps = 0;
    for (; steps < budget && HasWork(); ++steps) {
      if (next_ < count_) {
        if (mesh_->IsOwn(next_)) MakeCell(next_);
        // A cell of another block: its place alone.
        if (first_dart_.size() == next_) first_dart_.push_back(kNone);
        ++next_;
      } else {
        if (first_dart_[with_vertices_] != kNone) MakeVertices(with_vertices_);
        if (++with_vertices_ == count_) Forget();
      }
    }
    block_.Touch();
    return steps;
  }

  bool HasWork() const override { return !cancelled_ && with_vertices_ < count_; }
  // Half a mesh, without its vertices and with labels that no other block has, is no valid map; none is.
  void Cancel() override {
    cancelled_ = true;
    Forget();
    block_.Clear();
  }
  absl::StatusOr<bool> Finish(size_t) override { return true; }

  Report report() const override {
    Report report;
    if (cancelled_) report.counts["cancelled"] = 1;
    report.counts["cells"] = cancelled_ ? 0 : cells_;
    report.counts["hexahedra"] = cancelled_ ? 0 : hexahedra_;
    report.counts["critical_darts"] = static_cast<int64_t>(block_.critical_count());
    return report;
  }

 private:
  static constexpr uint32_t kNone = 0xffffffff;

  Dart DartOf(uint32_t cell, unsigned dart) const { return darts_[first_dart_[cell] + dart]; }

  void MakeCell(uint32_t cell) {
    const CellDarts& shape = mesh_->Shape(cell);
    const auto attribute = map_.template create_attribute<3>();
    first_dart_.push_back(static_cast<uint32_t>(darts_.size()));
    for (unsigned d = 0; d < shape.darts; ++d) {
      darts_.push_back(map_.create_dart());
      map_.template set_dart_attribute<3>(darts_.back(), attribute);
    }
    for (unsigned d = 0; d < shape.darts; ++d) {
      LinkBeta1(map_, DartOf(cell, d), DartOf(cell, shape.next[d]));
      map_.template basic_link_beta_for_involution<2>(DartOf(cell, d), DartOf(cell, shape.across[d]));
    }
    auto& info = map_.template info_of_attribute<3>(attribute);
    info.id = CellId::Initial(mesh_->piece().numbers[cell]);
    info.kind = mesh_->kind(cell);
    const bool hexahedron = info.kind == CellKind::kHexahedron;
    info.reference = DartOf(cell, hexahedron ? hexahedron::ReferenceRole(info.id) : 0);
    for (unsigned f = 0; f < shape.faces; ++f) LinkFace(cell, f);
    ++cells_;
    hexahedra_ += hexahedron ? 1 : 0;
  }

  void LinkFace(uint32_t cell, unsigned face) {
    const CellDarts& shape = mesh_->Shape(cell);
    const MeshCells::Side beyond = mesh_->Beyond(cell, face);
    if (beyond.cell == kNoCell) return;
    const bool own = mesh_->IsOwn(beyond.cell);
    if (own && beyond.cell >= next_) return;
    for (unsigned d = shape.begin[face]; d < shape.begin[face + 1]; ++d) {
      const unsigned opposite = mesh_->DartBeyond(cell, d, beyond);
      if (own) {
        map_.template basic_link_beta_for_involution<3>(DartOf(cell, d), DartOf(beyond.cell, opposite));
        continue;
      }
      const uint64_t number = mesh_->piece().numbers[cell];
      const uint64_t neighbour = mesh_->piece().numbers[beyond.cell];
      const bool positive = number < neighbour;
      const uint64_t root =
          positive ? number * CellDarts::kMostDarts + d : neighbour * CellDarts::kMostDarts + opposite;
      const BlockId peer{mesh_->piece().blocks[beyond.cell]};
      block_.SetCritical(DartOf(cell, d), {RootLabel(RangeRoot(0, root)),
                                           routing_ == Routing::kDirect ? peer : BlockId(), positive});
    }
  }

  // A vertex for each corner whose orbit in this block has none yet: cells that meet only along an edge or at
  // a corner have vertices of their own, as CGAL's 0-cells do.
  void MakeVertices(uint32_t cell) {
    const CellDarts& shape = mesh_->Shape(cell);
    for (unsigned d = 0; d < shape.darts; ++d) {
      const Dart dart = DartOf(cell, d);
      if (map_.template attribute<0>(dart) != Lcc::null_handle) continue;
      const Point3& p = mesh_->piece().mesh.points[mesh_->Point(cell, shape.start[d])];
      map_.template set_attribute<0>(
          dart, map_.template create_attribute<0>(typename Lcc::Point(p[0], p[1], p[2])));
    }
  }

  void Forget() {
    darts_ = {};
    first_dart_ = {};
  }

  const std::shared_ptr<const InitialCells> initial_;
  const MeshCells* const mesh_;
  const Routing routing_;
  BlockT& block_;
  Lcc& map_;
  bool cancelled_ = false;
  uint32_t count_ = 0;
  uint32_t next_ = 0;
  uint32_t with_vertices_ = 0;
  int64_t cells_ = 0;
  int64_t hexahedra_ = 0;
  // The darts of the cells that were made; by cell of the piece, its first.
  std::vector<Dart> darts_;
  std::vector<uint32_t> first_dart_;
};

}  // namespace ndmap

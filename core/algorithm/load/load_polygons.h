// SPDX-License-Identifier: GPL-3.0-or-later
// Makes a block's part of a surface of polygons from its piece: its own faces and nothing else, a dart for
// each side. Labels follow from the numbers of faces and corners in the whole surface, so nobody is asked: of
// two faces that share an edge the lower number is the positive side, and the root of the pair of darts is
// (0, number of the corner of the whole surface at which that face's side begins).
//
// No parameters. Counts: cells, faces (the same), critical_darts.
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "core/algorithm/block_algorithm.h"
#include "core/algorithm/refine/label.h"
#include "core/map/block.h"
#include "core/names/polygon_cells.h"

namespace ndmap {

template <class BlockT>
class LoadPolygons final : public BlockAlgorithm {
 public:
  using Lcc = typename BlockT::Lcc;
  using Dart = typename BlockT::Dart;
  static_assert(BlockT::n == 2);

  static absl::StatusOr<std::unique_ptr<BlockAlgorithm>> Make(const Parameters&,
                                                              const Environment& environment, BlockT& block) {
    if (environment.initial == nullptr || environment.initial->polygons() == nullptr) {
      return absl::FailedPreconditionError(absl::StrCat("block ", environment.self.value,
                                                        " has no piece of a surface to make its faces from"));
    }
    return std::make_unique<LoadPolygons>(environment.initial, environment.routing, block);
  }

  // `initial` is of a surface.
  LoadPolygons(std::shared_ptr<const InitialCells> initial, Routing routing, BlockT& block)
      : initial_(std::move(initial)),
        surface_(*initial_->polygons()),
        routing_(routing),
        block_(block),
        map_(block.map()) {}

  absl::StatusOr<bool> Start(size_t) override {
    if (map_.number_of_darts() != 0) {
      return absl::FailedPreconditionError(absl::StrCat("block ", block_.id().value, " is not empty"));
    }
    count_ = static_cast<uint32_t>(surface_.piece().mesh.faces());
    return true;
  }

  absl::Status Receive(BlockId from, const Message&, Outbox&) override {
    return absl::InvalidArgumentError(
        absl::StrCat("load: a message from block ", from.value, ", expected none"));
  }

  // A step is a dart, made or given its vertex, or a face of another block.
  absl::StatusOr<size_t> Work(size_t budget, Outbox&) override {
    size_t steps = 0;
    for (; steps < budget && HasWork(); ++steps) {
      if (next_ == count_) {
        MakeVertex();
      } else if (!surface_.IsOwn(next_)) {
        first_dart_.push_back(kNone);
        ++next_;
      } else {
        MakeDart();
      }
    }
    block_.Touch();
    return steps;
  }

  bool HasWork() const override { return !cancelled_ && !done_; }
  // Half a surface, without its vertices and with labels that no other block has, is no valid map; none is.
  void Cancel() override {
    cancelled_ = true;
    Forget();
    block_.Clear();
  }
  absl::StatusOr<bool> Finish(size_t) override { return true; }

  Report report() const override {
    Report report;
    if (cancelled_) report.counts["cancelled"] = 1;
    report.counts["cells"] = report.counts["faces"] = cancelled_ ? 0 : faces_;
    report.counts["critical_darts"] = static_cast<int64_t>(block_.critical_count());
    return report;
  }

 private:
  static constexpr uint32_t kNone = 0xffffffff;

  Dart DartOf(uint32_t face, uint32_t side) const { return darts_[first_dart_[face] + side]; }

  // The next dart of face next_.
  void MakeDart() {
    const uint32_t face = next_, side = side_;
    if (side == 0) {
      cell_ = map_.template create_attribute<2>();
      first_dart_.push_back(static_cast<uint32_t>(darts_.size()));
    }
    const Dart dart = map_.create_dart();
    darts_.push_back(dart);
    map_.template set_dart_attribute<2>(dart, cell_);
    if (side > 0) map_.basic_link_beta_1(DartOf(face, side - 1), dart);
    LinkSide(face, side);
    if (++side_ < surface_.CornerCount(face)) return;
    map_.basic_link_beta_1(dart, DartOf(face, 0));
    auto& info = map_.template info_of_attribute<2>(cell_);
    info.id = CellId::Polygon(surface_.piece().numbers[face]);
    info.kind = CellKind::kPolygon;
    info.reference = DartOf(face, 0);
    ++faces_;
    ++next_;
    side_ = 0;
  }

  void LinkSide(uint32_t face, uint32_t side) {
    const SideLink& beyond = surface_.Beyond(face, side);
    if (beyond.boundary()) return;
    const Dart dart = DartOf(face, side);
    if (surface_.IsOwn(beyond.face)) {
      if (beyond.face < face) {
        map_.template basic_link_beta_for_involution<2>(dart, DartOf(beyond.face, beyond.side));
      }
      return;
    }
    const PolygonPiece& piece = surface_.piece();
    const bool positive = face < beyond.face;
    const uint64_t root =
        positive ? piece.corners_before[face] + side : piece.corners_before[beyond.face] + beyond.side;
    const BlockId peer{piece.blocks[beyond.face]};
    block_.SetCritical(
        dart, {RootLabel(RangeRoot(0, root)), routing_ == Routing::kDirect ? peer : BlockId(), positive});
  }

  // A vertex for the next dart if its orbit in this block has none yet: faces that meet only at a point have
  // vertices of their own, as CGAL's 0-cells do. O(darts around the vertex), once a vertex.
  void MakeVertex() {
    while (with_vertices_ < count_ && first_dart_[with_vertices_] == kNone) ++with_vertices_;
    if (with_vertices_ == count_) {
      done_ = true;
      Forget();
      return;
    }
    const Dart dart = DartOf(with_vertices_, side_);
    if (map_.template attribute<0>(dart) == Lcc::null_handle) {
      const Point3& p = surface_.PointAt(with_vertices_, side_);
      map_.template set_attribute<0>(
          dart, map_.template create_attribute<0>(typename Lcc::Point(p[0], p[1], p[2])));
    }
    if (++side_ < surface_.CornerCount(with_vertices_)) return;
    side_ = 0;
    ++with_vertices_;
  }

  void Forget() {
    darts_ = {};
    first_dart_ = {};
  }

  const std::shared_ptr<const InitialCells> initial_;
  const PolygonCells& surface_;
  const Routing routing_;
  BlockT& block_;
  Lcc& map_;
  bool cancelled_ = false;
  bool done_ = false;
  uint32_t count_ = 0;
  // The face and the side of it that come next: to be made, then to be given a vertex.
  uint32_t next_ = 0;
  uint32_t side_ = 0;
  uint32_t with_vertices_ = 0;
  typename BlockT::Types::Cell cell_{};
  int64_t faces_ = 0;
  // The darts of the faces that were made; by face of the piece, its first.
  std::vector<Dart> darts_;
  std::vector<uint32_t> first_dart_;
};

}  // namespace ndmap

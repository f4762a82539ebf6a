// SPDX-License-Identifier: GPL-3.0-or-later
// Makes a block's part of the initial grid: its own hexahedra and nothing else. Labels follow from global
// hexahedron numbers, so nobody is asked: of two cells that share a face the lower number is the positive
// side, and the root of each pair of darts is (0, 24 * that number + its local dart number).
//
// Parameters: cells ("AxBxC"), lo, hi ("x,y,z"), assignment (Assignment::Encode()); corners: instead of lo
// and hi, all (A+1)(B+1)(C+1) corner points "x,y,z", x fastest, separated by spaces, for small distorted
// grids. Counts: hexahedra, critical_darts.
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "core/algorithm/block_algorithm.h"
#include "core/algorithm/build/assignment.h"
#include "core/algorithm/refine/frame.h"
#include "core/algorithm/refine/label.h"
#include "core/map/block.h"
#include "core/map/link.h"

namespace ndmap {

// "AxBxC", each at least 1 and their product below 2^32.
absl::StatusOr<std::array<uint32_t, 3>> ParseCells(absl::string_view text);

// Where corner (i, j, k) of a grid is.
using CornerFunction = std::function<Point3(uint32_t, uint32_t, uint32_t)>;

struct GridPlan {
  std::array<uint32_t, 3> cells{};
  CornerFunction corner;
  Assignment assignment;
};

// The grid and the assignment from parameters; INVALID_ARGUMENT names what is wrong.
absl::StatusOr<GridPlan> ParseGridParameters(const Parameters& parameters, uint32_t block_count);

// The parameters of `build` for this grid and assignment.
Parameters GridParameters(const GridShape& grid, const Assignment& assignment);

template <class BlockT>
class Build final : public BlockAlgorithm {
 public:
  using Lcc = typename BlockT::Lcc;
  using Dart = typename BlockT::Dart;

  static absl::StatusOr<std::unique_ptr<BlockAlgorithm>> Make(const Parameters& parameters,
                                                              const Environment& environment, BlockT& block) {
    auto parsed = ParseGridParameters(parameters, environment.block_count);
    if (!parsed.ok()) return parsed.status();
    return std::make_unique<Build>(parsed->cells, std::move(parsed->corner), std::move(parsed->assignment),
                                   environment.routing, block);
  }

  Build(std::array<uint32_t, 3> cells, CornerFunction corner, Assignment assignment, Routing routing,
        BlockT& block)
      : cells_(cells),
        corner_(std::move(corner)),
        assignment_(std::move(assignment)),
        routing_(routing),
        block_(block),
        map_(block.map()) {}

  absl::StatusOr<bool> Start(size_t) override {
    if (map_.number_of_darts() != 0) {
      return absl::FailedPreconditionError(absl::StrCat("block ", block_.id().value, " is not empty"));
    }
    for (size_t r = 0; r < assignment_.run_count(); ++r) {
      if (assignment_.run_block(r) == block_.id()) runs_.push_back(r);
    }
    if (!runs_.empty()) next_ = assignment_.run_begin(runs_[0]);
    return true;
  }

  absl::Status Receive(BlockId from, const Message& message, Outbox&) override {
    return absl::InvalidArgumentError(
        absl::StrCat("build: a message from block ", from.value, ", expected none"));
  }

  absl::StatusOr<size_t> Work(size_t budget, Outbox&) override {
    size_t steps = 0;
    for (; steps < budget && HasWork(); ++steps) {
      if (run_ < runs_.size()) {
        MakeHexahedron(next_++);
        if (next_ == assignment_.run_end(runs_[run_]) && ++run_ < runs_.size()) {
          next_ = assignment_.run_begin(runs_[run_]);
        }
      } else {
        MakeVertices(made_[with_vertices_++]);
        if (with_vertices_ == made_.size()) first_darts_.clear();
      }
    }
    block_.Touch();
    return steps;
  }

  bool HasWork() const override {
    return !cancelled_ && (run_ < runs_.size() || with_vertices_ < made_.size());
  }
  // Half a grid, without its vertices and with labels that no other block has, is no valid map; none is.
  void Cancel() override {
    cancelled_ = true;
    made_.clear();
    first_darts_.clear();
    block_.Clear();
  }
  absl::StatusOr<bool> Finish(size_t) override { return true; }

  Report report() const override {
    Report report;
    if (cancelled_) report.counts["cancelled"] = 1;
    report.counts["hexahedra"] = static_cast<int64_t>(made_.size());
    report.counts["critical_darts"] = static_cast<int64_t>(block_.critical_count());
    return report;
  }

 private:
  struct Hexahedron {
    uint64_t number;
    std::array<Dart, hexahedron::kRoles> darts;
  };

  std::array<uint32_t, 3> At(uint64_t number) const {
    return {static_cast<uint32_t>(number % cells_[0]), static_cast<uint32_t>(number / cells_[0] % cells_[1]),
            static_cast<uint32_t>(number / cells_[0] / cells_[1])};
  }

  // The number of the cell beyond a face; false at the border of the grid.
  bool Neighbour(uint64_t number, unsigned face, uint64_t* neighbour) const {
    const unsigned axis = face < 2 ? 2 : face < 4 ? 1 : 0;
    const bool up = face % 2 == 1;
    const uint64_t stride = axis == 0 ? 1 : axis == 1 ? cells_[0] : uint64_t{cells_[0]} * cells_[1];
    const uint32_t x = At(number)[axis];
    if (up ? x + 1 == cells_[axis] : x == 0) return false;
    *neighbour = up ? number + stride : number - stride;
    return true;
  }

  void MakeHexahedron(uint64_t number) {
    const auto cell = map_.template create_attribute<3>();
    Hexahedron hex{number, {}};
    for (Dart& d : hex.darts) {
      d = map_.create_dart();
      map_.template set_dart_attribute<3>(d, cell);
    }
    for (unsigned role = 0; role < hexahedron::kRoles; ++role) {
      LinkBeta1(map_, hex.darts[role], hex.darts[hexahedron::NextRole(role)]);
      map_.template basic_link_beta_for_involution<2>(hex.darts[role], hex.darts[hexahedron::kAcross[role]]);
    }
    auto& info = map_.template info_of_attribute<3>(cell);
    info.id = CellId::Initial(number);
    info.reference = hex.darts[hexahedron::ReferenceRole(info.id)];
    for (unsigned face = 0; face < hexahedron::kFaces; ++face) {
      uint64_t neighbour;
      if (Neighbour(number, face, &neighbour)) LinkFace(hex, face, neighbour);
    }
    first_darts_.emplace(number, made_.size());
    made_.push_back(hex);
  }

  void LinkFace(const Hexahedron& hex, unsigned face, uint64_t neighbour) {
    const BlockId owner = assignment_.BlockOf(neighbour);
    const bool positive = hex.number < neighbour;
    const auto made = first_darts_.find(neighbour);
    for (unsigned k = 0; k < 4; ++k) {
      const unsigned role = hexahedron::Role(face, k);
      const unsigned opposite = hexahedron::kOpposite[role];
      if (owner != block_.id()) {
        const uint64_t root =
            positive ? hex.number * hexahedron::kRoles + role : neighbour * hexahedron::kRoles + opposite;
        block_.SetCritical(hex.darts[role], {RootLabel(RangeRoot(0, root)),
                                             routing_ == Routing::kDirect ? owner : BlockId(), positive});
      } else if (made != first_darts_.end()) {
        map_.template basic_link_beta_for_involution<3>(hex.darts[role], made_[made->second].darts[opposite]);
      }
    }
  }

  // A vertex for each corner whose orbit in this block has none yet: cells that meet only along an edge or at
  // a corner have vertices of their own, as CGAL's 0-cells do.
  void MakeVertices(const Hexahedron& hex) {
    const std::array<uint32_t, 3> at = At(hex.number);
    for (unsigned c = 0; c < 8; ++c) {
      const Dart d = hex.darts[hexahedron::kCornerRole[c]];
      if (map_.template attribute<0>(d) != Lcc::null_handle) continue;
      const Point3 p = corner_(at[0] + (c & 1), at[1] + (c >> 1 & 1), at[2] + (c >> 2));
      map_.template set_attribute<0>(
          d, map_.template create_attribute<0>(typename Lcc::Point(p[0], p[1], p[2])));
    }
  }

  const std::array<uint32_t, 3> cells_;
  const CornerFunction corner_;
  const Assignment assignment_;
  const Routing routing_;
  BlockT& block_;
  Lcc& map_;
  bool cancelled_ = false;
  std::vector<size_t> runs_;
  size_t run_ = 0;
  uint64_t next_ = 0;
  std::vector<Hexahedron> made_;
  size_t with_vertices_ = 0;
  absl::flat_hash_map<uint64_t, size_t> first_darts_;
};

}  // namespace ndmap

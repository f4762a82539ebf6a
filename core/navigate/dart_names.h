// SPDX-License-Identifier: GPL-3.0-or-later
// The ids of the cells of given darts.
#pragma once

#include <array>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/types/span.h"
#include "core/map/block.h"
#include "core/names/hexahedron_lattice.h"
#include "core/names/name_of.h"

namespace ndmap {

// By dimension: of a dart's vertex, edge, face and hexahedron.
using DartIds = std::array<CellId, 4>;

// Names darts hexahedron by hexahedron: those of one hexahedron cost O(its darts) together.
class DartNamer {
 public:
  // The darts must stay where they are.
  DartNamer(const InitialCells& initial, absl::Span<const DartIndex> darts)
      : initial_(initial), darts_(darts), ids_(darts.size()) {}

  // Up to `budget` darts; true when all are named. NOT_FOUND: no dart with this index.
  absl::StatusOr<bool> Step(Block3& block, size_t budget) {
    auto& map = block.map();
    if (lattice_ == nullptr) lattice_ = std::make_unique<HexahedronLattice<Block3>>(map);
    for (size_t k = 0; k < budget && next_ < darts_.size(); ++k, ++next_) {
      const auto d = DartAt(map, darts_[next_]);
      if (d == Block3::Lcc::null_handle) {
        return absl::NotFoundError(
            absl::StrCat("block ", block.id().value, " has no dart ", darts_[next_].value));
      }
      if (!known_.contains(darts_[next_])) Learn(map, map.attribute<3>(d));
      ids_[next_] = known_.at(darts_[next_]);
    }
    return next_ == darts_.size();
  }

  const std::vector<DartIds>& ids() const { return ids_; }

 private:
  void Learn(Block3::Lcc& map, Block3::Types::Cell cell) {
    // Darts of one hexahedron mostly come together; more than some hexahedra are not kept.
    if (known_.size() > 4096) known_.clear();
    const CellId hexahedron = map.info_of_attribute<3>(cell).id;
    for (const auto& placed : lattice_->Of(cell)) {
      known_[IndexOf(map, placed.dart)] = {NameOf(initial_, placed.vertex), NameOf(initial_, placed.edge),
                                           NameOf(initial_, placed.face), hexahedron};
    }
  }

  const InitialCells& initial_;
  const absl::Span<const DartIndex> darts_;
  std::vector<DartIds> ids_;
  size_t next_ = 0;
  std::unique_ptr<HexahedronLattice<Block3>> lattice_;
  absl::flat_hash_map<DartIndex, DartIds> known_;
};

}  // namespace ndmap

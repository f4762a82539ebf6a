// SPDX-License-Identifier: GPL-3.0-or-later
// From sets of darts to the cells that they are in.
#pragma once

#include <map>
#include <vector>

#include "absl/status/statusor.h"
#include "core/map/block.h"
#include "core/map/ids.h"
#include "core/navigate/dart_set.h"
#include "server/remote_blocks.h"

namespace ndmap::server {

// The word for a hexahedron's state.
const char* StateName(CellState state);

// The cells of a dimension that have a dart in the set: by id, one dart of each.
using CellDarts = std::map<CellId, std::pair<BlockId, DartIndex>>;
// Versions that are 0 in the set become those that were met.
absl::StatusOr<CellDarts> CellsOf(RemoteBlocks& blocks, DartSet& set, unsigned dimension);

// The details of cells of one dimension, in their order. Closes over the dimension once more, so that they
// speak of whole cells. `versions` are those that the cells were found at.
absl::StatusOr<std::vector<v1::CellDetails>> DetailsOf(RemoteBlocks& blocks, const CellDarts& cells,
                                                       const DartSet& versions, unsigned dimension);

}  // namespace ndmap::server

// SPDX-License-Identifier: GPL-3.0-or-later
// Which block has which cell of a mesh, or face of a surface.
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/mesh/polygon_mesh.h"
#include "core/mesh/volume_mesh.h"

namespace ndmap {

// The block of each cell. The partitions, by name: hilbert, morton (pieces of the curve through the cells'
// centres, of equal numbers of cells), metis (METIS k-way on the dual graph: few faces between blocks). No
// block is empty. INVALID_ARGUMENT for other names, for 0 blocks, for more blocks than cells. O(cells log
// cells).
absl::StatusOr<std::vector<uint32_t>> AssignMesh(const GluedMesh& mesh, uint32_t blocks,
                                                 absl::string_view partition);
absl::StatusOr<std::vector<uint32_t>> AssignMesh(const GluedPolygons& surface, uint32_t blocks,
                                                 absl::string_view partition);

}  // namespace ndmap

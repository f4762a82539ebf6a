// SPDX-License-Identifier: GPL-3.0-or-later
// Values of cells from VTU files that began as exports.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "client/sdk/attributes.h"
#include "ndmap/v1/coordinator.pb.h"

namespace ndmap::cli {

// Cells, and a value for each.
struct ValuesByCell {
  CellIds cells;
  AttributeColumn values;
};

// The array `name` of points (attributes of vertices) or cells (of hexahedra) in a .vtu file, or in the
// pieces of a .pvtu file, each cell once. Cells are known by the numbers that an export gives them ("id", of
// cells also "level"), which belong to the map's grid or mesh. INVALID_ARGUMENT in one sentence that begins
// with the file.
absl::StatusOr<ValuesByCell> ValuesFromVtu(const std::string& path, const v1::Map& map,
                                           const v1::Attribute& attribute, const std::string& name);

}  // namespace ndmap::cli

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "absl/status/statusor.h"
#include "core/geometry/grid_shape.h"
#include "ndmap/v1/common.pb.h"

namespace ndmap::service {

// A grid from the wire. INVALID_ARGUMENT unless it has 1 to 2^26 cells in a box that is finite and not flat.
absl::StatusOr<GridShape> GridFromWire(const v1::Grid& grid);

}  // namespace ndmap::service

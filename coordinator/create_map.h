// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <utility>

#include "absl/status/statusor.h"
#include "core/geometry/surface.h"
#include "ndmap/v1/coordinator.pb.h"

namespace ndmap::coordinator {

// What a request to create a map asks for: the map, not placed yet, and the phase that builds it.
// INVALID_ARGUMENT says what is wrong. `surface` may be null. O(cells + triangles).
absl::StatusOr<std::pair<v1::Map, v1::Phase>> PlanMap(const v1::CreateMapRequest& request,
                                                      const TriangleSurface* surface);

}  // namespace ndmap::coordinator

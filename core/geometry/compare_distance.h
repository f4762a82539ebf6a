// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "core/geometry/surface.h"

namespace ndmap {

// Which of a and b is nearer to the point: below 0 a, above 0 b, 0 neither. Exact for all finite points,
// however far or near they are.
int CompareDistance(const Point3& point, const Point3& a, const Point3& b);

}  // namespace ndmap

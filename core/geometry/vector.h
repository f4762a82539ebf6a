// SPDX-License-Identifier: GPL-3.0-or-later
// Points as vectors, in plain doubles: the same bits wherever they are computed.
#pragma once

#include "core/geometry/surface.h"

namespace ndmap {

inline Point3 Minus(const Point3& a, const Point3& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }

inline double Determinant(const Point3& a, const Point3& b, const Point3& c) {
  return a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) +
         a[2] * (b[0] * c[1] - b[1] * c[0]);
}

}  // namespace ndmap

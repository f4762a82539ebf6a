// SPDX-License-Identifier: GPL-3.0-or-later
// New points, computed from corner points only and in an order that does not depend on which side computes:
// both sides of a cut, and the single-map reference, get the same bits.
#pragma once

#include <algorithm>
#include <array>

#include "core/geometry/surface.h"

namespace ndmap {

inline Point3 Midpoint(const Point3& a, const Point3& b) {
  return {(a[0] + b[0]) / 2, (a[1] + b[1]) / 2, (a[2] + b[2]) / 2};
}

// Corners in cyclic order: the midpoints of the two diagonals, added and halved.
inline Point3 FaceCentre(const std::array<Point3, 4>& corners) {
  return Midpoint(Midpoint(corners[0], corners[2]), Midpoint(corners[1], corners[3]));
}

// Corners in any order: the eight values of each coordinate sorted, added, divided by 8.
inline Point3 VolumeCentre(const std::array<Point3, 8>& corners) {
  Point3 centre{};
  for (int c = 0; c < 3; ++c) {
    std::array<double, 8> values;
    for (int i = 0; i < 8; ++i) values[i] = corners[i][c];
    std::sort(values.begin(), values.end());
    double sum = values[0];
    for (int i = 1; i < 8; ++i) sum += values[i];
    centre[c] = sum / 8;
  }
  return centre;
}

}  // namespace ndmap

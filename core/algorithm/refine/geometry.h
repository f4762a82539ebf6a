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

// Corners by corner number (x + 2y + 4z, from any corner): for each coordinate the midpoints of the four
// diagonals, sorted, and halved twice. On a box all four are the midpoint of its two sides, to the bit, so
// the hexahedra of a grid stay boxes at every level; a sum of all eight values rounds otherwise.
inline Point3 VolumeCentre(const std::array<Point3, 8>& corners) {
  Point3 centre{};
  for (int c = 0; c < 3; ++c) {
    std::array<double, 4> values;
    for (int i = 0; i < 4; ++i) values[i] = (corners[i][c] + corners[7 - i][c]) / 2;
    std::sort(values.begin(), values.end());
    centre[c] = ((values[0] + values[1]) / 2 + (values[2] + values[3]) / 2) / 2;
  }
  return centre;
}

}  // namespace ndmap

// SPDX-License-Identifier: GPL-3.0-or-later
// A closed surface as the jobs use it: triangles over shared points, already checked
// (core/io/surface_reader.h).
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "absl/status/status.h"

namespace ndmap {

using Point3 = std::array<double, 3>;

struct Box3 {
  Point3 lo{};
  Point3 hi{};
  friend bool operator==(const Box3&, const Box3&) = default;
};

struct TriangleSurface {
  std::vector<Point3> points;
  std::vector<std::array<uint32_t, 3>> triangles;
};

// The bounding box of all points; {} of an empty surface. O(points).
Box3 BoundingBox(const TriangleSurface& surface);

// What every user of a surface may rely on: at least one triangle, indices in range, coordinates finite, no
// triangle with a repeated corner, every edge with exactly two triangles that run it in opposite directions.
// A service calls this on whatever came over the wire. O(triangles).
absl::Status ValidateClosedSurface(const TriangleSurface& surface);

}  // namespace ndmap

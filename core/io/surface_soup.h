// SPDX-License-Identifier: GPL-3.0-or-later
// From a soup of polygons to a closed, oriented surface of triangles, or the reason why not.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/io/surface_reader.h"

namespace ndmap::internal {

struct PolygonSoup {
  std::vector<Point3> points;
  std::vector<std::vector<uint32_t>> polygons;
};

// The points and polygons of a file's content as they are there; in STL, which has no shared points, equal
// points are one. INVALID_ARGUMENT with the line or element; CGAL's exceptions pass.
absl::StatusOr<PolygonSoup> ReadPolygonSoup(absl::string_view bytes, SurfaceFormat format);

// Merges equal points, drops faces with fewer than three corners left and points without faces, triangulates
// the rest, checks that every edge has two triangles, and orients the triangles. O(n log n) for n triangles.
absl::StatusOr<SurfaceFile> SurfaceFromSoup(PolygonSoup soup, const ReadLimits& limits);

// What each edge of a triangle leads to: entry 3 t + c is the triangle across the edge from corner c of
// triangle t to corner c + 1. INVALID_ARGUMENT, with the number of such edges and of border cycles, unless
// every edge has exactly two triangles.
absl::StatusOr<std::vector<uint32_t>> Neighbours(const TriangleSurface& surface);

// The component of each triangle (joined by edges), numbered from 0 by first triangle; and their number.
std::vector<uint32_t> Components(const std::vector<uint32_t>& neighbours, uint32_t* count);

// Orients the triangles of each component alike, and outward. Returns how many triangles were turned;
// INVALID_ARGUMENT if the surface is not orientable.
absl::StatusOr<size_t> Orient(const std::vector<uint32_t>& neighbours, TriangleSurface* surface);

// Cuts every polygon into triangles, concave ones too; adds the number that had more than three corners to
// *cut. INVALID_ARGUMENT for a polygon that crosses itself.
absl::StatusOr<std::vector<std::array<uint32_t, 3>>> Triangulate(const PolygonSoup& soup, size_t* cut);

// Pairs of triangles that meet elsewhere than in a common corner or edge, at most `most` of them. Triangles
// without area are passed over.
size_t CountSelfIntersections(const TriangleSurface& surface, size_t most);

}  // namespace ndmap::internal

// SPDX-License-Identifier: GPL-3.0-or-later
// A surface of polygons over shared points, with or without a boundary, and the same with its faces glued
// side to side: what a surface file becomes (core/io/polygon_reader.h) before it becomes a map of two
// dimensions.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/types/span.h"
#include "core/mesh/volume_mesh.h"

namespace ndmap {

// corners[begins[f]] ... corners[begins[f + 1] - 1] are the points of face f, in cyclic order. In `source`,
// cells are faces. At most 2^32 - 2 points and as many corners.
struct PolygonMesh {
  std::vector<Point3> points;
  std::vector<uint32_t> corners;
  std::vector<uint64_t> begins = {0};
  MeshSource source;

  uint64_t faces() const { return begins.size() - 1; }
  absl::Span<const uint32_t> Corners(uint64_t face) const {
    return absl::MakeConstSpan(corners).subspan(begins[face], begins[face + 1] - begins[face]);
  }
  void AddFace(absl::Span<const uint32_t> face_points);
};

// What lies beyond side i of a face, which runs from corner i to the next: side `side` of `face`, which runs
// the other way. A dart for each side: this is beta 2.
struct SideLink {
  uint32_t face = kNoCell;
  uint32_t side = 0;
  bool boundary() const { return face == kNoCell; }
  friend bool operator==(const SideLink&, const SideLink&) = default;
};

struct GluedPolygons {
  PolygonMesh mesh;             // Every point is used; source.points names them as the file did.
  std::vector<SideLink> links;  // One for each corner: of the side that begins there.
  uint64_t boundary_edges = 0;
  std::vector<std::string> notes, warnings;

  const SideLink& Link(uint64_t face, uint64_t side) const { return links[mesh.begins[face] + side]; }
};

// Glues faces by the identity of their points: an edge that two faces run in opposite directions is glued,
// one with a single face is boundary. Faces that meet in a vertex only are allowed: a map holds that vertex
// once for each fan of glued faces. `options.allow_concave` has no meaning here.
//
// INVALID_ARGUMENT, one sentence that names the file, the first few faces and how many there are: arrays that
// do not fit together, no faces, fewer than three corners, an index out of range, a coordinate that is not
// finite, a corner repeated in a face, an edge of more than two faces, an edge that two faces run in the same
// direction. O(n log n) for n corners.
absl::StatusOr<GluedPolygons> GluePolygons(PolygonMesh mesh, const GlueOptions& options = {});

struct PolygonFacts {
  std::array<uint64_t, 3> faces{};                   // Triangles, quadrilaterals, larger ones.
  uint64_t points = 0, edges = 0;                    // By the identity of points.
  uint64_t components = 0;                           // Of faces that are glued.
  int64_t euler = 0;                                 // points - edges + faces.
  uint64_t boundary_edges = 0, boundary_cycles = 0;  // Cycles as a map closes them.
  uint64_t split_points = 0;  // How many more vertices a map has: where faces meet in a vertex only.
  Box3 box;
  double area = 0;
};

// O(corners).
PolygonFacts Describe(const GluedPolygons& glued);

}  // namespace ndmap

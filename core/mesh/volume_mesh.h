// SPDX-License-Identifier: GPL-3.0-or-later
// A volume mesh of tetrahedra, pyramids, prisms and hexahedra over shared points, and the same mesh with its
// cells glued face to face: what a file becomes (core/io/mesh_reader.h) before it becomes a map.
//
// One rule holds for all kinds: the first face, the base, is listed so that by the right-hand rule its normal
// points into the cell, and the corners above the base follow in the same turn. A cell whose corners stand as
// in the pictures below has a positive volume, and all its faces by the tables point outward. So two cells
// share a face if and only if they list the same cycle of points in opposite directions.
//
//   tetrahedron   0 1 2 the base, 3 the apex                           as VTK, Gmsh, Medit
//   pyramid       0 1 2 3 the base, 4 the apex                         as VTK, Gmsh, Medit
//   prism         0 1 2 the base; 3 above 0, 4 above 1, 5 above 2      as Gmsh and Medit; VTK's wedge has its
//                                                                      two triangles the other way round
//   hexahedron    0 1 2 3 the base; 4 above 0, 5 above 1, and so on    as VTK, Gmsh, Medit
//
// Example: points (0,0,0), (1,0,0), (0,1,0), (0,0,1) in this order are a tetrahedron.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/types/span.h"
#include "core/geometry/surface.h"

namespace ndmap {

// kPolygon: a face of a surface, the n-cell of a map of dimension 2; it has no CellShape.
enum class CellKind : uint8_t { kTetrahedron, kPyramid, kPrism, kHexahedron, kPolygon };

// Of volumes.
inline constexpr int kCellKinds = 4;
inline constexpr int kMostCellCorners = 8;
inline constexpr int kMostCellFaces = 6;
inline constexpr int kMostFaceCorners = 4;
// Stands where a list of points is shorter than there is room for; larger than the index of any point.
inline constexpr uint32_t kNoPoint = 0xffffffff;

// A dart of a cell that stands alone: it runs from corner `corner` of the cycle of face `face` to the next.
struct LocalDart {
  uint8_t face = 0;
  uint8_t corner = 0;
  friend constexpr bool operator==(const LocalDart&, const LocalDart&) = default;
};

struct CellShape {
  absl::string_view name, plural;
  uint8_t corners;
  uint8_t faces;
  std::array<uint8_t, kMostCellFaces> face_corners;  // How many corners each face has: 3 or 4.
  // The corners of each face as a cycle; seen from outside the cell it runs counter-clockwise.
  std::array<std::array<uint8_t, kMostFaceCorners>, kMostCellFaces> face;

  // The cell's dart that runs along the same edge the other way, in the other face: beta 2. O(1), at most 24
  // comparisons.
  constexpr LocalDart Opposite(LocalDart d) const {
    const uint8_t from = face[d.face][d.corner];
    const uint8_t to = face[d.face][(d.corner + 1) % face_corners[d.face]];
    for (uint8_t f = 0; f < faces; ++f) {
      for (uint8_t i = 0; i < face_corners[f]; ++i) {
        if (face[f][i] == to && face[f][(i + 1) % face_corners[f]] == from) return {f, i};
      }
    }
    return d;  // Never: each shape below is a closed surface.
  }
};

inline constexpr std::array<CellShape, kCellKinds> kCellShapes = {{
    {"tetrahedron", "tetrahedra", 4, 4, {3, 3, 3, 3}, {{{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}}}},
    {"pyramid",
     "pyramids",
     5,
     5,
     {4, 3, 3, 3, 3},
     {{{0, 3, 2, 1}, {0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}}}},
    {"prism",
     "prisms",
     6,
     5,
     {3, 3, 4, 4, 4},
     {{{0, 2, 1}, {3, 4, 5}, {0, 1, 4, 3}, {1, 2, 5, 4}, {2, 0, 3, 5}}}},
    {"hexahedron",
     "hexahedra",
     8,
     6,
     {4, 4, 4, 4, 4, 4},
     {{{0, 3, 2, 1}, {4, 5, 6, 7}, {0, 1, 5, 4}, {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}}}},
}};

constexpr const CellShape& ShapeOf(CellKind kind) { return kCellShapes[static_cast<size_t>(kind)]; }

// How a file names its cells and points, so that an error speaks of them as the file does.
struct MeshSource {
  std::string file;       // Path; empty if the mesh came from elsewhere.
  std::string numbering;  // How the numbers count: "counted from 0", "by the file's element numbers".
  std::vector<uint64_t> cells, points;  // The number of each; empty: its index and the first number below.
  uint64_t first_cell = 0, first_point = 0;

  uint64_t Cell(uint64_t index) const { return cells.empty() ? index + first_cell : cells[index]; }
  uint64_t Point(uint32_t index) const { return points.empty() ? index + first_point : points[index]; }
};

// Cells over shared points: at most kMostCells, and 2^32 - 2 points and as many corners. `begins` has one
// entry a cell and one more: corners[begins[c]] ... corners[begins[c + 1] - 1] are the points of cell c, in
// the order given above.
struct VolumeMesh {
  std::vector<Point3> points;
  std::vector<CellKind> kinds;
  std::vector<uint32_t> corners;
  std::vector<uint64_t> begins = {0};
  MeshSource source;

  uint64_t cells() const { return kinds.size(); }
  // The points of a cell.
  absl::Span<const uint32_t> Corners(uint64_t cell) const {
    return absl::MakeConstSpan(corners).subspan(begins[cell], begins[cell + 1] - begins[cell]);
  }
  // Corner i of the cycle of one of the cell's faces, as a point.
  uint32_t FacePoint(uint64_t cell, int face, int i) const {
    return corners[begins[cell] + ShapeOf(kinds[cell]).face[face][i]];
  }
  // `points` has as many as the kind has corners.
  void AddCell(CellKind kind, absl::Span<const uint32_t> cell_points);
};

inline constexpr uint32_t kNoCell = 0xffffffff;
// So many that 32 bits can count the darts, 24 for each cell.
inline constexpr uint32_t kMostCells = 0xffffffff / (kMostCellFaces * kMostFaceCorners);

// What lies beyond a face. With f our cycle, g the neighbour's and k its length, f[i] is the same point as
// g[(turn + k - i) % k]; so our dart i (f[i] to f[i + 1]) is glued to the neighbour's dart
// (turn + 2 * k - i - 1) % k.
struct FaceLink {
  uint32_t cell = kNoCell;
  uint8_t face = 0;
  uint8_t turn = 0;  // At which corner of the neighbour's cycle our corner 0 stands.
  bool boundary() const { return cell == kNoCell; }
  friend bool operator==(const FaceLink&, const FaceLink&) = default;
};

struct GluedMesh {
  VolumeMesh mesh;              // Every point is used; source.points names them as the file did.
  std::vector<FaceLink> links;  // kMostCellFaces for each cell; those beyond its number of faces unused.
  uint64_t boundary_faces = 0;
  std::vector<std::string> notes;     // What was mended or left out: one sentence each.
  std::vector<std::string> warnings;  // What is odd but taken as it is: one sentence each.

  const FaceLink& Link(uint64_t cell, int face) const { return links[kMostCellFaces * cell + face]; }
};

struct GlueOptions {
  // Take a cell of positive volume with a corner at which its edges stand the wrong way round or in a plane
  // (refused otherwise): a warning then. Refining such a hexahedron can make inverted ones.
  bool allow_concave = false;
  // Make points of equal coordinates one; without it there is only a warning with their number.
  bool merge_equal_points = false;
};

// Glues cells by the identity of their points: a face listed by two cells in opposite directions is glued,
// one listed once is boundary. Cells that meet in a vertex or an edge only are allowed: a map holds that
// vertex or edge once for each fan of glued cells (a note says how many there are).
//
// INVALID_ARGUMENT, one sentence that names the file, what is wrong, the first few cells and how many there
// are in all: arrays that do not fit together, no cells, an index out of range, a coordinate that is not
// finite, a corner repeated in a cell, an inverted or flat cell, two cells with the same corners, a face of
// more than two cells, a face that two cells list in the same direction. Points that no cell uses go, with a
// note. Expected O(points + corners), memory too.
absl::StatusOr<GluedMesh> Glue(VolumeMesh mesh, const GlueOptions& options = {});

}  // namespace ndmap

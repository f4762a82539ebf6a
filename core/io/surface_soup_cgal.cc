// SPDX-License-Identifier: GPL-3.0-or-later
// The parts of surface_soup.h that CGAL's mesh processing does.
// Quiet about polygons that cross themselves: they are refused by what comes out (Triangulate).
#define CGAL_NO_CDT_2_WARNING
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Polygon_mesh_processing/shape_predicates.h>
#include <CGAL/Polygon_mesh_processing/triangulate_faces.h>
#include <CGAL/Surface_mesh.h>

#include <exception>
#include <iterator>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/io/surface_soup.h"

namespace ndmap::internal {
namespace {

namespace PMP = CGAL::Polygon_mesh_processing;
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;
using Triangles = std::vector<std::array<uint32_t, 3>>;

// One polygon as a mesh of its own: so it does not matter how faces fit together.
bool CutPolygon(const PolygonSoup& soup, const std::vector<uint32_t>& polygon, Triangles* triangles) {
  Mesh mesh;
  std::vector<Mesh::Vertex_index> corners;
  for (uint32_t corner : polygon) {
    const Point3& p = soup.points[corner];
    corners.push_back(mesh.add_vertex(Kernel::Point_3(p[0], p[1], p[2])));
  }
  const Mesh::Face_index face = mesh.add_face(corners);
  if (face == Mesh::null_face() || !PMP::triangulate_face(face, mesh)) return false;
  for (const Mesh::Face_index f : mesh.faces()) {
    std::array<uint32_t, 3> triangle{};
    int c = 0;
    for (const Mesh::Vertex_index v : mesh.vertices_around_face(mesh.halfedge(f))) {
      if (c == 3) return false;
      triangle[c++] = polygon[v.idx()];
    }
    triangles->push_back(triangle);
  }
  return true;
}

// All corners on one line: any triangulation will do, none has an area.
bool IsFlat(const PolygonSoup& soup, const std::vector<uint32_t>& polygon) {
  const auto point = [&](size_t i) {
    const Point3& p = soup.points[polygon[i]];
    return Kernel::Point_3(p[0], p[1], p[2]);
  };
  for (size_t i = 2; i < polygon.size(); ++i) {
    if (!CGAL::collinear(point(0), point(1), point(i))) return false;
  }
  return true;
}

}  // namespace

absl::StatusOr<Triangles> Triangulate(const PolygonSoup& soup, size_t* cut) {
  Triangles triangles;
  triangles.reserve(soup.polygons.size());
  for (size_t f = 0; f < soup.polygons.size(); ++f) {
    const std::vector<uint32_t>& polygon = soup.polygons[f];
    if (polygon.size() == 3) {
      triangles.push_back({polygon[0], polygon[1], polygon[2]});
      continue;
    }
    ++*cut;
    const size_t before = triangles.size();
    if (IsFlat(soup, polygon)) {
      for (size_t i = 2; i < polygon.size(); ++i)
        triangles.push_back({polygon[0], polygon[i - 1], polygon[i]});
      continue;
    }
    bool done = false;
    try {
      done = CutPolygon(soup, polygon, &triangles);
    } catch (const std::exception&) {
      done = false;
    }
    if (!done || triangles.size() != before + polygon.size() - 2) {
      return absl::InvalidArgumentError(absl::StrCat(
          "a face of ", polygon.size(), " corners that begins with points ", polygon[0], ", ", polygon[1],
          " and ", polygon[2], " crosses itself or is too far from plane to be cut into triangles"));
    }
  }
  return triangles;
}

size_t CountSelfIntersections(const TriangleSurface& surface, size_t most) {
  std::vector<Kernel::Point_3> points;
  points.reserve(surface.points.size());
  for (const Point3& p : surface.points) points.emplace_back(p[0], p[1], p[2]);
  Triangles triangles = surface.triangles;
  Mesh mesh;
  // Corners where two sheets touch are split: a mesh cannot hold them.
  if (!PMP::is_polygon_soup_a_polygon_mesh(triangles)) PMP::orient_polygon_soup(points, triangles);
  PMP::polygon_soup_to_polygon_mesh(points, triangles, mesh);
  std::vector<Mesh::Face_index> faces;
  for (const Mesh::Face_index f : mesh.faces()) {
    if (!PMP::is_degenerate_triangle_face(f, mesh)) faces.push_back(f);
  }
  std::vector<std::pair<Mesh::Face_index, Mesh::Face_index>> pairs;
  PMP::self_intersections(faces, mesh, std::back_inserter(pairs),
                          CGAL::parameters::maximum_number(static_cast<unsigned>(most)));
  return pairs.size();
}

}  // namespace ndmap::internal

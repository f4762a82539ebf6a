// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/mesh/mesh_facts.h"

#include <algorithm>
#include <utility>

#include "core/mesh/cell_geometry.h"
#include "core/mesh/classes.h"

namespace ndmap {
namespace {

using internal::Classes;

constexpr int kFaceDarts = kMostCellFaces * kMostFaceCorners;

// All darts with their cells: visit(cell, shape, face, corner).
template <class Visit>
void ForEachDart(const VolumeMesh& mesh, Visit visit) {
  for (uint64_t c = 0; c < mesh.cells(); ++c) {
    const CellShape& shape = ShapeOf(mesh.kinds[c]);
    for (uint8_t f = 0; f < shape.faces; ++f) {
      for (uint8_t i = 0; i < shape.face_corners[f]; ++i) visit(c, shape, f, i);
    }
  }
}

struct Edge {
  uint32_t a, b;
  friend auto operator<=>(const Edge&, const Edge&) = default;
};

Edge EdgeOf(const VolumeMesh& mesh, uint64_t cell, const CellShape& shape, int face, int corner) {
  const uint32_t a = mesh.FacePoint(cell, face, corner);
  const uint32_t b = mesh.FacePoint(cell, face, (corner + 1) % shape.face_corners[face]);
  return {std::min(a, b), std::max(a, b)};
}

uint64_t CountEdges(const VolumeMesh& mesh) {
  std::vector<Edge> edges;
  edges.reserve(2 * mesh.corners.size());
  ForEachDart(mesh, [&](uint64_t c, const CellShape& shape, int f, int i) {
    // Each edge of a cell is in two of its faces, in opposite directions.
    if (mesh.FacePoint(c, f, i) < mesh.FacePoint(c, f, (i + 1) % shape.face_corners[f])) {
      edges.push_back(EdgeOf(mesh, c, shape, f, i));
    }
  });
  std::sort(edges.begin(), edges.end());
  return static_cast<uint64_t>(std::unique(edges.begin(), edges.end()) - edges.begin());
}

// The vertices and edges that a map has: classes of corners and of darts under gluing.
std::pair<uint64_t, uint64_t> CountOrbits(const GluedMesh& glued) {
  const VolumeMesh& mesh = glued.mesh;
  Classes vertices(mesh.corners.size());
  // Edge e of a cell is called by the smaller of its two darts.
  Classes edges(kFaceDarts * mesh.cells());
  const auto dart = [](uint64_t c, int f, int i) { return kFaceDarts * c + kMostFaceCorners * f + i; };
  ForEachDart(mesh, [&](uint64_t c, const CellShape& shape, uint8_t f, uint8_t i) {
    const LocalDart other = shape.Opposite({f, i});
    edges.Join(dart(c, f, i), dart(c, other.face, other.corner));
    const FaceLink& link = glued.Link(c, f);
    if (link.boundary()) return;
    const int k = shape.face_corners[f];
    const CellShape& next = ShapeOf(mesh.kinds[link.cell]);
    vertices.Join(mesh.begins[c] + shape.face[f][i],
                  mesh.begins[link.cell] + next.face[link.face][(link.turn + k - i) % k]);
    edges.Join(dart(c, f, i), dart(link.cell, link.face, (link.turn + 2 * k - i - 1) % k));
  });
  std::pair<uint64_t, uint64_t> counts{0, 0};
  counts.first = vertices.Count();
  ForEachDart(mesh, [&](uint64_t c, const CellShape&, int f, int i) {
    counts.second += edges.IsRoot(dart(c, f, i));
  });
  return counts;
}

uint64_t CountComponents(const GluedMesh& glued) {
  Classes cells(glued.mesh.cells());
  for (uint64_t c = 0; c < glued.mesh.cells(); ++c) {
    for (int f = 0; f < ShapeOf(glued.mesh.kinds[c]).faces; ++f) {
      if (!glued.Link(c, f).boundary()) cells.Join(c, glued.Link(c, f).cell);
    }
  }
  return cells.Count();
}

void DescribeBoundary(const GluedMesh& glued, MeshFacts* facts) {
  struct Side {
    Edge edge;
    uint32_t face;
  };
  const VolumeMesh& mesh = glued.mesh;
  std::vector<Side> sides;
  std::vector<bool> on_boundary(mesh.points.size(), false);
  uint32_t face = 0;
  ForEachDart(mesh, [&](uint64_t c, const CellShape& shape, int f, int i) {
    if (!glued.Link(c, f).boundary()) return;
    on_boundary[mesh.FacePoint(c, f, i)] = true;
    sides.push_back({EdgeOf(mesh, c, shape, f, i), face});
    if (i + 1 == shape.face_corners[f]) ++face;
  });
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) { return a.edge < b.edge; });
  Classes pieces(face);
  for (size_t i = 0, end; i < sides.size(); i = end) {
    for (end = i + 1; end < sides.size() && sides[end].edge == sides[i].edge; ++end) {
      pieces.Join(sides[i].face, sides[end].face);
    }
    ++facts->boundary_edges;
    facts->crowded_boundary_edges += end - i > 2;
  }
  facts->boundary_components = pieces.Count();
  for (bool on : on_boundary) facts->boundary_points += on;
  facts->boundary_faces = face;
  facts->boundary_euler = static_cast<int64_t>(facts->boundary_points) -
                          static_cast<int64_t>(facts->boundary_edges) + static_cast<int64_t>(face);
}

}  // namespace

MeshFacts Describe(const GluedMesh& glued) {
  const VolumeMesh& mesh = glued.mesh;
  MeshFacts facts;
  facts.box = {mesh.points.at(0), mesh.points.at(0)};
  for (const Point3& p : mesh.points) {
    for (int x = 0; x < 3; ++x) {
      facts.box.lo[x] = std::min(facts.box.lo[x], p[x]);
      facts.box.hi[x] = std::max(facts.box.hi[x], p[x]);
    }
  }
  uint64_t sides = 0;
  for (uint64_t c = 0; c < mesh.cells(); ++c) {
    const CellCorners corners(mesh, c);
    ++facts.cells[static_cast<size_t>(mesh.kinds[c])];
    sides += ShapeOf(mesh.kinds[c]).faces;
    facts.volume += CellVolume(mesh.kinds[c], corners);
    const double worst = ScaledJacobians(mesh.kinds[c], corners).smallest;
    if (c > 0 && worst >= facts.worst_corner) continue;
    facts.worst_corner = worst;
    facts.worst_cell = c;
  }
  DescribeBoundary(glued, &facts);
  facts.points = mesh.points.size();
  facts.edges = CountEdges(mesh);
  facts.faces = (sides + facts.boundary_faces) / 2;
  facts.components = CountComponents(glued);
  facts.euler = static_cast<int64_t>(facts.points) - static_cast<int64_t>(facts.edges) +
                static_cast<int64_t>(facts.faces) - static_cast<int64_t>(mesh.cells());
  const auto [vertices, edges] = CountOrbits(glued);
  facts.split_points = vertices - facts.points;
  facts.split_edges = edges - facts.edges;
  return facts;
}

}  // namespace ndmap

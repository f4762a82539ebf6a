// SPDX-License-Identifier: GPL-3.0-or-later
// For tests: small volume meshes.
#pragma once

#include <initializer_list>
#include <vector>

#include "core/mesh/volume_mesh.h"

namespace ndmap {

inline std::vector<Point3> UnitCorners(CellKind kind) {
  switch (kind) {
    case CellKind::kTetrahedron:
      return {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    case CellKind::kPyramid:
      return {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}};
    case CellKind::kPrism:
      return {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {0, 1, 1}};
    case CellKind::kHexahedron:
      return {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
    case CellKind::kPolygon:
      break;
  }
  return {};
}

inline void AddTo(VolumeMesh* mesh, CellKind kind, std::initializer_list<uint32_t> corners) {
  mesh->AddCell(kind, std::vector<uint32_t>(corners));
}

inline VolumeMesh UnitMesh(CellKind kind) {
  VolumeMesh mesh;
  mesh.points = UnitCorners(kind);
  std::vector<uint32_t> corners;
  for (uint32_t i = 0; i < mesh.points.size(); ++i) corners.push_back(i);
  mesh.AddCell(kind, corners);
  return mesh;
}

// nx * ny * nz unit cubes, x fastest.
inline VolumeMesh CubeMesh(uint32_t nx, uint32_t ny, uint32_t nz) {
  VolumeMesh mesh;
  const auto at = [&](uint32_t i, uint32_t j, uint32_t k) { return (k * (ny + 1) + j) * (nx + 1) + i; };
  for (uint32_t k = 0; k <= nz; ++k) {
    for (uint32_t j = 0; j <= ny; ++j) {
      for (uint32_t i = 0; i <= nx; ++i) mesh.points.push_back({double(i), double(j), double(k)});
    }
  }
  for (uint32_t k = 0; k < nz; ++k) {
    for (uint32_t j = 0; j < ny; ++j) {
      for (uint32_t i = 0; i < nx; ++i) {
        AddTo(&mesh, CellKind::kHexahedron,
              {at(i, j, k), at(i + 1, j, k), at(i + 1, j + 1, k), at(i, j + 1, k), at(i, j, k + 1),
               at(i + 1, j, k + 1), at(i + 1, j + 1, k + 1), at(i, j + 1, k + 1)});
      }
    }
  }
  return mesh;
}

// A cube, a prism beside it, a pyramid on the cube and a tetrahedron that joins pyramid and prism: one of
// each kind, glued in a row of three and a fourth that closes the ring around the edge of points 5 and 6.
inline VolumeMesh OneOfEach() {
  VolumeMesh mesh;
  mesh.points = UnitCorners(CellKind::kHexahedron);
  mesh.points.push_back({2, 0, 0});      // 8
  mesh.points.push_back({2, 0, 1});      // 9
  mesh.points.push_back({0.9, 0.4, 2});  // 10
  AddTo(&mesh, CellKind::kHexahedron, {0, 1, 2, 3, 4, 5, 6, 7});
  AddTo(&mesh, CellKind::kPrism, {1, 8, 2, 5, 9, 6});
  AddTo(&mesh, CellKind::kPyramid, {4, 5, 6, 7, 10});
  AddTo(&mesh, CellKind::kTetrahedron, {5, 9, 6, 10});
  return mesh;
}

// The same with coordinates in quarters, which a float holds, too.
inline VolumeMesh AllKinds() {
  VolumeMesh mesh = OneOfEach();
  mesh.points[10] = {0.75, 0.5, 2.25};
  return mesh;
}

}  // namespace ndmap

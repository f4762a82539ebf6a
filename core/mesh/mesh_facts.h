// SPDX-License-Identifier: GPL-3.0-or-later
// What can be told of a glued mesh: sizes, topology, quality.
#pragma once

#include <array>
#include <cstdint>

#include "core/mesh/volume_mesh.h"

namespace ndmap {

struct MeshFacts {
  std::array<uint64_t, kCellKinds> cells{};  // By kind.
  uint64_t points = 0, edges = 0,
           faces = 0;       // By the identity of points: each once, however cells meet there.
  uint64_t components = 0;  // Of cells that are glued.
  int64_t euler = 0;        // points - edges + faces - cells.

  // The same of the faces that have one cell only.
  uint64_t boundary_points = 0, boundary_edges = 0, boundary_faces = 0;
  uint64_t boundary_components = 0;  // Of boundary faces joined at edges.
  int64_t boundary_euler = 0;
  uint64_t crowded_boundary_edges = 0;  // With more than two boundary faces.

  // How many more vertices and edges a map has than the mesh: where cells meet in a vertex or an edge and
  // are not glued around it.
  uint64_t split_points = 0, split_edges = 0;

  Box3 box;
  double volume = 0;
  // The smallest scaled corner Jacobian (core/mesh/cell_geometry.h), and the cell that has it.
  double worst_corner = 1;
  uint64_t worst_cell = 0;
};

// O(n log n) for n corners; about 100 bytes of memory a cell.
MeshFacts Describe(const GluedMesh& glued);

}  // namespace ndmap

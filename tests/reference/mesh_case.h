// SPDX-License-Identifier: GPL-3.0-or-later
// Random meshes of hexahedra, prisms, pyramids and tetrahedra, with their cut into blocks, what to refine and
// what to remove. Plain data; the same seed gives the same case on every platform.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/map/ids.h"
#include "core/mesh/volume_mesh.h"

namespace ndmap::reference {

struct MeshCase {
  static constexpr int kMaxLevel = 3;           // of any hexahedron
  static constexpr uint32_t kMaxLeaves = 1500;  // cells after refinement
  static constexpr uint32_t kMaxBlocks = 9;

  uint64_t seed = 0;
  std::string shape;
  // Glued conformingly, cells in random order with their corners turned at random.
  VolumeMesh mesh;
  uint32_t blocks = 1;
  // By cell; each block has at least one.
  std::vector<uint32_t> block_of;
  std::vector<CellId> refined;  // hexahedra, parents before children
  std::vector<CellId> removed;  // of the cells that are left then, ascending; often empty

  // The cells after refinement and before removal, ascending.
  std::vector<CellId> Leaves() const;
  // One line for a failing test.
  std::string Describe() const;
};

// A grid whose hexahedra are split at random into prisms, pyramids and tetrahedra; or, every fourth seed,
// hexahedra alone, three to six of them around each edge in the middle.
MeshCase MakeMeshCase(uint64_t seed);

// The mesh of `layers` layers of `around` hexahedra around an edge, in order.
VolumeMesh MakeWheel(uint32_t around, uint32_t layers);

}  // namespace ndmap::reference

// SPDX-License-Identifier: GPL-3.0-or-later
// Random cases for the central property: a distorted grid, its cut into blocks, what to refine and to remove.
// Plain data; the same seed gives the same case on every platform.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "core/geometry/surface.h"
#include "core/map/ids.h"

namespace ndmap::reference {

struct RandomCase {
  static constexpr int kMaxLevel = 4;           // of any hexahedron
  static constexpr uint32_t kMaxCells = 24;     // initial hexahedra
  static constexpr uint32_t kMaxLeaves = 3000;  // hexahedra after refinement
  static constexpr uint32_t kMaxBlocks = 9;

  uint64_t seed = 0;
  std::array<uint32_t, 3> grid{1, 1, 1};  // hexahedra per axis, 1 ... 4
  std::vector<Point3> corners;            // by i + (nx + 1) * (j + (ny + 1) * k)
  std::string geometry;                   // regular, distorted, or wild (anywhere, inside out too)
  uint32_t blocks = 1;
  std::vector<uint32_t> block_of;  // by initial number; a block may have none
  std::string partition;           // single, random, slabs, checkerboard, diagonal
  std::vector<CellId> refined;     // parents before children
  std::vector<CellId> removed;     // of the hexahedra that are left then, ascending; often empty

  uint32_t cells() const { return grid[0] * grid[1] * grid[2]; }
  const Point3& Corner(uint32_t i, uint32_t j, uint32_t k) const {
    return corners[i + (grid[0] + 1) * (j + (grid[1] + 1) * k)];
  }
  // The hexahedra after refinement and before removal, ascending. O(n log n).
  std::vector<CellId> Leaves() const;
  // One line for a failing test: seed and shape.
  std::string Describe() const;
};

RandomCase MakeRandomCase(uint64_t seed);

}  // namespace ndmap::reference

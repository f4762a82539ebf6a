// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/estimate.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "core/geometry/parity.h"
#include "core/geometry/surface_index.h"

namespace ndmap::cli {
namespace {

// Measured with release builds on bumpy-torus, knot2, cow and armadillo, 286,000 to 783,000 hexahedra made by
// 2 block servers: 915 to 957 bytes and 9.8 to 12.1 microseconds each, all phases but the export; 27 bytes a
// hexahedron on disk.
constexpr double kBytesPerHexahedron = 935;
constexpr double kBytesPerTriangle = 100;
constexpr double kBytesPerServer = 22e6;
constexpr double kSecondsPerHexahedron = 11e-6;
constexpr double kSecondsPerTriangle = 8e-6;
constexpr double kDiskBytesPerHexahedron = 27;

Point3 Middle(const Box3& box) {
  Point3 middle;
  for (int axis = 0; axis < 3; ++axis) middle[axis] = (box.lo[axis] + box.hi[axis]) / 2;
  return middle;
}

Box3 Child(const Box3& box, unsigned number) {
  const Point3 middle = Middle(box);
  Box3 child = box;
  for (unsigned axis = 0; axis < 3; ++axis) {
    ((number >> axis & 1) != 0 ? child.lo : child.hi)[axis] = middle[axis];
  }
  return child;
}

// Leaves a random choice of `size` boxes; deterministic for a seed.
void Thin(std::vector<Box3>& boxes, size_t size, std::mt19937_64& random) {
  for (size_t i = 0; i < size; ++i) std::swap(boxes[i], boxes[i + random() % (boxes.size() - i)]);
  boxes.resize(size);
}

}  // namespace

double Estimate::made() const { return cut() + inside() + outside(); }
double Estimate::cut() const {
  double sum = 0;
  for (const Level& level : levels) sum += level.cut;
  return sum;
}
double Estimate::inside() const {
  double sum = 0;
  for (const Level& level : levels) sum += level.inside;
  return sum;
}
double Estimate::outside() const {
  double sum = 0;
  for (const Level& level : levels) sum += level.outside;
  return sum;
}

Estimate EstimateRefinement(const std::shared_ptr<const TriangleSurface>& surface, const GridShape& grid,
                            int depth, size_t sample) {
  const SurfaceIndex index(surface);
  const ParityIndex parity(surface);
  std::mt19937_64 random(1);
  Estimate estimate;
  std::vector<Box3> parents;
  // How many hexahedra each parent stands for.
  double weight = 1;
  const auto look = [&](const Box3& box, Estimate::Level& level, std::vector<Box3>& cut) {
    level.cells += weight;
    if (index.Meets(box)) {
      cut.push_back(box);
    } else {
      (parity.Inside(Middle(box)) ? level.inside : level.outside) += weight;
    }
  };
  for (int l = 0; l <= depth; ++l) {
    Estimate::Level level;
    std::vector<Box3> cut;
    if (l == 0) {
      for (uint32_t k = 0; k < grid.cells[2]; ++k) {
        for (uint32_t j = 0; j < grid.cells[1]; ++j) {
          for (uint32_t i = 0; i < grid.cells[0]; ++i) {
            look({grid.Corner(i, j, k), grid.Corner(i + 1, j + 1, k + 1)}, level, cut);
          }
        }
      }
    } else {
      for (const Box3& parent : parents) {
        for (unsigned c = 0; c < 8; ++c) look(Child(parent, c), level, cut);
      }
    }
    (l < depth ? level.refined : level.cut) = weight * static_cast<double>(cut.size());
    estimate.levels.push_back(level);
    if (cut.size() > sample) {
      weight *= static_cast<double>(cut.size()) / static_cast<double>(sample);
      Thin(cut, sample, random);
    }
    parents = std::move(cut);
  }
  return estimate;
}

Cost CostOf(double made, double held, double kept, uint64_t triangles, uint32_t servers) {
  const double t = static_cast<double>(triangles);
  Cost cost;
  cost.memory_bytes = held * kBytesPerHexahedron + servers * (kBytesPerServer + t * kBytesPerTriangle);
  cost.cpu_seconds = made * kSecondsPerHexahedron + (servers + 1) * t * kSecondsPerTriangle;
  cost.disk_bytes = kept * kDiskBytesPerHexahedron;
  return cost;
}

int DepthForSize(const GridShape& grid, double size) {
  double longest = 0;
  for (int axis = 0; axis < 3; ++axis) {
    longest = std::max(longest, (grid.hi[axis] - grid.lo[axis]) / grid.cells[axis]);
  }
  int depth = 0;
  while (depth <= CellId::kMaxLevel && longest > size) {
    longest /= 2;
    ++depth;
  }
  return depth;
}

}  // namespace ndmap::cli

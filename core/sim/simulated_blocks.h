// SPDX-License-Identifier: GPL-3.0-or-later
// Blocks of one map in this process, for tests that stand beside the code: phases run in the simulator.
#pragma once

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/algorithm/build/build.h"
#include "core/algorithm/registry.h"
#include "core/geometry/grid_shape.h"
#include "core/geometry/surface.h"
#include "core/geometry/surface_caches.h"
#include "core/map/block.h"
#include "core/sim/simulator.h"

namespace ndmap {

class SimulatedBlocks {
 public:
  explicit SimulatedBlocks(uint32_t count, std::shared_ptr<const TriangleSurface> surface = nullptr)
      : surface_(std::move(surface)) {
    for (uint32_t b = 0; b < count; ++b) {
      blocks_.push_back(std::make_unique<Block3>(BlockId{b}));
      caches_.push_back(std::make_shared<IndexCache>());
    }
  }

  Block3& operator[](size_t b) { return *blocks_[b]; }
  size_t size() const { return blocks_.size(); }

  // The initial hexahedra of a grid, in slabs.
  absl::Status Build(const GridShape& grid) {
    auto assignment = MakeAssignment(grid, static_cast<uint32_t>(size()), "slabs", nullptr, 0);
    if (!assignment.ok()) return assignment.status();
    return Run("build", GridParameters(grid, *assignment)).status();
  }

  // One phase on all blocks.
  absl::StatusOr<Report> Run(absl::string_view algorithm, const Parameters& parameters = {}) {
    std::vector<std::unique_ptr<BlockAlgorithm>> algorithms;
    for (size_t b = 0; b < size(); ++b) {
      const Environment environment{blocks_[b]->id(), static_cast<uint32_t>(size()), Routing::kDirect,
                                    surface_, caches_[b]};
      auto made = MakeAlgorithm(algorithm, parameters, environment, *blocks_[b]);
      if (!made.ok()) return made.status();
      algorithms.push_back(*std::move(made));
    }
    return Simulator({}).RunPhase(algorithms);
  }

 private:
  const std::shared_ptr<const TriangleSurface> surface_;
  std::vector<std::unique_ptr<Block3>> blocks_;
  std::vector<std::shared_ptr<IndexCache>> caches_;
};

}  // namespace ndmap

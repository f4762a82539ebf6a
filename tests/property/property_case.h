// SPDX-License-Identifier: GPL-3.0-or-later
// The central property, for one random case: the global map depends only on which hexahedra were refined.
// Blocks are built, refined and trimmed by the very algorithms that services host, in the simulator; then the
// gathered map must be isomorphic to the reference (plain CGAL, insert_* only), points bit for bit.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "core/algorithm/block_algorithm.h"
#include "core/algorithm/build/build.h"
#include "core/algorithm/registry.h"
#include "core/attributes/table.h"
#include "core/map/gather.h"
#include "core/mesh/mesh_piece.h"
#include "core/mesh/polygon_piece.h"
#include "core/names/mesh_cells.h"
#include "core/names/polygon_cells.h"
#include "core/sim/simulator.h"
#include "tests/reference/mesh_case.h"
#include "tests/reference/random_case.h"

namespace ndmap {

// How a case is run; follows from the seed unless a test wants one way.
struct PropertyVariant {
  Routing routing = Routing::kDirect;
  // One phase a level, or all levels in one.
  bool by_level = true;
  SimulatorOptions simulator;
};
PropertyVariant VariantOf(uint64_t seed);

// As the oracle "list" and the algorithm "trim" take them.
std::string TextOf(const std::vector<CellId>& ids);

// A map in blocks, with the phases that change it.
template <class BlockT>
class SimulatedMap {
 public:
  SimulatedMap(uint32_t blocks, Routing routing, const SimulatorOptions& options)
      : routing_(routing), simulator_(options) {
    for (uint32_t b = 0; b < blocks; ++b) {
      blocks_.push_back(std::make_unique<BlockT>(BlockId{b}));
      attributes_.push_back(std::make_shared<AttributeStore>());
    }
  }

  absl::Status BuildGrid(const std::array<uint32_t, 3>& cells, CornerFunction corner,
                         const std::vector<uint32_t>& block_of) {
    initial_ = std::make_shared<GridCells>(cells);
    std::vector<std::unique_ptr<BlockAlgorithm>> algorithms;
    for (auto& block : blocks_) {
      algorithms.push_back(
          std::make_unique<Build<BlockT>>(cells, corner, Assignment::FromTable(block_of), routing_, *block));
    }
    return simulator_.RunPhase(algorithms).status();
  }

  // From pieces, as servers do.
  absl::Status LoadMesh(const VolumeMesh& mesh, const std::vector<uint32_t>& block_of) {
    const auto count = static_cast<uint32_t>(blocks_.size());
    return Load<MeshCells>(MeshCutter(mesh, block_of, count));
  }
  absl::Status LoadMesh(const PolygonMesh& mesh, const std::vector<uint32_t>& block_of) {
    return Load<PolygonCells>(PolygonCutter(mesh, block_of, static_cast<uint32_t>(blocks_.size())));
  }
  // Of a map that was loaded: what a block knows of the mesh.
  const MeshCells& mesh(uint32_t block) const { return *loaded_[block]->mesh(); }
  const PolygonCells& polygons(uint32_t block) const { return *loaded_[block]->polygons(); }

  absl::StatusOr<Report> Run(absl::string_view algorithm, const Parameters& parameters) {
    std::vector<std::unique_ptr<BlockAlgorithm>> algorithms;
    for (size_t b = 0; b < blocks_.size(); ++b) {
      Environment environment{blocks_[b]->id(), static_cast<uint32_t>(blocks_.size()), routing_, surface_,
                              nullptr};
      environment.initial = initial_;
      if (!loaded_.empty()) environment.initial = loaded_[b];
      environment.attributes = attributes_[b];
      auto made = MakeAlgorithm(algorithm, parameters, environment, *blocks_[b]);
      if (!made.ok()) return made.status();
      algorithms.push_back(*std::move(made));
    }
    return simulator_.RunPhase(algorithms);
  }

  // Refines the listed hexahedra, parents before children.
  absl::Status RefineList(const std::vector<CellId>& refined, bool by_level);

  // What the refinement phases reported together.
  const Report& refined() const { return refined_; }

  std::vector<std::unique_ptr<BlockT>>& blocks() { return blocks_; }
  AttributeStore& attributes(size_t b) { return *attributes_[b]; }
  void set_surface(std::shared_ptr<const TriangleSurface> surface) { surface_ = std::move(surface); }
  const Simulator& simulator() const { return simulator_; }

 private:
  template <class Cells, class Cutter>
  absl::Status Load(const Cutter& cutter) {
    const auto count = static_cast<uint32_t>(blocks_.size());
    for (uint32_t b = 0; b < count; ++b) {
      auto cells = Cells::Make(cutter.Piece(BlockId{b}), BlockId{b}, count);
      if (!cells.ok()) return cells.status();
      loaded_.push_back(*std::move(cells));
    }
    return Run("load", {}).status();
  }

  const Routing routing_;
  Simulator simulator_;
  std::shared_ptr<const TriangleSurface> surface_;
  Report refined_;
  std::vector<std::unique_ptr<BlockT>> blocks_;
  std::vector<std::shared_ptr<AttributeStore>> attributes_;
  std::shared_ptr<const InitialCells> initial_;
  std::vector<std::shared_ptr<const InitialCells>> loaded_;
};

// The seed's grid, its hexahedra around an edge and its mesh: OK, or what differs; that no message is left is
// asserted by the phases themselves (Finish).
absl::Status RunPropertyCase(uint64_t seed, StorageKind storage);
absl::Status RunPropertyCase(const reference::RandomCase& random_case, const PropertyVariant& variant,
                             StorageKind storage);

// The same of a random mesh (tests/reference/mesh_case.h).
absl::Status RunMeshCase(const reference::MeshCase& mesh_case, const PropertyVariant& variant,
                         StorageKind storage);

}  // namespace ndmap

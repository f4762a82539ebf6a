// SPDX-License-Identifier: GPL-3.0-or-later
// Navigation through real services on refined and trimmed meshes of surfaces, with 1, 2 and 8 blocks, against
// one CGAL map of the same mesh. The surface: a sample torus, elephant where the folder of meshes is there,
// or the file that the variable NDMAP_NAVIGATE_SURFACE names (tests/service/navigate_surfaces.sh).
#include <gtest/gtest.h>

#include <cstdlib>
#include <memory>

#include "core/io/surface_reader.h"
#include "tests/service/navigation.h"

namespace ndmap {
namespace {

const int kDepth = FromEnvironment("NDMAP_NAVIGATE_DEPTH", 2);
const int kQuestions = FromEnvironment("NDMAP_NAVIGATE_QUESTIONS", 60);

TriangleSurface Surface() {
  if (const char* file = std::getenv("NDMAP_NAVIGATE_SURFACE"); file != nullptr)
    return ReadSurface(file, {.check_self_intersections = false}).value().surface;
#ifdef NDMAP_MESHES
  return ReadSurface(std::string(NDMAP_MESHES) + "/surfaces/elephant.off").value().surface;
#else
  return MakeSample("torus", {2000, 1}).value();
#endif
}

// Refine, classify, trim.
Phases MainJob() {
  Phases phases;
  for (int level = 0; level < kDepth; ++level) {
    phases.push_back({"refine", {{"depth", absl::StrCat(kDepth)}, {"level", absl::StrCat(level)}}});
  }
  phases.insert(phases.end(), {{"classify", {}}, {"trim", {}}});
  return phases;
}

std::unique_ptr<Whole> MakeWhole(const TriangleSurface& surface, const GridShape& grid) {
  auto whole = std::make_unique<Whole>();
  whole->map().set_surface(std::make_shared<const TriangleSurface>(surface));
  const auto corner = [&](uint32_t i, uint32_t j, uint32_t k) { return grid.Corner(i, j, k); };
  EXPECT_TRUE(whole->map().BuildGrid(grid.cells, corner, std::vector<uint32_t>(grid.CellCount(), 0)).ok());
  whole->Run(MainJob());
  whole->NameDarts(std::make_shared<GridCells>(grid.cells));
  return whole;
}

class NavigateSurfaces : public ::testing::TestWithParam<uint32_t> {
 protected:
  struct Reference {
    TriangleSurface surface;
    GridShape grid;
    std::unique_ptr<Whole> whole;
  };
  static Reference& Shared() {
    static auto& reference = *[] {
      auto* made = new Reference{Surface(), {}, nullptr};
      made->grid = GridFromCubes(BoundingBox(made->surface), 6).value();
      made->whole = MakeWhole(made->surface, made->grid);
      return made;
    }();
    return reference;
  }

  NavigateSurfaces()
      : cluster_(3), whole_(*Shared().whole), navigation_(cluster_, "mesh", GetParam(), whole_) {
    const Reference& reference = Shared();
    const std::string id = service::SurfaceId(reference.surface);
    EXPECT_TRUE(cluster_.Upload(reference.surface, id).ok());
    v1::CreateMapRequest request;
    request.set_map("mesh");
    request.set_surface_id(id);
    request.set_block_count(GetParam());
    request.set_depth(static_cast<uint32_t>(kDepth));
    for (int c = 0; c < 3; ++c) {
      request.mutable_grid()->add_cells(reference.grid.cells[c]);
      request.mutable_grid()->add_lo(reference.grid.lo[c]);
      request.mutable_grid()->add_hi(reference.grid.hi[c]);
    }
    EXPECT_EQ(cluster_.Create(request).state(), v1::JOB_STATE_DONE);
    const v1::Job job = cluster_.Run("mesh", MainJob());
    EXPECT_EQ(job.state(), v1::JOB_STATE_DONE) << job.error();
  }

  Cluster cluster_;
  Whole& whole_;
  Navigation navigation_;
};

TEST_P(NavigateSurfaces, HasTheSameCells) { navigation_.HasTheSameCells(); }

TEST_P(NavigateSurfaces, OrbitsIncidentAndAdjacentCellsAndRings) {
  navigation_.OrbitsIncidentAndAdjacentCellsAndRings(kQuestions);
}

TEST_P(NavigateSurfaces, WordsOfBetas) { navigation_.WordsOfBetas(kQuestions); }

TEST_P(NavigateSurfaces, PointsBoxesAndNearestVertices) {
  const GridShape& grid = Shared().grid;
  const Box3 all{grid.lo, grid.hi};
  const auto hexahedra_at = [&](const Box3& box) {
    Ids ids;
    for (const auto& [id, own] : whole_.boxes()) {
      if (Meet(box, own)) ids.insert(id);
    }
    return ids;
  };
  for (int k = 0; k < kQuestions; ++k) {
    // A vertex is on the boundary between cells.
    const Point3 p = k % 2 == 0 ? whole_.PointOf(navigation_.AnyCell(0)) : navigation_.RandomPoint(all);
    EXPECT_EQ(navigation_.Located(p), hexahedra_at({p, p}));
    const Box3 box = navigation_.RandomBox(all);
    EXPECT_EQ(navigation_.Within(box), hexahedra_at(box));
    // From a point among the cells, and from one that is beyond the squares of doubles.
    const Point3 from = navigation_.RandomPoint(all);
    navigation_.NearestVertex(from);
    navigation_.NearestVertex({1e200 * from[0], 1e200 * from[1], 1e200 * from[2]});
  }
}

INSTANTIATE_TEST_SUITE_P(Blocks, NavigateSurfaces, ::testing::Values(1, 2, 8));

}  // namespace
}  // namespace ndmap

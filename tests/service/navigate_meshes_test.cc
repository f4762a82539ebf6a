// SPDX-License-Identifier: GPL-3.0-or-later
// Navigation through real services on maps made from meshes of hexahedra, prisms, pyramids and tetrahedra,
// some of whose hexahedra are refined, with 1, 2 and 8 blocks, against one CGAL map of each. The meshes:
// random ones, and the mixed ones of the folder of meshes where that is there.
#include <gtest/gtest.h>

#include <memory>
#include <ostream>

#include "core/algorithm/load/mesh_assignment.h"
#include "tests/service/mesh_cluster.h"
#include "tests/service/navigation.h"

namespace ndmap {
namespace {

const int kQuestions = FromEnvironment("NDMAP_NAVIGATE_QUESTIONS", 25);

// A random mesh by its seed, or a file.
struct Source {
  uint64_t seed = 0;
  const char* file = nullptr;
  uint32_t blocks = 1;

  friend void PrintTo(const Source& source, std::ostream* out) {
    *out << (source.file == nullptr ? absl::StrCat("seed ", source.seed) : source.file) << ", "
         << source.blocks << " blocks";
  }
};

GluedMesh Read(const Source& source) {
#ifdef NDMAP_MESHES
  if (source.file != nullptr) {
    auto glued = ReadGluedMesh(absl::StrCat(NDMAP_MESHES, "/volumes/", source.file));
    EXPECT_TRUE(glued.ok()) << glued.status();
    return *std::move(glued);
  }
#endif
  auto glued = Glue(Large(source.seed).mesh, {.allow_concave = true});
  EXPECT_TRUE(glued.ok()) << glued.status();
  return *std::move(glued);
}

class NavigateMeshes : public ::testing::TestWithParam<Source> {
 protected:
  NavigateMeshes()
      : cluster_(3), glued_(Read(GetParam())), navigation_(cluster_, "mesh", GetParam().blocks, whole_) {
    const VolumeMesh& mesh = glued_.mesh;
    box_ = {mesh.points[0], mesh.points[0]};
    for (const Point3& p : mesh.points) {
      for (int c = 0; c < 3; ++c) {
        box_.lo[c] = std::min(box_.lo[c], p[c]);
        box_.hi[c] = std::max(box_.hi[c], p[c]);
      }
    }
    // The lower half, and a corner of it more.
    Point3 low = box_.hi, lower = box_.lo;
    low[2] = (box_.lo[2] + box_.hi[2]) / 2;
    for (int c = 0; c < 3; ++c) lower[c] = box_.lo[c] + (box_.hi[c] - box_.lo[c]) / 4;
    const Phases refine = {
        {"refine", {{"oracle", "box"}, {"depth", "1"}, {"lo", Text(box_.lo)}, {"hi", Text(low)}}},
        {"refine", {{"oracle", "box"}, {"depth", "2"}, {"lo", Text(box_.lo)}, {"hi", Text(lower)}}}};
    EXPECT_TRUE(whole_.map().LoadMesh(mesh, std::vector<uint32_t>(mesh.cells(), 0)).ok());
    whole_.Run(refine);
    // Lives as long as the map does.
    whole_.NameDarts(std::shared_ptr<const InitialCells>(std::shared_ptr<void>(), &whole_.map().mesh(0)));

    const auto block_of = AssignMesh(glued_, GetParam().blocks, "hilbert");
    EXPECT_TRUE(block_of.ok()) << block_of.status();
    const v1::Job made = cluster_.Create(PutMesh(cluster_, "mesh", mesh, *block_of, GetParam().blocks));
    EXPECT_EQ(made.state(), v1::JOB_STATE_DONE) << made.error();
    const v1::Job refined = cluster_.Run("mesh", refine);
    EXPECT_EQ(refined.state(), v1::JOB_STATE_DONE) << refined.error();
  }

  static std::string Text(const Point3& p) { return absl::StrCat(p[0], ",", p[1], ",", p[2]); }

  Cluster cluster_;
  const GluedMesh glued_;
  Box3 box_;
  Whole whole_;
  Navigation navigation_;
};

TEST_P(NavigateMeshes, HasTheSameCells) { navigation_.HasTheSameCells(); }

TEST_P(NavigateMeshes, OrbitsIncidentAndAdjacentCellsAndRings) {
  navigation_.OrbitsIncidentAndAdjacentCellsAndRings(kQuestions);
}

TEST_P(NavigateMeshes, WordsOfBetas) { navigation_.WordsOfBetas(kQuestions); }

TEST_P(NavigateMeshes, PointsOfCellsAndTheirVertices) {
  for (int k = 0; k < kQuestions; ++k) {
    // A vertex is in the cells that have it, and in no other.
    const CellId vertex = navigation_.AnyCell(0);
    const Point3 at = whole_.PointOf(vertex);
    Ids around;
    for (DartIndex d : whole_.DartsOf(0, vertex)) around.insert(whole_.NameOfDart(d)[3]);
    EXPECT_EQ(navigation_.Located(at), around) << vertex.ToString();
    // The middle of a cell's vertices is in that cell alone.
    const CellId cell = navigation_.AnyCell(3);
    Ids vertices;
    for (DartIndex d : whole_.DartsOf(3, cell)) vertices.insert(whole_.NameOfDart(d)[0]);
    Point3 middle{};
    for (const CellId& v : vertices) {
      const Point3 p = whole_.PointOf(v);
      for (int c = 0; c < 3; ++c) middle[c] += p[c] / static_cast<double>(vertices.size());
    }
    EXPECT_EQ(navigation_.Located(middle), Ids{cell});
  }
}

TEST_P(NavigateMeshes, PointsBoxesAndNearestVertices) {
  const auto cells_at = [&](const Box3& box) {
    Ids ids;
    for (const auto& [id, own] : whole_.boxes()) {
      if (Meet(box, own) && whole_.Meets(id, box)) ids.insert(id);
    }
    return ids;
  };
  for (int k = 0; k < kQuestions; ++k) {
    const Point3 p = navigation_.RandomPoint(box_);
    const Ids located = navigation_.Located(p);
    EXPECT_EQ(located, cells_at({p, p}));
    EXPECT_LE(located.size(), 1u);
    const Box3 box = navigation_.RandomBox(box_);
    const Ids within = navigation_.Within(box);
    EXPECT_EQ(within, cells_at(box));
    // Whatever has a vertex in the box meets it.
    for (const CellId& vertex : whole_.All(0)) {
      const Point3 q = whole_.PointOf(vertex);
      if (!Meet({q, q}, box)) continue;
      for (DartIndex d : whole_.DartsOf(0, vertex)) EXPECT_TRUE(within.contains(whole_.NameOfDart(d)[3]));
    }
    navigation_.NearestVertex(p);
    navigation_.NearestVertex({-1e200 * p[0], 1e200 * p[1], 1e160 * p[2]});
  }
}

TEST_P(NavigateMeshes, DetailsTellKindsAndCorners) {
  const VolumeMesh& mesh = glued_.mesh;
  for (int k = 0; k < kQuestions; ++k) {
    const CellId cell = navigation_.AnyCell(3);
    v1::ExploreRequest request = Navigation::About(cell, {3}, 3);
    request.set_give(v1::GIVE_CELL_DETAILS);
    const v1::ExploreResponse details = navigation_.Ask(request);
    ASSERT_EQ(details.cells_size(), 1);
    const v1::CellDetails& told = details.cells(0);
    const CellKind kind = mesh.kinds[cell.initial()];
    EXPECT_EQ(told.kind(), ShapeOf(kind).name);
    ASSERT_EQ(told.vertices_size(), ShapeOf(kind).corners);
    if (cell.level() > 0) continue;
    // Those of an initial cell stand as the mesh has them; a hexahedron's as bits of its number.
    const auto& listed = DartsOf(kind).listed;
    for (int i = 0; i < told.points_size(); ++i) {
      const Point3& p = mesh.points[mesh.Corners(cell.initial())[listed[static_cast<size_t>(i)]]];
      EXPECT_EQ((Point3{told.points(i).x(), told.points(i).y(), told.points(i).z()}), p);
    }
  }
}

std::vector<Source> Sources() {
  std::vector<Source> sources;
  for (uint32_t blocks : {1u, 2u, 8u}) {
    for (uint64_t seed : {1u, 30u}) sources.push_back({seed, nullptr, blocks});
#ifdef NDMAP_MESHES
    if (blocks < 8) sources.push_back({0, "mixed_all4.mfem.mesh", blocks});
    sources.push_back({0, "fichera-mixed.mfem.mesh", blocks});
    sources.push_back({0, "hybrid_tet_prism_pyramid.msh", blocks});
#endif
  }
  return sources;
}

INSTANTIATE_TEST_SUITE_P(Meshes, NavigateMeshes, ::testing::ValuesIn(Sources()));

}  // namespace
}  // namespace ndmap

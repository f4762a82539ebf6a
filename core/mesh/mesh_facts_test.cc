// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/mesh/mesh_facts.h"

#include "core/mesh/mesh_testing.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"

namespace ndmap {
namespace {

MeshFacts FactsOf(const VolumeMesh& mesh) {
  const auto glued = Glue(mesh);
  EXPECT_TRUE(glued.ok()) << glued.status();
  return Describe(glued.value());
}

TEST(MeshFactsTest, Cubes) {
  const MeshFacts facts = FactsOf(CubeMesh(2, 3, 4));
  EXPECT_THAT(facts.cells, testing::ElementsAre(0, 0, 0, 24));
  EXPECT_EQ(facts.points, 60u);
  EXPECT_EQ(facts.edges, 2u * 4 * 5 + 3 * 3 * 5 + 3 * 4 * 4);
  EXPECT_EQ(facts.faces, 3u * 3 * 4 + 2 * 4 * 4 + 2 * 3 * 5);
  EXPECT_EQ(facts.euler, 1);
  EXPECT_EQ(facts.components, 1u);
  EXPECT_EQ(facts.boundary_faces, 52u);
  EXPECT_EQ(facts.boundary_points, 54u);
  EXPECT_EQ(facts.boundary_edges, 104u);
  EXPECT_EQ(facts.boundary_euler, 2);
  EXPECT_EQ(facts.boundary_components, 1u);
  EXPECT_EQ(facts.crowded_boundary_edges, 0u);
  EXPECT_EQ(facts.split_points, 0u);
  EXPECT_EQ(facts.split_edges, 0u);
  EXPECT_EQ(facts.volume, 24);
  EXPECT_EQ(facts.worst_corner, 1);
  EXPECT_EQ(facts.box, (Box3{{0, 0, 0}, {2, 3, 4}}));
}

TEST(MeshFactsTest, OneOfEachKind) {
  const MeshFacts facts = FactsOf(OneOfEach());
  EXPECT_THAT(facts.cells, testing::ElementsAre(1, 1, 1, 1));
  EXPECT_EQ(facts.euler, 1);
  EXPECT_EQ(facts.boundary_euler, 2);
  EXPECT_EQ(facts.split_points + facts.split_edges, 0u);
  EXPECT_EQ(facts.worst_cell, 3u);
}

// A shell of 26 cubes about a hole, and a ring of 8 about a hole that goes through.
TEST(MeshFactsTest, Holes) {
  const auto without = [](VolumeMesh all, auto hole) {
    VolumeMesh mesh;
    mesh.points = all.points;
    for (uint64_t c = 0; c < all.cells(); ++c) {
      if (!hole(c)) mesh.AddCell(all.kinds[c], all.Corners(c));
    }
    return mesh;
  };
  MeshFacts facts = FactsOf(without(CubeMesh(3, 3, 3), [](uint64_t c) { return c == 13; }));
  EXPECT_EQ(facts.euler, 2);
  EXPECT_EQ(facts.boundary_euler, 4);
  EXPECT_EQ(facts.boundary_components, 2u);
  facts = FactsOf(without(CubeMesh(3, 3, 1), [](uint64_t c) { return c == 4; }));
  EXPECT_EQ(facts.euler, 0);
  EXPECT_EQ(facts.boundary_euler, 0);
  EXPECT_EQ(facts.boundary_components, 1u);
}

// Cubes 0 and 3 of four touch in an edge; 0 and 7 of eight in a vertex.
TEST(MeshFactsTest, CellsThatMeetInAnEdgeOrAVertexOnly) {
  const auto pair = [](VolumeMesh all, uint64_t other) {
    VolumeMesh mesh;
    mesh.points = all.points;
    mesh.AddCell(all.kinds[0], all.Corners(0));
    mesh.AddCell(all.kinds[other], all.Corners(other));
    return FactsOf(mesh);
  };
  MeshFacts facts = pair(CubeMesh(2, 2, 1), 3);
  EXPECT_EQ(facts.components, 2u);
  EXPECT_EQ(facts.points, 14u);
  EXPECT_EQ(facts.edges, 23u);
  EXPECT_EQ(facts.split_points, 2u);
  EXPECT_EQ(facts.split_edges, 1u);
  EXPECT_EQ(facts.crowded_boundary_edges, 1u);
  facts = pair(CubeMesh(2, 2, 2), 7);
  EXPECT_EQ(facts.components, 2u);
  EXPECT_EQ(facts.split_points, 1u);
  EXPECT_EQ(facts.split_edges, 0u);
  EXPECT_EQ(facts.boundary_components, 2u);
}

}  // namespace
}  // namespace ndmap

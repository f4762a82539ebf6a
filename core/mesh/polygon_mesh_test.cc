// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/mesh/polygon_mesh.h"

#include <cmath>
#include <string>

#include "gmock/gmock.h"
#include "gtest/gtest.h"

namespace ndmap {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

void Add(PolygonMesh* mesh, std::initializer_list<uint32_t> corners) {
  mesh->AddFace(std::vector<uint32_t>(corners));
}

PolygonMesh Cube() {
  PolygonMesh mesh;
  for (int i = 0; i < 8; ++i) mesh.points.push_back({double(i & 1), double(i >> 1 & 1), double(i >> 2)});
  for (auto face : {std::vector<uint32_t>{0, 2, 3, 1},
                    {4, 5, 7, 6},
                    {0, 1, 5, 4},
                    {2, 6, 7, 3},
                    {0, 4, 6, 2},
                    {1, 3, 7, 5}}) {
    mesh.AddFace(face);
  }
  return mesh;
}

// nx * ny unit squares.
PolygonMesh Squares(uint32_t nx, uint32_t ny) {
  PolygonMesh mesh;
  for (uint32_t j = 0; j <= ny; ++j) {
    for (uint32_t i = 0; i <= nx; ++i) mesh.points.push_back({double(i), double(j), 0});
  }
  for (uint32_t j = 0; j < ny; ++j) {
    for (uint32_t i = 0; i < nx; ++i) {
      const uint32_t a = j * (nx + 1) + i, b = a + nx + 1;
      Add(&mesh, {a, a + 1, b + 1, b});
    }
  }
  return mesh;
}

PolygonMesh Without(const PolygonMesh& all, std::initializer_list<uint64_t> holes) {
  PolygonMesh mesh;
  mesh.points = all.points;
  for (uint64_t f = 0; f < all.faces(); ++f) {
    if (std::find(holes.begin(), holes.end(), f) == holes.end()) mesh.AddFace(all.Corners(f));
  }
  return mesh;
}

PolygonFacts FactsOf(const PolygonMesh& mesh) {
  const auto glued = GluePolygons(mesh);
  EXPECT_TRUE(glued.ok()) << glued.status();
  return Describe(glued.value());
}

std::string WhyNotClosed(const PolygonMesh& mesh) {
  const auto glued = GluePolygons(mesh);
  if (glued.ok()) return "accepted";
  EXPECT_EQ(glued.status().code(), absl::StatusCode::kInvalidArgument);
  return std::string(glued.status().message());
}

TEST(GluePolygonsTest, LinksRunTheOtherWayAndBack) {
  for (const PolygonMesh& mesh : {Cube(), Squares(4, 3)}) {
    const auto glued = GluePolygons(mesh);
    ASSERT_TRUE(glued.ok()) << glued.status();
    EXPECT_THAT(glued->notes, IsEmpty());
    EXPECT_THAT(glued->warnings, IsEmpty());
    uint64_t boundary = 0;
    for (uint32_t f = 0; f < mesh.faces(); ++f) {
      const auto corners = mesh.Corners(f);
      for (uint32_t i = 0; i < corners.size(); ++i) {
        const SideLink& link = glued->Link(f, i);
        if (link.boundary()) {
          ++boundary;
          continue;
        }
        const auto other = mesh.Corners(link.face);
        EXPECT_EQ(other[link.side], corners[(i + 1) % corners.size()]);
        EXPECT_EQ(other[(link.side + 1) % other.size()], corners[i]);
        EXPECT_EQ(glued->Link(link.face, link.side), (SideLink{f, i}));
      }
    }
    EXPECT_EQ(boundary, glued->boundary_edges);
  }
}

TEST(PolygonFactsTest, ClosedAndOpen) {
  PolygonFacts facts = FactsOf(Cube());
  EXPECT_THAT(facts.faces, ElementsAre(0, 6, 0));
  EXPECT_EQ(facts.edges, 12u);
  EXPECT_EQ(facts.euler, 2);
  EXPECT_EQ(facts.boundary_cycles, 0u);
  EXPECT_EQ(facts.area, 6);
  facts = FactsOf(Squares(3, 3));
  EXPECT_EQ(facts.euler, 1);
  EXPECT_EQ(facts.boundary_edges, 12u);
  EXPECT_EQ(facts.boundary_cycles, 1u);
  facts = FactsOf(Without(Squares(3, 3), {4}));
  EXPECT_EQ(facts.euler, 0);
  EXPECT_EQ(facts.boundary_edges, 16u);
  EXPECT_EQ(facts.boundary_cycles, 2u);
  EXPECT_EQ(facts.components, 1u);
  EXPECT_EQ(facts.split_points, 0u);
  EXPECT_EQ(facts.box, (Box3{{0, 0, 0}, {3, 3, 0}}));
}

// Two squares of four that touch in the middle.
TEST(PolygonFactsTest, FacesThatMeetInAVertexOnly) {
  const PolygonFacts facts = FactsOf(Without(Squares(2, 2), {1, 2}));
  EXPECT_EQ(facts.components, 2u);
  EXPECT_EQ(facts.points, 7u);
  EXPECT_EQ(facts.split_points, 1u);
  EXPECT_EQ(facts.boundary_cycles, 2u);
}

TEST(PolygonFactsTest, PolygonsOfAnySize) {
  PolygonMesh mesh;
  for (int i = 0; i < 1000; ++i)
    mesh.points.push_back({std::cos(i * 0.00628318), std::sin(i * 0.00628318), 0});
  std::vector<uint32_t> all;
  for (uint32_t i = 0; i < 1000; ++i) all.push_back(i);
  mesh.AddFace(all);
  mesh.points.push_back({2, 0, 0});
  Add(&mesh, {1, 0, 1000});
  const PolygonFacts facts = FactsOf(mesh);
  EXPECT_THAT(facts.faces, ElementsAre(1, 0, 1));
  EXPECT_EQ(facts.components, 1u);
  EXPECT_EQ(facts.euler, 1);
}

TEST(PolygonFaultTest, ArraysIndicesAndNumbers) {
  EXPECT_EQ(WhyNotClosed({}), "has no faces");
  PolygonMesh mesh = Cube();
  mesh.begins[2] = 3;
  EXPECT_EQ(WhyNotClosed(mesh), "its arrays of faces, corners and numbers do not fit together");
  mesh = Cube();
  mesh.source = {"a.off", "counted from 0", {}, {}, 0, 0};
  mesh.corners[5] = 8;
  EXPECT_EQ(WhyNotClosed(mesh),
            "a.off: face 1 (counted from 0) has a corner at index 8, out of range; there are 8 points");
  mesh = Cube();
  mesh.points[3][0] = NAN;
  EXPECT_EQ(WhyNotClosed(mesh), "point 3 has a coordinate that is not finite");
  mesh = Cube();
  Add(&mesh, {0, 7});
  EXPECT_EQ(WhyNotClosed(mesh), "1 face has fewer than three corners: face 6");
  mesh = Cube();
  mesh.corners[0] = 3;
  EXPECT_EQ(WhyNotClosed(mesh), "1 face comes to the same point twice: face 0");
}

TEST(PolygonFaultTest, EdgesThatCannotBeGlued) {
  PolygonMesh mesh = Cube();
  mesh.points.push_back({-1, -1, 0});
  Add(&mesh, {0, 1, 8});
  EXPECT_EQ(WhyNotClosed(mesh),
            "1 edge has more than two faces, that of points 0 and 1 of face 0, face 2 and face 6; a surface "
            "has at most "
            "one face on either side of an edge");
  mesh = Cube();
  std::reverse(mesh.corners.begin() + 8, mesh.corners.begin() + 12);
  EXPECT_THAT(
      WhyNotClosed(mesh),
      HasSubstr("4 edges are run in the same direction by their two faces, for example that of points "
                "0 and 1 of face 0 and face 2; turn one"));
}

TEST(GluePolygonsTest, PointsUnusedEqualAndFlat) {
  PolygonMesh mesh = Squares(1, 1);
  const PolygonMesh second = Squares(1, 1);
  for (Point3 p : second.points) mesh.points.push_back({p[0] + 1, p[1], p[2]});
  Add(&mesh, {4, 5, 7, 6});
  mesh.points.push_back({9, 9, 9});
  auto glued = GluePolygons(mesh);
  ASSERT_TRUE(glued.ok()) << glued.status();
  EXPECT_EQ(Describe(*glued).components, 2u);
  EXPECT_THAT(glued->notes, ElementsAre("left out 1 point that no face uses"));
  EXPECT_THAT(glued->warnings,
              ElementsAre(HasSubstr("2 points lie where another does, as point 4 and point 1: faces")));
  glued = GluePolygons(mesh, {.merge_equal_points = true});
  ASSERT_TRUE(glued.ok()) << glued.status();
  EXPECT_EQ(Describe(*glued).components, 1u);
  mesh = Squares(2, 1);
  mesh.points[2] = {1, 1, 0};
  mesh.points[5] = {1, 0.5, 0};
  glued = GluePolygons(mesh);
  ASSERT_TRUE(glued.ok()) << glued.status();
  EXPECT_THAT(glued->warnings, testing::Contains("1 face has no area: face 1"));
}

}  // namespace
}  // namespace ndmap

// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/io/sample_surface.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/measure.h>
#include <CGAL/Polygon_mesh_processing/orientation.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Surface_mesh.h>

#include <cmath>

#include "gmock/gmock.h"
#include "gtest/gtest.h"

namespace ndmap {
namespace {

namespace PMP = CGAL::Polygon_mesh_processing;
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;

Mesh ToMesh(const TriangleSurface& s) {
  std::vector<Kernel::Point_3> points;
  for (const Point3& p : s.points) points.emplace_back(p[0], p[1], p[2]);
  Mesh mesh;
  PMP::polygon_soup_to_polygon_mesh(points, s.triangles, mesh);
  return mesh;
}

class SampleTest : public testing::TestWithParam<std::string> {};

TEST_P(SampleTest, IsClosedOutwardAndWithoutSelfIntersections) {
  for (uint32_t triangles : {100u, 1000u, 10000u}) {
    SCOPED_TRACE(triangles);
    const auto s = MakeSample(GetParam(), {.triangles = triangles, .scale = 1});
    ASSERT_TRUE(s.ok()) << s.status();
    EXPECT_TRUE(ValidateClosedSurface(*s).ok()) << ValidateClosedSurface(*s);
    EXPECT_GT(s->triangles.size(), triangles / 2);
    EXPECT_LT(s->triangles.size(), triangles * 5);
    if (triangles == 10000) {
      EXPECT_NEAR(s->triangles.size(), triangles, triangles / 10);
    }
    const Mesh mesh = ToMesh(*s);
    EXPECT_FALSE(PMP::does_self_intersect(mesh));
    EXPECT_TRUE(PMP::does_bound_a_volume(mesh) && PMP::is_outward_oriented(mesh));
    const Box3 box = BoundingBox(*s);
    for (int c = 0; c < 3; ++c) {
      EXPECT_GT(box.lo[c], -1.8);
      EXPECT_LT(box.hi[c], 1.8);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Kinds, SampleTest, testing::ValuesIn(SampleKinds()), [](const auto& info) {
  std::string name = info.param;
  for (char& c : name) c = c == '-' ? '_' : c;
  return name;
});

TEST(SampleSurfaceTest, GenusAndVolume) {
  const auto euler = [](const TriangleSurface& s) {
    return static_cast<int>(s.points.size()) - static_cast<int>(s.triangles.size()) / 2;
  };
  EXPECT_EQ(euler(*MakeSample("sphere")), 2);
  EXPECT_EQ(euler(*MakeSample("knot")), 0);
  EXPECT_EQ(euler(*MakeSample("double-torus")), -2);
  EXPECT_EQ(euler(*MakeSample("shells")), 6);
  const double pi = std::acos(-1);
  EXPECT_NEAR(PMP::volume(ToMesh(*MakeSample("sphere", {.triangles = 10000, .scale = 2}))), 32 * pi / 3, 0.1);
  EXPECT_NEAR(PMP::volume(ToMesh(*MakeSample("torus"))), 2 * pi * pi * 0.16, 0.02);
  EXPECT_NEAR(PMP::volume(ToMesh(*MakeSample("shells"))), 4 * pi / 3 * (1 - 0.125 + 0.015625), 0.02);
}

TEST(SampleSurfaceTest, BumpyTorusIsTheReferenceCase) {
  const auto s = MakeSample("bumpy-torus");
  ASSERT_TRUE(s.ok()) << s.status();
  EXPECT_EQ(s->points.size(), 5000u);
  EXPECT_EQ(s->triangles.size(), 10000u);
  EXPECT_EQ(s->points[0], (Point3{1.4, 0, 0}));
  EXPECT_EQ(s->triangles[0], (std::array<uint32_t, 3>{0, 50, 51}));
  EXPECT_EQ(s->triangles[1], (std::array<uint32_t, 3>{0, 51, 1}));
}

TEST(SampleSurfaceTest, RefusesOtherKindsAndNumbers) {
  EXPECT_THAT(std::string(MakeSample("cube").status().message()),
              testing::HasSubstr("no sample surface 'cube'"));
  EXPECT_THAT(std::string(MakeSample("torus", {.triangles = 99, .scale = 1}).status().message()),
              testing::HasSubstr("99 triangles"));
  EXPECT_THAT(std::string(MakeSample("torus", {.triangles = 1000, .scale = 0}).status().message()),
              testing::HasSubstr("scale 0"));
}

}  // namespace
}  // namespace ndmap

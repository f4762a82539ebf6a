// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/geometry/parity.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Side_of_triangle_mesh.h>
#include <CGAL/Surface_mesh.h>

#include <cmath>
#include <random>

#include "core/io/sample_surface.h"
#include "gtest/gtest.h"

namespace ndmap {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;

// Compares both ways to find parity with CGAL's, for points that are not on the surface; the number of those
// inside.
int CompareWithCgal(const TriangleSurface& s, const std::vector<Point3>& points) {
  std::vector<Kernel::Point_3> corners;
  for (const Point3& p : s.points) corners.emplace_back(p[0], p[1], p[2]);
  Mesh mesh;
  CGAL::Polygon_mesh_processing::polygon_soup_to_polygon_mesh(corners, s.triangles, mesh);
  const CGAL::Side_of_triangle_mesh<Mesh, Kernel> side(mesh);
  const ParityIndex index(std::make_shared<TriangleSurface>(s));
  int inside = 0;
  for (const Point3& p : points) {
    const CGAL::Bounded_side expected = side(Kernel::Point_3(p[0], p[1], p[2]));
    if (expected == CGAL::ON_BOUNDARY) continue;
    const bool got = InsideByParity(s, p);
    EXPECT_EQ(got, expected == CGAL::ON_BOUNDED_SIDE) << p[0] << " " << p[1] << " " << p[2];
    EXPECT_EQ(index.Inside(p), got) << p[0] << " " << p[1] << " " << p[2];
    inside += got;
  }
  return inside;
}

// Points with all coordinates in 2 lo / 2 ... 2 hi / 2 in steps of a half.
std::vector<Point3> HalfLattice(int lo, int hi) {
  std::vector<Point3> points;
  for (int x = 2 * lo; x <= 2 * hi; ++x) {
    for (int y = 2 * lo; y <= 2 * hi; ++y) {
      for (int z = 2 * lo; z <= 2 * hi; ++z) points.push_back({x / 2.0, y / 2.0, z / 2.0});
    }
  }
  return points;
}

TEST(ParityTest, RandomPointsOnEverySample) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> coordinate(-1.6, 1.6);
  for (const std::string& kind : SampleKinds()) {
    SCOPED_TRACE(kind);
    std::vector<Point3> points(500);
    for (Point3& p : points) p = {coordinate(random), coordinate(random), coordinate(random) / 2};
    EXPECT_GT(CompareWithCgal(*MakeSample(kind, {.triangles = 2000, .scale = 1}), points), 20);
  }
}

// The rays run through corners, along edges and within faces of these.
TEST(ParityTest, PointsAlignedWithCornersAndEdges) {
  TriangleSurface octahedra = *MakeSample("sphere", {.triangles = 100, .scale = 1});
  for (double scale : {5.0, 3.0}) {
    for (Point3& p : octahedra.points) {
      const double sum = std::fabs(p[0]) + std::fabs(p[1]) + std::fabs(p[2]);
      for (double& x : p) x = std::round(scale * x / sum * 4) / 4;
    }
    EXPECT_GT(CompareWithCgal(octahedra, HalfLattice(-6, 6)), 100);
  }
  // The double torus without smoothing has axis-parallel faces: few enough triangles mean no round of
  // smoothing.
  TriangleSurface plate = *MakeSample("double-torus", {.triangles = 100, .scale = 2});
  for (Point3& p : plate.points) {
    for (double& x : p) x = std::round(2 * x) / 2;
  }
  CompareWithCgal(plate, HalfLattice(-3, 3));
}

TEST(ParityTest, IntegerTorusAndNestedBoxes) {
  TriangleSurface torus = *MakeSample("torus", {.triangles = 1000, .scale = 8});
  for (Point3& p : torus.points) {
    for (double& x : p) x = std::round(x);
  }
  // Rounding leaves triangles without area, which CGAL's way does not take: the volume (2 pi^2 8 3.2^2 =
  // 1617, eight points of the lattice for each unit) and the axis of the hole are known.
  const ParityIndex index(std::make_shared<TriangleSurface>(torus));
  int inside = 0;
  for (const Point3& p : HalfLattice(-12, 12)) {
    EXPECT_EQ(InsideByParity(torus, p), index.Inside(p));
    inside += index.Inside(p);
  }
  EXPECT_GT(inside, 8 * 1400);
  EXPECT_LT(inside, 8 * 1800);
  for (int z = -8; z <= 8; ++z) EXPECT_FALSE(InsideByParity(torus, {0, 0, z / 2.0}));

  // Boxes of side 2, 4, 6 … around each other: inside changes at each.
  TriangleSurface boxes;
  for (int half = 1; half <= 5; ++half) {
    const uint32_t first = static_cast<uint32_t>(boxes.points.size());
    for (int k = 0; k < 8; ++k) {
      boxes.points.push_back(
          {half * (k & 1 ? 1.0 : -1.0), half * (k & 2 ? 1.0 : -1.0), half * (k & 4 ? 1.0 : -1.0)});
    }
    for (const std::array<uint32_t, 4>& q : {std::array<uint32_t, 4>{0, 2, 3, 1},
                                             {4, 5, 7, 6},
                                             {0, 1, 5, 4},
                                             {2, 6, 7, 3},
                                             {0, 4, 6, 2},
                                             {1, 3, 7, 5}}) {
      boxes.triangles.push_back({first + q[0], first + q[1], first + q[2]});
      boxes.triangles.push_back({first + q[0], first + q[2], first + q[3]});
    }
  }
  ASSERT_TRUE(ValidateClosedSurface(boxes).ok());
  const ParityIndex box_index(std::make_shared<TriangleSurface>(boxes));
  for (const Point3& p : HalfLattice(-6, 6)) {
    const double ring = std::max({std::fabs(p[0]), std::fabs(p[1]), std::fabs(p[2])});
    if (ring == std::floor(ring) && ring >= 1 && ring <= 5) continue;  // On a box.
    const bool expected = ring < 5 && (5 - static_cast<int>(std::floor(ring))) % 2 == 1;
    EXPECT_EQ(InsideByParity(boxes, p), expected) << p[0] << " " << p[1] << " " << p[2];
    EXPECT_EQ(box_index.Inside(p), expected) << p[0] << " " << p[1] << " " << p[2];
  }
}

TEST(ParityTest, TrianglesThatSpanEverythingDoNotBlowUpTheIndex) {
  // 20,000 slivers between two points: a lens, closed, each triangle's extent that of the whole.
  TriangleSurface lens;
  lens.points = {{0, -1, -1}, {0, 1, 1}};
  const uint32_t n = 10000;
  for (uint32_t i = 0; i < n; ++i) {
    const double angle = 2 * std::acos(-1) * i / n;
    lens.points.push_back({std::cos(angle), std::sin(angle), -std::sin(angle)});
    const uint32_t a = 2 + i, b = 2 + (i + 1) % n;
    lens.triangles.push_back({0, b, a});
    lens.triangles.push_back({1, a, b});
  }
  ASSERT_TRUE(ValidateClosedSurface(lens).ok());
  const ParityIndex index(std::make_shared<TriangleSurface>(lens));
  EXPECT_TRUE(index.Inside({0, 0, 0}));
  EXPECT_TRUE(InsideByParity(lens, {0, 0, 0}));
  EXPECT_FALSE(index.Inside({1.5, 0, 0}));
  EXPECT_FALSE(index.Inside({-0.6, 0.6, 0.6}));
  EXPECT_FALSE(index.Inside({-1.5, 0, 0}));
}

}  // namespace
}  // namespace ndmap

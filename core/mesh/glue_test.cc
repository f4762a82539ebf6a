// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <limits>
#include <random>
#include <set>
#include <string>

#include "core/mesh/cell_geometry.h"
#include "core/mesh/mesh_testing.h"
#include "core/mesh/volume_mesh.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"

namespace ndmap {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr CellKind kKinds[] = {CellKind::kTetrahedron, CellKind::kPyramid, CellKind::kPrism,
                               CellKind::kHexahedron};

std::string WhyNotGlued(const VolumeMesh& mesh, const GlueOptions& options = {}) {
  const auto glued = Glue(mesh, options);
  if (glued.ok()) return "accepted";
  EXPECT_EQ(glued.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(glued.status().message()), ::testing::Not(HasSubstr("\n")));
  return std::string(glued.status().message());
}

// What FaceLink promises, for every face; how many faces are glued.
uint64_t CheckLinks(const GluedMesh& glued) {
  const VolumeMesh& mesh = glued.mesh;
  uint64_t sides = 0, boundary = 0;
  for (uint32_t c = 0; c < mesh.cells(); ++c) {
    const CellShape& shape = ShapeOf(mesh.kinds[c]);
    for (uint8_t f = 0; f < shape.faces; ++f) {
      const FaceLink& link = glued.Link(c, f);
      if (link.boundary()) {
        ++boundary;
        continue;
      }
      ++sides;
      const int k = shape.face_corners[f];
      for (int i = 0; i < k; ++i) {
        EXPECT_EQ(mesh.FacePoint(c, f, i), mesh.FacePoint(link.cell, link.face, (link.turn + k - i) % k));
        // The dart that ours is glued to runs along the same edge the other way.
        const int other = (link.turn + 2 * k - i - 1) % k;
        EXPECT_EQ(mesh.FacePoint(c, f, i), mesh.FacePoint(link.cell, link.face, (other + 1) % k));
        EXPECT_EQ(mesh.FacePoint(c, f, (i + 1) % k), mesh.FacePoint(link.cell, link.face, other));
      }
      const FaceLink& back = glued.Link(link.cell, link.face);
      EXPECT_EQ(back.cell, c);
      EXPECT_EQ(back.face, f);
    }
  }
  EXPECT_EQ(boundary, glued.boundary_faces);
  return sides / 2;
}

TEST(CellShapeTest, FacesPointOutwardAndCloseTheCell) {
  for (CellKind kind : kKinds) {
    const CellShape& shape = ShapeOf(kind);
    const auto corners = UnitCorners(kind);
    ASSERT_EQ(corners.size(), shape.corners);
    Point3 middle{};
    for (const Point3& p : corners) {
      for (int x = 0; x < 3; ++x) middle[x] += p[x] / shape.corners;
    }
    for (uint8_t f = 0; f < shape.faces; ++f) {
      const Point3 &a = corners[shape.face[f][0]], &b = corners[shape.face[f][1]],
                   &c = corners[shape.face[f][2]];
      double outward = 0;
      for (int x = 0; x < 3; ++x) {
        const int y = (x + 1) % 3, z = (x + 2) % 3;
        outward += ((b[y] - a[y]) * (c[z] - a[z]) - (b[z] - a[z]) * (c[y] - a[y])) * (a[x] - middle[x]);
      }
      EXPECT_GT(outward, 0) << shape.name << " face " << int{f};
      for (uint8_t i = 0; i < shape.face_corners[f]; ++i) {
        const LocalDart other = shape.Opposite({f, i});
        EXPECT_NE(other.face, f);
        EXPECT_EQ(shape.Opposite(other), (LocalDart{f, i}));
      }
    }
  }
}

TEST(CellGeometryTest, VolumesAndCornersOfUnitCells) {
  const double volumes[] = {1.0 / 6, 1.0 / 3, 1.0 / 2, 1};
  for (CellKind kind : kKinds) {
    auto corners = UnitCorners(kind);
    EXPECT_DOUBLE_EQ(CellVolume(kind, corners), volumes[static_cast<int>(kind)]);
    EXPECT_EQ(Soundness(kind, corners), CellSoundness::kSound);
    EXPECT_GT(ScaledJacobians(kind, corners).smallest, 0);
    for (Point3& p : corners) p[2] = -p[2];
    EXPECT_DOUBLE_EQ(CellVolume(kind, corners), -volumes[static_cast<int>(kind)]);
    EXPECT_EQ(Soundness(kind, corners), CellSoundness::kInverted);
    EXPECT_LT(ScaledJacobians(kind, corners).largest, 0);
    for (Point3& p : corners) p[2] = 0.5;
    EXPECT_EQ(Soundness(kind, corners), CellSoundness::kFlat);
  }
  const auto cube = ScaledJacobians(CellKind::kHexahedron, UnitCorners(CellKind::kHexahedron));
  EXPECT_EQ(cube.smallest, 1);
  const std::vector<Point3> regular = {{1, 1, 1}, {-1, 1, -1}, {1, -1, -1}, {-1, -1, 1}};
  EXPECT_NEAR(ScaledJacobians(CellKind::kTetrahedron, regular).smallest, std::sqrt(0.5), 1e-15);
}

TEST(CellGeometryTest, ThinIsNotFlatAndFarAwayIsNotFlat) {
  auto corners = UnitCorners(CellKind::kPrism);
  for (Point3& p : corners) p[2] *= 1e-9;
  EXPECT_EQ(Soundness(CellKind::kPrism, corners), CellSoundness::kSound);
  for (CellKind kind : kKinds) {
    corners = UnitCorners(kind);
    for (Point3& p : corners) p[0] = 1e-3 * p[0] + 1e9;
    EXPECT_EQ(Soundness(kind, corners), CellSoundness::kSound);
  }
}

TEST(GlueTest, OneCellOfEachKindHasOnlyBoundary) {
  for (CellKind kind : kKinds) {
    const auto glued = Glue(UnitMesh(kind));
    ASSERT_TRUE(glued.ok()) << glued.status();
    EXPECT_EQ(glued->boundary_faces, ShapeOf(kind).faces);
    EXPECT_EQ(CheckLinks(*glued), 0u);
    EXPECT_THAT(glued->notes, IsEmpty());
    EXPECT_THAT(glued->warnings, IsEmpty());
  }
}

TEST(GlueTest, Cubes) {
  const auto glued = Glue(CubeMesh(3, 4, 5));
  ASSERT_TRUE(glued.ok()) << glued.status();
  EXPECT_EQ(CheckLinks(*glued), 2u * 4 * 5 + 3 * 3 * 5 + 3 * 4 * 4);
  EXPECT_EQ(glued->boundary_faces, 2u * (12 + 15 + 20));
  // x fastest: the face with larger x of the first cube leads to the second.
  EXPECT_EQ(glued->Link(0, 3).cell, 1u);
  EXPECT_EQ(glued->Link(0, 3).face, 5);
}

TEST(GlueTest, OneOfEachKindGluedToAnother) {
  const auto glued = Glue(OneOfEach());
  ASSERT_TRUE(glued.ok()) << glued.status();
  EXPECT_EQ(CheckLinks(*glued), 4u);
  EXPECT_EQ(glued->boundary_faces, 6u + 5 + 5 + 4 - 8);
  EXPECT_THAT(glued->warnings, IsEmpty());
}

// However each cell's listing begins, and in whatever order cells come.
TEST(GlueTest, AnyListingOfTheSameCells) {
  std::mt19937 random(7);
  // Turns of a cell into itself, as the corner that comes to each place.
  const std::vector<std::vector<uint32_t>> turns = {{1, 2, 3, 0, 5, 6, 7, 4}, {4, 0, 3, 7, 5, 1, 2, 6}};
  for (int trial = 0; trial < 20; ++trial) {
    VolumeMesh given = CubeMesh(3, 3, 3), mesh;
    mesh.points = given.points;
    std::vector<uint32_t> order(given.cells());
    for (uint32_t c = 0; c < order.size(); ++c) order[c] = c;
    std::shuffle(order.begin(), order.end(), random);
    for (uint32_t c : order) {
      std::vector<uint32_t> corners(given.Corners(c).begin(), given.Corners(c).end());
      for (unsigned n = random() % 12; n > 0; --n) {
        std::vector<uint32_t> turned;
        for (uint32_t place : turns[random() % 2]) turned.push_back(corners[place]);
        corners = turned;
      }
      mesh.AddCell(CellKind::kHexahedron, corners);
    }
    const auto glued = Glue(mesh);
    ASSERT_TRUE(glued.ok()) << glued.status();
    EXPECT_EQ(CheckLinks(*glued), 54u);
  }
}

TEST(GlueFaultTest, NoCellsAndArraysThatDoNotFit) {
  EXPECT_EQ(WhyNotGlued({}), "has no tetrahedra, pyramids, prisms or hexahedra");
  VolumeMesh mesh = UnitMesh(CellKind::kHexahedron);
  mesh.kinds[0] = CellKind::kPrism;
  EXPECT_EQ(WhyNotGlued(mesh), "prism 0 has not the 6 corners of its kind");
  mesh.kinds[0] = static_cast<CellKind>(9);
  EXPECT_EQ(WhyNotGlued(mesh), "cell 0 is of no known kind");
  mesh = UnitMesh(CellKind::kHexahedron);
  mesh.begins = {0};
  EXPECT_EQ(WhyNotGlued(mesh), "its arrays of cells, corners and numbers do not fit together");
  mesh = UnitMesh(CellKind::kHexahedron);
  mesh.source.points = {1};
  EXPECT_EQ(WhyNotGlued(mesh), "its arrays of cells, corners and numbers do not fit together");
}

TEST(GlueFaultTest, IndexOutOfRangeAndCoordinateNotFinite) {
  VolumeMesh mesh = UnitMesh(CellKind::kPyramid);
  mesh.corners[4] = 5;
  mesh.source = {"a.msh", "counted from 1", {7}, {}, 0, 1};
  EXPECT_EQ(WhyNotGlued(mesh),
            "a.msh: pyramid 7 (counted from 1) has a corner at index 6, out of range; there are 5 points");
  mesh = UnitMesh(CellKind::kPyramid);
  mesh.points[2][1] = std::numeric_limits<double>::infinity();
  EXPECT_EQ(WhyNotGlued(mesh), "point 2 has a coordinate that is not finite");
  mesh.points[2][1] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(WhyNotGlued(mesh), "point 2 has a coordinate that is not finite");
}

TEST(GlueFaultTest, RepeatedCornerAndRepeatedCell) {
  VolumeMesh mesh = CubeMesh(2, 1, 1);
  mesh.corners[1] = mesh.corners[0];
  EXPECT_THAT(WhyNotGlued(mesh), HasSubstr("1 cell comes to the same point twice: hexahedron 0; write"));
  mesh = CubeMesh(2, 1, 1);
  const auto cell = mesh.Corners(1);
  mesh.AddCell(CellKind::kHexahedron, std::vector<uint32_t>(cell.begin(), cell.end()));
  EXPECT_EQ(
      WhyNotGlued(mesh),
      "1 cell has the same corners as another: hexahedron 2 those of hexahedron 1; leave out the second one");
}

TEST(GlueFaultTest, InvertedFlatAndConcave) {
  for (CellKind kind : kKinds) {
    VolumeMesh mesh = UnitMesh(kind);
    for (Point3& p : mesh.points) p[0] = -p[0];
    const std::string name(ShapeOf(kind).name);
    EXPECT_THAT(WhyNotGlued(mesh),
                HasSubstr("1 cell is turned inside out, all there are: " + name + " 0; list"));
    for (Point3& p : mesh.points) p[0] = p[1];
    EXPECT_THAT(WhyNotGlued(mesh), HasSubstr("1 cell has no volume: " + name + " 0; take it out"));
  }
  VolumeMesh mesh = CubeMesh(10, 1, 1);
  for (int c = 1; c < 10; ++c) {
    for (int i = 0; i < 4; ++i) std::swap(mesh.corners[8 * c + i], mesh.corners[8 * c + 4 + i]);
    mesh.source.cells.push_back(100 + c);
  }
  mesh.source.cells.insert(mesh.source.cells.begin(), 5);
  mesh.source.numbering = "by number";
  EXPECT_THAT(WhyNotGlued(mesh),
              HasSubstr("9 cells are turned inside out: hexahedron 101, hexahedron 102, hexahedron 103, "
                        "hexahedron 104, hexahedron 105 and 4 more (by number); list"));
  // One corner drawn into the cube beyond the plane of its neighbours.
  mesh = UnitMesh(CellKind::kHexahedron);
  mesh.points[6] = {0.3, 0.3, 0.3};
  EXPECT_THAT(WhyNotGlued(mesh),
              HasSubstr("1 cell has a corner whose edges lie in a plane or stand the wrong way round: "
                        "hexahedron 0; smooth"));
  const auto glued = Glue(mesh, {.allow_concave = true});
  ASSERT_TRUE(glued.ok()) << glued.status();
  EXPECT_THAT(glued->warnings, ElementsAre(HasSubstr("1 cell has a corner")));
}

// A third cube at a face: it reaches into one of the two, which combinatorics does not see but the face does.
TEST(GlueFaultTest, FaceOfThreeCells) {
  VolumeMesh mesh = CubeMesh(2, 1, 1);
  mesh.source.points = {10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20, 21};
  for (int i = 0; i < 4; ++i) {
    const Point3& p = mesh.points[2 + 3 * i];
    mesh.points.push_back({p[0] - 0.5, p[1], p[2]});
    mesh.source.points.push_back(22 + i);
  }
  AddTo(&mesh, CellKind::kHexahedron, {1, 12, 13, 4, 7, 14, 15, 10});
  EXPECT_EQ(WhyNotGlued(mesh),
            "1 face has more than two cells, the face of points 11, 14, 20 and 17 of hexahedron 0, "
            "hexahedron 1 and "
            "hexahedron 2; a volume mesh has at most one cell on either side of a face");
}

TEST(GlueFaultTest, TwoCellsOnTheSameSide) {
  VolumeMesh mesh = UnitMesh(CellKind::kTetrahedron);
  mesh.points.push_back({0.1, 0.2, 0.7});
  AddTo(&mesh, CellKind::kTetrahedron, {0, 1, 2, 4});
  EXPECT_EQ(WhyNotGlued(mesh),
            "1 face has both its cells on the same side, the face of points 0, 2 and 1 of tetrahedron 0 and "
            "tetrahedron 1; they overlap, or the corners of one are listed inside out");
}

// A quadrilateral whose second cell goes around it in another order; both cells have a positive volume.
TEST(GlueFaultTest, QuadrilateralInTwoOrders) {
  VolumeMesh mesh;
  mesh.points = {{0, 0, 0}, {1, 0, 0}, {2, 2, 0}, {0, 1, 0}, {0.5, 0.5, 5}, {0.5, 0.5, -5}};
  AddTo(&mesh, CellKind::kPyramid, {0, 1, 2, 3, 4});
  AddTo(&mesh, CellKind::kPyramid, {0, 2, 1, 3, 5});
  EXPECT_EQ(WhyNotGlued(mesh, {.allow_concave = true}),
            "1 quadrilateral is listed with its corners in two different orders, the face of points 0, 3, 2 "
            "and 1 of "
            "pyramid 0 and pyramid 1; one of the two cells is twisted");
}

TEST(GlueTest, UnusedPointsGoWithANote) {
  VolumeMesh mesh = UnitMesh(CellKind::kTetrahedron);
  mesh.points.insert(mesh.points.begin() + 1, Point3{9, 9, 9});
  mesh.corners = {0, 2, 3, 4};
  const auto glued = Glue(mesh);
  ASSERT_TRUE(glued.ok()) << glued.status();
  EXPECT_THAT(glued->notes, ElementsAre("left out 1 point that no cell uses"));
  EXPECT_EQ(glued->mesh.points, UnitCorners(CellKind::kTetrahedron));
  EXPECT_THAT(glued->mesh.source.points, ElementsAre(0, 2, 3, 4));
  EXPECT_THAT(glued->mesh.corners, ElementsAre(0, 1, 2, 3));
}

TEST(GlueTest, EqualPointsAreWarnedOfOrMerged) {
  VolumeMesh mesh = CubeMesh(1, 1, 1);
  const VolumeMesh second = CubeMesh(1, 1, 1);
  for (Point3 p : second.points) {
    p[0] += 1;
    p[1] = p[1] == 0 ? -0.0 : p[1];
    mesh.points.push_back(p);
  }
  std::vector<uint32_t> corners(second.corners.begin(), second.corners.end());
  for (uint32_t& corner : corners) corner += 8;
  mesh.AddCell(CellKind::kHexahedron, corners);
  auto glued = Glue(mesh);
  ASSERT_TRUE(glued.ok()) << glued.status();
  EXPECT_EQ(CheckLinks(*glued), 0u);
  EXPECT_THAT(glued->warnings,
              ElementsAre("4 points lie where another does, as point 8 and point 1: cells are not "
                          "glued across them unless equal points are merged"));
  glued = Glue(mesh, {.merge_equal_points = true});
  ASSERT_TRUE(glued.ok()) << glued.status();
  EXPECT_EQ(CheckLinks(*glued), 1u);
  EXPECT_EQ(glued->mesh.points.size(), 12u);
  EXPECT_THAT(glued->notes, ElementsAre("merged 4 points with another of equal coordinates"));
  EXPECT_THAT(glued->warnings, IsEmpty());
}

TEST(GlueTest, QuadrilateralAgainstTwoTrianglesIsWarnedOf) {
  VolumeMesh mesh = UnitMesh(CellKind::kHexahedron);
  mesh.points.push_back({0.5, 0.5, 2});
  AddTo(&mesh, CellKind::kTetrahedron, {4, 5, 6, 8});
  AddTo(&mesh, CellKind::kTetrahedron, {4, 6, 7, 8});
  const auto glued = Glue(mesh);
  ASSERT_TRUE(glued.ok()) << glued.status();
  EXPECT_THAT(
      glued->warnings,
      ElementsAre(
          "1 quadrilateral meets triangles of other cells and cannot be glued to them: of hexahedron 0"));
}

}  // namespace
}  // namespace ndmap

// SPDX-License-Identifier: GPL-3.0-or-later
// What a file says of a surface: what is closed and orientable, what is mended, what is warned about.
#include "absl/strings/str_cat.h"
#include "core/io/sample_surface.h"
#include "core/io/surface_reader_testing.h"

namespace ndmap {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

TEST_F(SurfaceReaderTest, NotClosedInEveryFormat) {
  const std::string says = "not closed: 3 edges without exactly two faces (3 with one, in 1 border cycle)";
  EXPECT_THAT(Error("a.off", With(With(kOff, "4 4 6", "4 3 6"), "3 0 3 2\n", "")), StartsWith(says));
  EXPECT_THAT(Error("a.obj", With(kObj, "f -4 -1 -2\n", "")), StartsWith(says));
  EXPECT_THAT(Error("a.ply", With(With(PlyText(), "face 4", "face 3"), "3 0 3 2\n", "")), StartsWith(says));
  const std::string stl = StlText();
  const size_t last = stl.rfind(" facet normal");
  EXPECT_THAT(Error("a.stl", stl.substr(0, last) + "endsolid\n"), StartsWith(says));
  std::string binary = StlBinary().substr(0, 84 + 150);
  binary[80] = 3;
  EXPECT_THAT(Error("b.stl", binary), StartsWith(says));
}

// Two tetrahedra with an edge in common: four faces at it.
TEST_F(SurfaceReaderTest, FourFacesAtAnEdge) {
  const std::string two =
      absl::StrCat("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n",
                   "v 0 0 0\nv -1 0 0\nv 0 -1 0\nv 0 0 1\nf 5 7 6\nf 5 6 8\nf 6 7 8\nf 5 8 7\n");
  EXPECT_EQ(
      Error("a.obj", two),
      "not a surface: 1 edge has more than two faces; the edge between points 0 and 3 has faces 1, 3, 5 "
      "and 7; it has them because equal points were merged, 2 in all, here point 4 with point 0: parts "
      "may touch in a point, not along an edge");
  // The file itself lets three faces have one edge: nothing that was merged is to blame. A face that is
  // dropped does not change the numbers of the others.
  const std::string fin = absl::StrCat("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv -1 -1 0\nf 1 1 2\n",
                                       "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\nf 1 4 5\n");
  EXPECT_EQ(Error("a.obj", fin),
            "not closed: 3 edges without exactly two faces (2 with one, in 1 border cycle; 1 with more than "
            "two), for example between points 0 and 3; the edge between points 0 and 3 has faces 2, 4 and 5");
}

// Two tetrahedra with a corner in common are fine.
TEST_F(SurfaceReaderTest, ComponentsThatTouchInACorner) {
  const auto file = ReadSurface(Write(
      "a.obj",
      absl::StrCat(kObj, "v 0 0 0\nv -1 0 0\nv 0 -1 0\nv 0 0 -1\nf 5 7 6\nf 5 6 8\nf 6 7 8\nf 5 8 7\n")));
  ASSERT_TRUE(file.ok()) << file.status();
  EXPECT_EQ(file->surface.points.size(), 7u);
  EXPECT_THAT(file->notes, testing::Contains("merged 1 duplicate points"));
}

// A Klein bottle: a grid of quads whose one side is glued in reverse.
TEST_F(SurfaceReaderTest, NotOrientable) {
  constexpr int n = 6;
  const auto point = [](int i, int j) {
    if (i == n) return (n - j) % n + 1;
    return i * n + j % n + 1;
  };
  std::string obj;
  for (int p = 0; p < n * n; ++p) absl::StrAppend(&obj, "v ", p % 7, " ", p * p % 11, " ", p, "\n");
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      absl::StrAppend(&obj, "f ", point(i, j), " ", point(i + 1, j), " ", point(i + 1, j + 1), "\nf ",
                      point(i, j), " ", point(i + 1, j + 1), " ", point(i, j + 1), "\n");
    }
  }
  EXPECT_THAT(Error("klein.obj", obj),
              StartsWith("not orientable: its faces cannot be turned alike, for example"));
}

TEST_F(SurfaceReaderTest, MendsWithANote) {
  // Face 1 turned, a point twice, one without faces, a face between two points.
  const auto file = ReadSurface(Write("a.off",
                                      "OFF\n6 5 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 -0.0\n9 9 9\n3 0 2 1\n3 0 "
                                      "3 4\n3 1 2 3\n3 0 3 2\n3 1 4 2\n"));
  ASSERT_TRUE(file.ok()) << file.status();
  EXPECT_THAT(file->notes,
              ElementsAre("merged 1 duplicate points", "dropped 1 degenerate faces",
                          "turned 1 faces to agree on the outside", "dropped 1 points without faces"));
  EXPECT_TRUE(ValidateClosedSurface(file->surface).ok());
  EXPECT_EQ(file->surface.points.size(), 4u);
}

double Volume(const TriangleSurface& s) {
  double six = 0;
  for (const auto& [i, j, k] : s.triangles) {
    const Point3 &a = s.points[i], &b = s.points[j], &c = s.points[k];
    six += a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) +
           a[2] * (b[0] * c[1] - b[1] * c[0]);
  }
  return six / 6;
}

TEST_F(SurfaceReaderTest, OrientsOutwardAlsoInCavities) {
  const TriangleSurface shells = *MakeSample("shells", {.triangles = 2000, .scale = 1});
  TriangleSurface turned = shells;
  for (size_t t = 0; t < turned.triangles.size(); ++t) {
    if (t % 3 != 0) std::swap(turned.triangles[t][0], turned.triangles[t][1]);
  }
  const auto file = ReadSurfaceFromBytes(OffText(turned), SurfaceFormat::kOff);
  ASSERT_TRUE(file.ok()) << file.status();
  EXPECT_NEAR(Volume(file->surface), Volume(shells), 1e-12);
  EXPECT_GT(Volume(file->surface), 3);
}

// Concave polygons: an extruded U of 8 corners, with the base in one polygon.
TEST_F(SurfaceReaderTest, ConcavePolygonsAreCut) {
  const int u[8][2] = {{0, 0}, {3, 0}, {3, 3}, {2, 3}, {2, 1}, {1, 1}, {1, 3}, {0, 3}};
  std::string off = "OFF\n16 10 0\n";
  for (int z : {0, 1}) {
    for (const auto& p : u) absl::StrAppend(&off, p[0], " ", p[1], " ", z, "\n");
  }
  absl::StrAppend(&off, "8 7 6 5 4 3 2 1 0\n8 8 9 10 11 12 13 14 15\n");
  for (int i = 0; i < 8; ++i)
    absl::StrAppend(&off, "4 ", i, " ", (i + 1) % 8, " ", (i + 1) % 8 + 8, " ", i + 8, "\n");
  const auto file = ReadSurface(Write("u.off", off));
  ASSERT_TRUE(file.ok()) << file.status();
  EXPECT_EQ(file->surface.triangles.size(), 28u);
  EXPECT_THAT(file->notes, ElementsAre("cut 10 polygons into triangles"));
  EXPECT_THAT(file->warnings, IsEmpty());
  EXPECT_DOUBLE_EQ(Volume(file->surface), 7);
}

TEST_F(SurfaceReaderTest, PolygonsThatCannotBeCut) {
  EXPECT_THAT(Error("twice.off", With(kOff, "3 1 2 3", "5 1 2 3 1 0")),
              HasSubstr("face 2 comes to point 1 twice"));
  EXPECT_THAT(
      Error("star.off", "OFF\n5 2 0\n0 10 0\n6 -8 0\n-9 3 0\n9 3 0\n-6 -8 0\n5 0 1 2 3 4\n5 4 3 2 1 0\n"),
      HasSubstr("a face of 5 corners that begins with points 0, 1 and 2 crosses itself"));
}

TEST_F(SurfaceReaderTest, SelfIntersectionIsAWarning) {
  TriangleSurface two = *MakeSample("sphere", {.triangles = 300, .scale = 1});
  const size_t points = two.points.size(), triangles = two.triangles.size();
  for (size_t i = 0; i < points; ++i)
    two.points.push_back({two.points[i][0] + 0.7, two.points[i][1], two.points[i][2] + 0.1});
  for (size_t t = 0; t < triangles; ++t) {
    std::array<uint32_t, 3> triangle = two.triangles[t];
    for (uint32_t& corner : triangle) corner += static_cast<uint32_t>(points);
    two.triangles.push_back(triangle);
  }
  const auto file = ReadSurfaceFromBytes(OffText(two), SurfaceFormat::kOff);
  ASSERT_TRUE(file.ok()) << file.status();
  EXPECT_THAT(file->warnings,
              ElementsAre(AllOf(StartsWith("intersects itself: "),
                                HasSubstr("pairs of triangles; parity decides what is inside"))));
  ReadLimits limits;
  limits.check_self_intersections = false;
  EXPECT_THAT(ReadSurfaceFromBytes(OffText(two), SurfaceFormat::kOff, limits)->warnings, IsEmpty());
}

TEST_F(SurfaceReaderTest, SmallComponentsAreNamed) {
  const TriangleSurface shells = *MakeSample("shells", {.triangles = 1000, .scale = 1});
  EXPECT_THAT(WarnSmallComponents(shells, 0.4), IsEmpty());
  EXPECT_THAT(WarnSmallComponents(shells, 0.6), ElementsAre(StartsWith("component 2 of 3 (")));
  EXPECT_EQ(WarnSmallComponents(shells, 3).size(), 3u);
}

}  // namespace
}  // namespace ndmap

// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/io/polygon_reader.h"

#include <string>

#include "core/io/surface_reader_testing.h"

namespace ndmap {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

TEST(PolygonReaderTest, EveryFormatGivesTheSameTetrahedron) {
  const std::pair<SurfaceFormat, std::string> files[] = {{SurfaceFormat::kOff, kOff},
                                                         {SurfaceFormat::kObj, kObj},
                                                         {SurfaceFormat::kPly, PlyText()},
                                                         {SurfaceFormat::kPly, PlyBinary(false)},
                                                         {SurfaceFormat::kPly, PlyBinary(true)},
                                                         {SurfaceFormat::kStl, StlText()}};
  for (const auto& [format, bytes] : files) {
    const auto mesh = ReadPolygonMeshFromBytes(bytes, format);
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    EXPECT_EQ(mesh->points.size(), 4u);
    EXPECT_EQ(mesh->faces(), 4u);
    const auto glued = GluePolygons(*mesh);
    ASSERT_TRUE(glued.ok()) << glued.status();
    EXPECT_EQ(Describe(*glued).euler, 2);
    EXPECT_EQ(glued->boundary_edges, 0u);
  }
}

TEST(PolygonReaderTest, NothingIsMended) {
  // A pentagon and a triangle with a boundary; a point that nobody uses stays.
  const std::string off =
      "OFF\n7 2 0\n0 0 0\n2 0 0\n3 1 0\n1 2 0\n-1 1 0\n3 -1 0\n9 9 9\n5 0 1 2 3 4\n3 1 0 5\n";
  auto mesh = ReadPolygonMeshFromBytes(off, SurfaceFormat::kOff);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_EQ(mesh->points.size(), 7u);
  EXPECT_THAT(mesh->corners, testing::ElementsAre(0, 1, 2, 3, 4, 1, 0, 5));
  const auto glued = GluePolygons(*mesh);
  ASSERT_TRUE(glued.ok()) << glued.status();
  EXPECT_EQ(glued->boundary_edges, 6u);
  EXPECT_EQ(ReadPolygonMeshFromBytes(off, SurfaceFormat::kOff, 10).status().code(),
            absl::StatusCode::kResourceExhausted);
}

TEST_F(SurfaceReaderTest, PolygonErrorsNameFileLineAndFaces) {
  const std::string bad = Write("a.off", With(kOff, "3 0 1 3", "3 0 1 9"));
  EXPECT_EQ(ReadPolygonMesh(bad).status().message(),
            bad + ": line 8: face 1 has index 9 out of range; there are 4 points, counted from 0");
  const std::string turned = Write("b.off", With(kOff, "3 0 1 3", "3 1 0 3"));
  EXPECT_THAT(
      std::string(ReadGluedPolygons(turned).status().message()),
      StartsWith(turned + ": 3 edges are run in the same direction by their two faces, for example that of "
                          "points 0 and 1 of face 0 and face 1 (counted from 0); turn"));
  EXPECT_EQ(ReadPolygonMesh("/nowhere.off").status().code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(std::string(ReadPolygonMesh(Write("a.xyz", "x")).status().message()),
              HasSubstr("unknown extension"));
}

#ifdef NDMAP_MESHES
struct RealPolygons {
  std::string file;
  uint64_t points, faces;
  int64_t euler;
  uint64_t components, boundary_edges, boundary_cycles;
};

TEST(RealPolygonsTest, AreWhatTheirDescriptionSays) {
  const RealPolygons all[] = {
      {"3torus.off", 19, 23, -4, 1, 0, 0},
      {"double-torus-example.off", 231, 220, -2, 1, 0, 0},
      {"blade_cgal_open.off", 8231, 16222, 0, 1, 240, 2},
      {"knot2.off", 5760, 11520, 0, 2, 0, 0},
      {"gears.off", 9723, 19426, 10, 7, 0, 0},
  };
  for (const RealPolygons& real : all) {
    const auto glued = ReadGluedPolygons(std::string(NDMAP_MESHES) + "/surfaces/" + real.file);
    ASSERT_TRUE(glued.ok()) << glued.status();
    const PolygonFacts facts = Describe(*glued);
    EXPECT_EQ(facts.points, real.points) << real.file;
    EXPECT_EQ(glued->mesh.faces(), real.faces) << real.file;
    EXPECT_EQ(facts.euler, real.euler) << real.file;
    EXPECT_EQ(facts.components, real.components) << real.file;
    EXPECT_EQ(facts.boundary_edges, real.boundary_edges) << real.file;
    EXPECT_EQ(facts.boundary_cycles, real.boundary_cycles) << real.file;
    EXPECT_EQ(facts.split_points, 0u) << real.file;
  }
}
#endif

}  // namespace
}  // namespace ndmap

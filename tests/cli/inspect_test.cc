// SPDX-License-Identifier: GPL-3.0-or-later
// `ndmap inspect`: what it says of good meshes and of bad ones.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "tests/cli/command.h"

namespace ndmap::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr char kTwo[] =
    "MeshVersionFormatted 1\nDimension 3\nVertices 5\n0 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 0\n1 1 1 0\n"
    "Tetrahedra 2\n1 2 3 4 0\n2 5 3 4 0\nEnd\n";

class InspectTest : public ::testing::Test {
 protected:
  std::string Write(const std::string& name, const std::string& content) {
    std::ofstream(folder_ / name) << content;
    return folder_ / name;
  }
  TemporaryFolder folder_;
};

TEST_F(InspectTest, VolumeMeshForPeople) {
  const std::string path = Write("two.mesh", kTwo);
  const Outcome outcome = Ndmap({"inspect", path});
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  EXPECT_EQ(outcome.out, path +
                             ": a volume mesh in Medit\n"
                             "  cells       2 tetrahedra\n"
                             "  points      5\n"
                             "  whole       1 component, Euler characteristic 1\n"
                             "  boundary    6 faces in 1 component, Euler characteristic 2\n"
                             "  box         0,0,0 to 1,1,1\n"
                             "  volume      0.5\n"
                             "  worst       scaled corner Jacobian 0.5, of tetrahedron 1\n");
}

TEST_F(InspectTest, VolumeMeshAsJson) {
  const Outcome outcome = Ndmap({"--json", "inspect", Write("two.mesh", kTwo)});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const auto json = outcome.json();
  EXPECT_EQ(json["dimension"], 3);
  EXPECT_EQ(json["cells"]["tetrahedra"], 2);
  EXPECT_EQ(json["cells"]["hexahedra"], 0);
  EXPECT_EQ(json["edges"], 9);
  EXPECT_EQ(json["faces"], 7);
  EXPECT_EQ(json["boundary"]["faces"], 6);
  EXPECT_EQ(json["box"]["hi"], nlohmann::json::array({1.0, 1.0, 1.0}));
  EXPECT_EQ(json["volume"], 0.5);
  EXPECT_EQ(json["notes"].size(), 0u);
}

TEST_F(InspectTest, FaultsAreOneSentenceWithTheCells) {
  std::string bad = kTwo;
  bad.replace(bad.find("2 5 3 4"), 7, "5 2 3 4");
  const std::string path = Write("bad.mesh", bad);
  const Outcome outcome = Ndmap({"--json", "inspect", path});
  EXPECT_EQ(outcome.code, 1);
  EXPECT_EQ(outcome.out, "");
  EXPECT_EQ(outcome.error_lines(), 1);
  EXPECT_THAT(outcome.err, HasSubstr("ndmap inspect: " + path +
                                     ": 1 cell is turned inside out: tetrahedron 2 (cells of "));
  EXPECT_THAT(Ndmap({"inspect", folder_ / "none.msh"}).err, HasSubstr("no such file"));
  EXPECT_EQ(Ndmap({"inspect"}).code, 2);
}

// Two cubes whose common points are there twice, and a cube with a corner pushed in.
TEST_F(InspectTest, MergePointsAndAllowConcave) {
  const char* twice =
      "MFEM mesh v1.0\ndimension\n3\nelements\n2\n1 5 0 1 2 3 4 5 6 7\n1 5 8 9 10 11 12 13 14 "
      "15\nboundary\n0\nvertices\n"
      "16\n3\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n1 0 1\n1 1 1\n0 1 1\n1 0 0\n2 0 0\n2 1 0\n1 1 0\n1 0 1\n2 0 "
      "1\n2 1 1\n"
      "1 1 1\n";
  const std::string path = Write("twice.mesh", twice);
  const auto apart = Ndmap({"--json", "inspect", path}).json();
  EXPECT_EQ(apart["components"], 2);
  EXPECT_EQ(apart["warnings"].size(), 1u);
  const auto merged = Ndmap({"--json", "inspect", path, "--merge-points"}).json();
  EXPECT_EQ(merged["components"], 1);
  EXPECT_EQ(merged["points"], 12);
  EXPECT_EQ(merged["warnings"].size(), 0u);

  const std::string concave = Write("concave.mesh",
                                    "MFEM mesh v1.0\ndimension\n3\nelements\n1\n1 5 0 1 2 3 4 5 6 "
                                    "7\nboundary\n0\nvertices\n8\n3\n0 0 0\n1 0 0\n1 1 "
                                    "0\n0 1 0\n0 0 1\n1 0 1\n0.3 0.3 0.3\n0 1 1\n");
  EXPECT_THAT(Ndmap({"inspect", concave}).err, HasSubstr("smooth the mesh there, or allow concave cells"));
  const Outcome allowed = Ndmap({"inspect", concave, "--allow-concave"});
  EXPECT_EQ(allowed.code, 0) << allowed.err;
  EXPECT_THAT(allowed.out, HasSubstr("  warning     1 cell has a corner whose edges"));
}

TEST_F(InspectTest, SurfaceOfPolygons) {
  const std::string path =
      Write("a.off", "OFF\n6 2 0\n0 0 0\n2 0 0\n3 1 0\n1 2 0\n-1 1 0\n1 -1 0\n5 0 1 2 3 4\n3 1 0 5\n");
  EXPECT_EQ(Ndmap({"inspect", path}).out, path +
                                              ": a surface of polygons\n"
                                              "  faces       1 triangle, 1 larger polygon\n"
                                              "  points      6\n"
                                              "  whole       1 component, Euler characteristic 1\n"
                                              "  boundary    6 edges in 1 cycle\n"
                                              "  box         -1,-1,0 to 3,2,0\n"
                                              "  area        6\n");
  const auto json = Ndmap({"--json", "inspect", path}).json();
  EXPECT_EQ(json["dimension"], 2);
  EXPECT_EQ(json["boundary"]["cycles"], 1);
  EXPECT_EQ(json["cells"]["polygons"], 1);
}

#ifdef NDMAP_MESHES
TEST_F(InspectTest, RealMesh) {
  const auto json =
      Ndmap({"--json", "inspect", std::string(NDMAP_MESHES) + "/volumes/hybrid_tet_prism_pyramid.msh"})
          .json();
  EXPECT_EQ(json["cells"]["tetrahedra"], 765);
  EXPECT_EQ(json["cells"]["prisms"], 640);
  EXPECT_EQ(json["cells"]["pyramids"], 40);
  EXPECT_EQ(json["euler"], 1);
  EXPECT_THAT(json["notes"].get<std::vector<std::string>>(),
              ElementsAre(HasSubstr("left out what has fewer"), "left out 4 points that no cell uses"));
}
#endif

}  // namespace
}  // namespace ndmap::testing

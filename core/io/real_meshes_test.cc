// SPDX-License-Identifier: GPL-3.0-or-later
// Real volume meshes, where their folder is there: NDMAP_MESHES.
#include <algorithm>
#include <array>
#include <ostream>
#include <string>

#include "core/io/mesh_reader.h"
#include "core/mesh/mesh_facts.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"

namespace ndmap {
namespace {

struct RealMesh {
  std::string file;
  uint64_t points;
  std::array<uint64_t, kCellKinds> cells;  // Tetrahedra, pyramids, prisms, hexahedra.
  int boundary_euler = 2, euler = 1;
  uint64_t unused_points = 0;

  friend std::ostream& operator<<(std::ostream& out, const RealMesh& real) { return out << real.file; }
};

#ifdef NDMAP_MESHES
std::string Path(const std::string& file) { return std::string(NDMAP_MESHES) + "/volumes/" + file; }

class RealMeshTest : public testing::TestWithParam<RealMesh> {};

TEST_P(RealMeshTest, IsWhatItsDescriptionSays) {
  const RealMesh& real = GetParam();
  const auto glued = ReadGluedMesh(Path(real.file));
  ASSERT_TRUE(glued.ok()) << glued.status();
  const MeshFacts facts = Describe(*glued);
  EXPECT_EQ(facts.points, real.points);
  EXPECT_EQ(facts.cells, real.cells);
  EXPECT_EQ(facts.euler, real.euler);
  EXPECT_EQ(facts.boundary_euler, real.boundary_euler);
  EXPECT_EQ(facts.components, 1u);
  EXPECT_EQ(facts.boundary_components, 1u);
  EXPECT_EQ(facts.crowded_boundary_edges, 0u);
  EXPECT_EQ(facts.split_points + facts.split_edges, 0u);
  EXPECT_GT(facts.worst_corner, 0);
  EXPECT_THAT(glued->warnings, testing::IsEmpty());
  const std::string left_out = "left out " + std::to_string(real.unused_points) + " points that no cell uses";
  EXPECT_EQ(testing::Value(glued->notes, testing::Contains(left_out)), real.unused_points > 0);
  EXPECT_THAT(glued->notes, testing::Not(testing::Contains(testing::HasSubstr("turned"))));
}

INSTANTIATE_TEST_SUITE_P(Meshes, RealMeshTest,
                         testing::Values(RealMesh{"su2_brick_hex.msh", 16000, {0, 0, 0, 14079}},
                                         RealMesh{"su2_brick_hex.vtu", 16000, {0, 0, 0, 14079}},
                                         RealMesh{"unstructured_hex_400.msh", 573, {0, 0, 0, 400}},
                                         RealMesh{"hand_tet.mesh", 7234, {29998, 0, 0, 0}},
                                         RealMesh{"piece_tet.msh", 3915, {13179, 0, 0, 0}, 0, 0, 24},
                                         RealMesh{"nozzle_hybrid_tet_prism.msh", 3493, {4643, 0, 4614, 0}},
                                         RealMesh{"sphere_hybrid_tet_prism.msh", 1957, {2695, 0, 2556, 0}},
                                         RealMesh{
                                             "hybrid_tet_prism_pyramid.msh", 638, {765, 40, 640, 0}, 2, 1, 4},
                                         RealMesh{"fichera-mixed.mfem.mesh", 26, {5, 0, 6, 3}},
                                         RealMesh{"mixed_all4.mfem.mesh", 11, {1, 1, 1, 1}}),
                         [](const auto& info) {
                           std::string name = info.param.file;
                           const auto odd = [](char c) { return c == '-' || c == '.'; };
                           std::replace_if(name.begin(), name.end(), odd, '_');
                           return name;
                         });

TEST(RealMeshPairTest, TheSameMeshInTwoFormats) {
  const auto gmsh = ReadGluedMesh(Path("su2_brick_hex.msh")), vtu = ReadGluedMesh(Path("su2_brick_hex.vtu"));
  ASSERT_TRUE(gmsh.ok()) << gmsh.status();
  ASSERT_TRUE(vtu.ok()) << vtu.status();
  EXPECT_EQ(gmsh->mesh.points, vtu->mesh.points);
  EXPECT_EQ(gmsh->mesh.corners, vtu->mesh.corners);
  EXPECT_EQ(gmsh->links, vtu->links);
}

#endif  // NDMAP_MESHES

}  // namespace
}  // namespace ndmap

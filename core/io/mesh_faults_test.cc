// SPDX-License-Identifier: GPL-3.0-or-later
// What is wrong in a mesh file, format by format, and how it is said.
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "core/io/mesh_reader.h"
#include "core/io/mesh_reader_testing.h"
#include "core/io/mesh_refusal_testing.h"
#include "core/mesh/mesh_testing.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"

namespace ndmap {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

const VolumeMesh& OneTetrahedron() {
  static const VolumeMesh mesh = UnitMesh(CellKind::kTetrahedron);
  return mesh;
}

TEST(MeshFaultTest, NotAMeshFile) {
  EXPECT_EQ(Why(""), "is empty");
  EXPECT_EQ(Why(" \n\t"), "is empty");
  EXPECT_EQ(Why("OFF\n4 4 6\n"), "is no volume mesh that is known: VTU, Gmsh, Medit or MFEM");
  EXPECT_EQ(Why("(0 \"Fluent\")"), "looks like a Fluent mesh; save it as Gmsh 4.1 or VTU");
  EXPECT_EQ(Why("# vtk DataFile Version 3.0\n"), "is a legacy VTK file; save it as VTU");
}

TEST(MeshFaultTest, FileThatIsNotThereAndLimit) {
  EXPECT_EQ(ReadVolumeMesh("/nowhere/a.msh").status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(ReadVolumeMesh("/").status().message(), "/: is a directory");
  EXPECT_EQ(ReadVolumeMeshFromBytes(Gmsh2(OneTetrahedron()), 100).status().code(),
            absl::StatusCode::kResourceExhausted);
}

TEST(MeshFaultTest, PathStandsBeforeWhatIsWrong) {
  std::string folder = (std::filesystem::temp_directory_path() / "mesh_faults_XXXXXX").string();
  ASSERT_NE(mkdtemp(folder.data()), nullptr);
  const std::string path = folder + "/a.msh";
  VolumeMesh mesh = OneTetrahedron();
  mesh.corners = {0, 2, 1, 3};
  std::ofstream(path) << Gmsh2(mesh);
  EXPECT_THAT(
      std::string(ReadGluedMesh(path).status().message()),
      StartsWith(path +
                 ": 1 cell is turned inside out, all there are: tetrahedron 11 (by the file's element"));
  std::ofstream(path) << "$MeshFormat\n1\n";
  EXPECT_THAT(std::string(ReadGluedMesh(path).status().message()),
              StartsWith(path + ": line 2: is of Gmsh's"));
  std::ofstream(path) << Gmsh2(OneTetrahedron());
  EXPECT_TRUE(ReadGluedMesh(path).ok());
  std::filesystem::remove_all(folder);
}

TEST(GmshFaultTest, Header) {
  EXPECT_EQ(Why("$NOD\n"), "line 1: is a Gmsh 1 file; save it as version 4.1 or 2.2");
  EXPECT_EQ(Why("$MeshFormat\n4 0 8\n"),
            "line 2: is of Gmsh's format '4'; 2.0 to 2.2 and 4.1 can be read, save it as one of them");
  EXPECT_EQ(Why("$MeshFormat\n2.2 2 8\n"), "line 2: '2' stands where 0 for text or 1 for binary should be");
  EXPECT_EQ(Why("$MeshFormat\n4.1 1 4\n"), "line 2: '4' stands where 8, the size of a number, should be");
  EXPECT_EQ(Why("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n"), "truncated: the file ends without $Nodes");
  EXPECT_EQ(Why("$MeshFormat\n4.1 1 8\n\2\3\4\5\n"), "byte 24: has no 1 to tell the order of bytes by");
}

TEST(GmshFaultTest, Nodes) {
  const std::string good = Gmsh2(OneTetrahedron());
  EXPECT_EQ(Why(Change(good, "2 1 0 0\n", "2 1 x 0\n")),
            "line 11: 'x' stands where a coordinate of node 2 should be");
  EXPECT_EQ(Why(Change(good, "2 1 0 0\n", "2 1 nan 0\n")),
            "line 11: 'nan' stands where a coordinate of node 2 should be");
  EXPECT_EQ(Why(Change(good, "2 1 0 0\n", "1 1 0 0\n")), "line 11: node 1 is there twice");
  EXPECT_EQ(Why(Change(good, "2 1 0 0\n", "9 1 0 0\n1 0 0 0\n")), "line 12: node 1 is there twice");
  EXPECT_EQ(Why(Change(good, "$Nodes\n4\n", "$Nodes\n3\n")), "line 13: '4' stands where $EndNodes should be");
  EXPECT_EQ(Why(Change(good, "$Nodes\n4\n", "$Nodes\n5\n")),
            "line 14: '$EndNodes' stands where the number of node 5 of 5 should be");
  EXPECT_EQ(Why(Change(good, "$Nodes\n4\n", "$Nodes\n-4\n")),
            "line 9: '-4' stands where the number of nodes should be");
  EXPECT_EQ(Why(good + "$Nodes\n0\n$EndNodes\n"), "line 20: a second $Nodes");
  EXPECT_EQ(Why(good + "x\n"), "line 20: 'x' stands where the beginning of a section should be");
  EXPECT_EQ(Why(good + "$NodeData\n1 2 3\n"),
            "truncated: the file ends in line 20 where '$EndNodeData' should be");
}

TEST(GmshFaultTest, Elements) {
  const std::string good = Gmsh2(OneTetrahedron());
  EXPECT_EQ(Why(Change(good, "11 4 2 7 7 1 2 3 4", "11 4 2 7 7 1 2 3 5")),
            "line 18: element 11 has node 5, which is not in $Nodes");
  EXPECT_EQ(Why(Change(good, "11 4 2 7 7 1 2 3 4", "11 11 2 7 7 1 2 3 4")),
            "line 18: has tetrahedra of order 2; only cells of order 1 can be read");
  EXPECT_THAT(Why(Change(good, "11 4 2 7 7 1 2 3 4", "11 77 2 7 7 1 2 3 4")),
              StartsWith("line 18: has elements of Gmsh's type 77; tetrahedra (4)"));
  EXPECT_EQ(Why(Change(good, "11 4 2 7 7 1 2 3 4", "11 4 2 7 7 1 2 3")),
            "line 19: '$EndElements' stands where a node of element 11 should be");
  EXPECT_EQ(Why(Change(good, "11 4 2 7 7", "11 4 -2 7 7")),
            "line 18: element 2 of 2 begins a block of 1 with -2 tags each, which cannot be");
  EXPECT_EQ(
      Why(Change(good, "$Elements\n2\n", "$Elements\n9223372036854775807\n")),
      "line 19: '$EndElements' stands where the beginning of element 3 of 9223372036854775807 should be");
  EXPECT_EQ(Why(Change(good, "11 4 2 7 7 1 2 3 4", "11 2 2 7 7 1 2 3")),
            "has no tetrahedra, pyramids, prisms or hexahedra");
}

TEST(GmshFaultTest, Version4) {
  const std::string good = Gmsh4(OneTetrahedron());
  EXPECT_EQ(Why(Change(good, "$Nodes\n2 4 ", "$Nodes\n2 5 ")),
            "line 6: 5 nodes are promised, the blocks have 4");
  EXPECT_EQ(Why(Change(good, "$Elements\n2 2 ", "$Elements\n2 3 ")),
            "line 10: 3 elements are promised, the blocks have 2");
  EXPECT_EQ(Why(Change(good, "$Nodes\n2 4 ", "$Nodes\n99999999999 4 ")),
            "line 8: '$EndNodes' stands where the beginning of block 3 of 99999999999 of nodes should be");
  EXPECT_EQ(Why(Change(good, "3 1 0 2", "4 1 0 2")), "line 5: a block of nodes has 4 dimensions");
  // A count that lies, in binary: no memory is taken for it.
  std::string binary = Gmsh4(OneTetrahedron(), true);
  const size_t nodes = binary.find("$Nodes\n") + 7;
  binary.replace(nodes + 4 * 8 + 3 * 4, 8, "\xff\xff\xff\xff\xff\xff\xff\x7f");
  EXPECT_EQ(Why(binary), "byte 131: node 0 is there twice");
}

TEST(MeditFaultTest, Text) {
  const std::string good = Medit(OneTetrahedron());
  EXPECT_EQ(Why(Change(good, "Formatted 2", "Formatted 9")),
            "line 1: '9' stands where a version from 1 to 4 should be");
  EXPECT_EQ(Why(Change(good, "Dimension\n3", "Dimension\n2")), "line 4: has 2 dimensions; 3 expected");
  EXPECT_EQ(Why(Change(good, "1 0 0 0\n", "1 inf 0 0\n")),
            "line 8: 'inf' stands where a coordinate of vertex 2 of 4 should be");
  EXPECT_EQ(Why(Change(good, "1 2 3 4 7", "1 2 3 5 7")),
            "line 18: number 1 of 1 tetrahedra has vertex 5, out of range; vertices are counted from 1 to 4");
  EXPECT_EQ(Why(Change(good, "1 2 3 4 7", "0 2 3 4 7")),
            "line 18: number 1 of 1 tetrahedra has vertex 0, out of range; vertices are counted from 1 to 4");
  EXPECT_EQ(Why(Change(good, "Tetrahedra\n1", "Tetrahedra\n2")),
            "line 19: 'End' stands where a vertex of number 2 of 2 tetrahedra should be");
  EXPECT_EQ(Why(Change(good, "Tetrahedra\n1", "TetrahedraP2\n1")),
            "line 16: has TetrahedraP2; only cells of order 1 can be read");
  EXPECT_EQ(Why(good.substr(0, good.find("Vertices"))), "truncated: the file ends without Vertices");
  EXPECT_EQ(Why(Change(good, "RequiredVertices 2\n1\n2\n", "Vertices 0\n")), "line 11: a second Vertices");
  const auto cut = ReadVolumeMeshFromBytes(Change(good, "End\n", ""));
  ASSERT_TRUE(cut.ok()) << cut.status();
  EXPECT_THAT(cut->notes, testing::Contains("has no End at its end: it may have been cut off"));
}

// Cells before vertices, as the format allows: an index is checked when all is read.
TEST(MeditFaultTest, CellsFirst) {
  EXPECT_EQ(Why("MeshVersionFormatted 1\nDimension 3\nTetrahedra 1\n1 2 3 9 0\nVertices 4\n0 0 0 0\n1 0 0 "
                "0\n0 1 0 0\n"
                "0 0 1 0\nEnd\n"),
            "tetrahedron 1 (cells of each kind and vertices counted from 1) has a corner at index 9, out of "
            "range; there "
            "are 4 points");
}

TEST(MeditFaultTest, Binary) {
  const std::string good = MeditBinary(OneTetrahedron(), 2, false);
  std::string bad = good;
  bad[4] = 7;
  EXPECT_EQ(Why(bad), "byte 8: is of Medit's version 7; 1 to 4 can be read");
  bad = good;
  bad[16] = 2;
  EXPECT_EQ(Why(bad), "byte 20: has 2 dimensions; 3 expected");
  bad = good;
  bad.replace(28, 4, "\xff\xff\xff\x7f");
  EXPECT_THAT(Why(bad), StartsWith("truncated: the file ends in byte "));
  // A keyword that is skipped says that the next stands before it.
  bad = good;
  const size_t skipped = 32 + 4 * 28;
  ASSERT_EQ(bad[skipped], 15);
  bad.replace(skipped + 4, 4, std::string("\0\0\0\0", 4));
  EXPECT_THAT(Why(bad), HasSubstr("keyword 15 says that the next begins at byte 0"));
  bad = good;
  bad[skipped] = 30;
  EXPECT_THAT(Why(bad), HasSubstr("has cells of a higher order (keyword 30)"));
}

TEST(MfemFaultTest, Text) {
  const std::string good = Mfem(OneTetrahedron());
  EXPECT_EQ(Why(Change(good, "MFEM mesh v1.0", "MFEM NC mesh v1.0")),
            "line 1: is an MFEM mesh with hanging nodes; only conforming ones can be read");
  EXPECT_EQ(Why(Change(good, "MFEM mesh v1.0", "MFEM mesh v1.3")),
            "line 1: 'v1.3' stands where v1.0 should be");
  EXPECT_EQ(Why(Change(good, "dimension\n3", "dimension\n2")),
            "line 6: '2' stands where the dimension 3 should be");
  EXPECT_EQ(Why(Change(good, "1 4 0 1 2 3", "1 8 0 1 2 3")),
            "line 10: '8' stands where the geometry, 0 to 7, of element 0 should be");
  EXPECT_EQ(Why(Change(good, "1 4 0 1 2 3", "1 4 0 1 2 7")),
            "tetrahedron 0 (elements and vertices counted from 0) has a corner at index 7, out of range; "
            "there are 4 "
            "points");
  EXPECT_EQ(Why(Change(good, "1 2 0 1 2\n", "1 4 0 1 2 3\n")),
            "line 14: boundary element 0 has three dimensions");
  EXPECT_EQ(Why(Change(good, "vertices\n4\n3", "vertices\n4\nnodes")),
            "line 18: has curved cells (nodes); only straight ones can be read");
  EXPECT_EQ(Why(Change(good, "vertices\n4\n3", "vertices\n5\n3")),
            "truncated: the file ends in line 23 where a coordinate of vertex 4 of 5 should be");
  EXPECT_EQ(Why(good + "more\n"),
            "line 23: 'more' stands where dimension, elements, boundary or vertices should be");
}

}  // namespace
}  // namespace ndmap

// SPDX-License-Identifier: GPL-3.0-or-later
// Each kind of cell in each format of mesh files.
#include <functional>
#include <ostream>
#include <string>
#include <vector>

#include "absl/strings/str_replace.h"
#include "core/io/mesh_reader.h"
#include "core/io/mesh_reader_testing.h"
#include "core/mesh/mesh_testing.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"

namespace ndmap {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

struct Format {
  std::string name, says;
  std::function<std::string(const VolumeMesh&)> write;
  friend std::ostream& operator<<(std::ostream& out, const Format& format) { return out << format.name; }
};

std::vector<Format> Formats() {
  std::vector<Format> formats = {
      {"Gmsh2", "Gmsh 2.2", [](const VolumeMesh& m) { return Gmsh2(m); }},
      {"Gmsh2Binary", "Gmsh 2.2, binary", [](const VolumeMesh& m) { return Gmsh2(m, true); }},
      {"Gmsh2Swapped", "Gmsh 2.2, binary", [](const VolumeMesh& m) { return Gmsh2(m, true, true); }},
      {"Gmsh4", "Gmsh 4.1", [](const VolumeMesh& m) { return Gmsh4(m); }},
      {"Gmsh4Binary", "Gmsh 4.1, binary", [](const VolumeMesh& m) { return Gmsh4(m, true); }},
      {"Gmsh4Swapped", "Gmsh 4.1, binary", [](const VolumeMesh& m) { return Gmsh4(m, true, true); }},
      {"Medit", "Medit", [](const VolumeMesh& m) { return Medit(m); }},
      {"Mfem", "MFEM", [](const VolumeMesh& m) { return Mfem(m); }},
  };
  for (int version = 1; version <= 4; ++version) {
    for (bool swap : {false, true}) {
      formats.push_back({absl::StrCat("Medit", version, swap ? "Swapped" : "Binary"), "Medit, binary",
                         [=](const VolumeMesh& m) { return MeditBinary(m, version, swap); }});
    }
  }
  return formats;
}

class MeshFormatTest : public testing::TestWithParam<Format> {};

// Medit keeps the cells of each kind together, in the order of the kinds.
TEST_P(MeshFormatTest, ReadsWhatWasWritten) {
  VolumeMesh by_kind;
  by_kind.points = AllKinds().points;
  for (int kind = 0; kind < kCellKinds; ++kind) {
    for (uint64_t c = 0; c < AllKinds().cells(); ++c) {
      if (static_cast<int>(AllKinds().kinds[c]) == kind)
        by_kind.AddCell(AllKinds().kinds[c], AllKinds().Corners(c));
    }
  }
  for (const VolumeMesh& mesh : {by_kind, CubeMesh(3, 2, 1), UnitMesh(CellKind::kTetrahedron),
                                 UnitMesh(CellKind::kPyramid), UnitMesh(CellKind::kPrism)}) {
    const auto file = ReadVolumeMeshFromBytes(GetParam().write(mesh));
    ASSERT_TRUE(file.ok()) << file.status();
    EXPECT_EQ(file->format, GetParam().says);
    EXPECT_EQ(file->mesh.points, mesh.points);
    EXPECT_EQ(file->mesh.kinds, mesh.kinds);
    EXPECT_EQ(file->mesh.corners, mesh.corners);
    EXPECT_EQ(file->mesh.begins, mesh.begins);
    const auto glued = Glue(file->mesh);
    EXPECT_TRUE(glued.ok()) << glued.status();
  }
}

TEST_P(MeshFormatTest, PrismsInTheOtherOrderAreTurned) {
  const VolumeMesh mesh = UnitMesh(CellKind::kPrism);
  VolumeMesh other = mesh;
  other.corners = {0, 2, 1, 3, 5, 4};
  const auto file = ReadVolumeMeshFromBytes(GetParam().write(other));
  ASSERT_TRUE(file.ok()) << file.status();
  EXPECT_EQ(file->mesh.corners, mesh.corners);
  EXPECT_THAT(file->notes,
              testing::Contains(absl::StrCat("turned the one prism: their triangles are listed the other "
                                             "way round than ",
                                             GetParam().says, " says")));
}

// Cut anywhere, a file is refused, or what stands behind is not needed.
TEST_P(MeshFormatTest, CutAnywhere) {
  const std::string whole = GetParam().write(AllKinds());
  size_t refused = 0;
  for (size_t size = 0; size < whole.size(); ++size) {
    const auto file = ReadVolumeMeshFromBytes(whole.substr(0, size));
    if (file.ok()) {
      // A text file of Medit's may be cut between two of its sections; that is said.
      const bool said = testing::Value(file->notes, testing::Contains(HasSubstr("may have been cut off")));
      EXPECT_TRUE(file->mesh.cells() == 4 || said) << "cut to " << size << " of " << whole.size();
      continue;
    }
    ++refused;
    EXPECT_EQ(file.status().code(), absl::StatusCode::kInvalidArgument) << file.status();
    EXPECT_THAT(std::string(file.status().message()), testing::Not(HasSubstr("\n")));
  }
  EXPECT_GT(refused, whole.size() / 2);
}

INSTANTIATE_TEST_SUITE_P(Formats, MeshFormatTest, testing::ValuesIn(Formats()),
                         [](const auto& info) { return info.param.name; });

TEST(MeshReaderTest, SourceNamesCellsAsTheFileDoes) {
  auto file = ReadVolumeMeshFromBytes(Gmsh2(AllKinds()));
  ASSERT_TRUE(file.ok()) << file.status();
  EXPECT_THAT(file->mesh.source.cells, IsEmpty());
  EXPECT_EQ(file->mesh.source.Cell(3), 14u);
  EXPECT_EQ(file->mesh.source.Point(0), 1u);
  EXPECT_THAT(file->notes, ElementsAre("left out what has fewer than three dimensions: 1 triangles"));
  file = ReadVolumeMeshFromBytes(Gmsh4(AllKinds()));
  ASSERT_TRUE(file.ok()) << file.status();
  EXPECT_EQ(file->mesh.source.Point(4), 10u);
  VolumeMesh bad = CubeMesh(2, 1, 1);
  std::swap(bad.corners[9], bad.corners[11]);
  std::swap(bad.corners[13], bad.corners[15]);
  const auto glued = Glue(ReadVolumeMeshFromBytes(Medit(bad))->mesh);
  EXPECT_THAT(
      std::string(glued.status().message()),
      HasSubstr(
          "1 cell is turned inside out: hexahedron 2 (cells of each kind and vertices counted from 1)"));
}

// Not all prisms alike: the order of the file is not to blame.
TEST(MeshReaderTest, OnePrismOfTwoInsideOut) {
  VolumeMesh mesh = UnitMesh(CellKind::kPrism);
  mesh.points.push_back({0, 0, 2});
  mesh.points.push_back({1, 0, 2});
  mesh.points.push_back({0, 1, 2});
  AddTo(&mesh, CellKind::kPrism, {3, 5, 4, 6, 8, 7});
  const auto file = ReadVolumeMeshFromBytes(Gmsh2(mesh));
  ASSERT_TRUE(file.ok()) << file.status();
  EXPECT_THAT(std::string(Glue(file->mesh).status().message()),
              HasSubstr("1 cell is turned inside out: prism 12 (by the file's element and node numbers)"));
}

}  // namespace
}  // namespace ndmap

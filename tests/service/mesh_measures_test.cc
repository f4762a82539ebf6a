// SPDX-License-Identifier: GPL-3.0-or-later
// Counts, centres, volumes and integrals on meshes of all kinds of cells, through real services: those of the
// mesh, the same for any number of blocks and whether or not attributes are defined.
#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <optional>

#include "absl/strings/str_join.h"
#include "core/attributes/cell_measure.h"
#include "core/mesh/cell_geometry.h"
#include "tests/service/attribute_cluster.h"
#include "tests/service/mesh_cluster.h"

namespace ndmap {
namespace {

void MakeMap(AttributeCluster& cluster, const std::string& map, const reference::MeshCase& c,
             uint32_t blocks) {
  const v1::CreateMapRequest request = PutMesh(cluster, map, c.mesh, Assigned(c.mesh, blocks), blocks);
  const v1::Job created = cluster.Create(request);
  ASSERT_EQ(created.state(), v1::JOB_STATE_DONE) << created.error();
  if (c.refined.empty()) return;
  const std::string cells = absl::StrJoin(
      c.refined, " ", [](std::string* out, const CellId& id) { absl::StrAppend(out, id.ToString()); });
  const v1::Job job = cluster.Run(map, {{"refine", {{"oracle", "list"}, {"depth", "3"}, {"cells", cells}}}});
  ASSERT_EQ(job.state(), v1::JOB_STATE_DONE) << job.error();
}

v1::AggregateRequest Question(const std::string& map, uint32_t dimension, const std::string& name,
                              v1::GroupBy by) {
  v1::AggregateRequest question;
  question.set_map(map);
  question.set_dimension(dimension);
  question.set_name(name);
  question.set_group_by(by);
  question.set_integral(!name.empty() && dimension % 3 == 0);
  return question;
}

// Everything that is the same for any number of blocks.
struct Answers {
  std::vector<std::string> aggregates;
  std::array<Table, 4> tables;
};
std::vector<std::string> Names(uint32_t dimension) {
  std::vector<std::string> names = {"@point", "@level"};
  if (dimension == 3) names.push_back("@volume");
  return names;
}
Answers Ask(AttributeCluster& cluster, const std::string& map, uint32_t block) {
  Answers answers;
  for (uint32_t i = 0; i < 4; ++i) {
    std::vector<std::string> names = Names(i);
    names.push_back("");
    for (const std::string& name : names) {
      for (v1::GroupBy by : {v1::GROUP_BY_NOTHING, v1::GROUP_BY_LEVEL}) {
        const v1::AggregateRequest question = Question(map, i, name, by);
        answers.aggregates.push_back(cluster.MustAggregate(question, block).DebugString());
      }
    }
    answers.tables[i] = cluster.ReadTable(AttributeCluster::All(map, i, Names(i)), block);
  }
  return answers;
}
void ExpectSame(const Answers& a, const Answers& b) {
  EXPECT_EQ(a.aggregates, b.aggregates);
  for (size_t i = 0; i < 4; ++i) EXPECT_EQ(a.tables[i], b.tables[i]) << "dimension " << i;
}

std::string TextOf(double value) { return absl::StrCat(absl::Hex(std::bit_cast<uint64_t>(value))); }

// What the mesh itself says of its cells.
void ExpectMeasuresOf(AttributeCluster& cluster, const std::string& map, const VolumeMesh& mesh,
                      const Table& cells) {
  double volume = 0;
  size_t others = 0;
  for (uint64_t k = 0; k < mesh.cells(); ++k) {
    const CellCorners corners(mesh, k);
    volume += CellVolume(mesh.kinds[k], corners);
    if (mesh.kinds[k] == CellKind::kHexahedron) continue;
    ++others;
    const absl::Span<const Point3> points = corners;
    const Point3 centre = MeanOf(CornerPoints(points.begin(), points.end()));
    const auto row = cells.find(CellId::Initial(k));
    ASSERT_NE(row, cells.end()) << k;
    EXPECT_EQ(row->second, (std::vector<std::string>{TextOf(centre[0]), TextOf(centre[1]), TextOf(centre[2]),
                                                     "0", TextOf(CellVolume(mesh.kinds[k], corners))}))
        << CellId::Initial(k).ToString();
  }
  EXPECT_GT(others, 0u);
  // The volume over which something is integrated is that of the mesh, from cells and from vertices.
  for (uint32_t i : {0u, 3u}) {
    const v1::AggregateResponse all = cluster.MustAggregate(Question(map, i, "@level", v1::GROUP_BY_NOTHING));
    ASSERT_EQ(all.groups_size(), 1);
    EXPECT_NEAR(all.groups(0).volume(), volume, 1e-12 * (1 + std::abs(volume))) << "dimension " << i;
  }
}

TEST(MeshMeasures, AreThoseOfTheMeshForAnyNumberOfBlocksWithAndWithoutAttributes) {
  for (uint64_t seed : {4u, 20u, 40u}) {
    const reference::MeshCase c = Large(seed);
    SCOPED_TRACE(c.Describe());
    AttributeCluster cluster(3);
    std::optional<Answers> first;
    for (uint32_t blocks : {1u, 2u, 8u}) {
      SCOPED_TRACE(blocks);
      const std::string map = absl::StrCat("m", blocks);
      MakeMap(cluster, map, c, blocks);
      const Answers without = Ask(cluster, map, 0);
      if (!first) first = without;
      ExpectSame(without, *first);
      ExpectSame(Ask(cluster, map, blocks - 1), without);
      ExpectMeasuresOf(cluster, map, c.mesh, without.tables[3]);
      for (uint32_t i = 0; i < 4; ++i) {
        const v1::Job defined =
            cluster.Define(map, AttributeCluster::Attribute(absl::StrCat("a", i), i, v1::VALUE_TYPE_DOUBLE));
        ASSERT_EQ(defined.state(), v1::JOB_STATE_DONE) << defined.error();
      }
      ExpectSame(Ask(cluster, map, blocks / 2), without);
    }
  }
}

}  // namespace
}  // namespace ndmap

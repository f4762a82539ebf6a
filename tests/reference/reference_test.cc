// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/reference/reference_map.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "tests/reference/compare.h"
#include "tests/reference/random_case.h"

namespace ndmap::reference {
namespace {

Point3 Unit(uint32_t i, uint32_t j, uint32_t k) { return {double(i), double(j), double(k)}; }

struct Counts {
  unsigned vertices, edges, faces, volumes, components;
  friend bool operator==(const Counts&, const Counts&) = default;
  friend std::ostream& operator<<(std::ostream& out, const Counts& c) {
    return out << c.vertices << " vertices, " << c.edges << " edges, " << c.faces << " faces, " << c.volumes
               << " volumes, " << c.components << " components";
  }
  int Euler() const { return int(vertices) - int(edges) + int(faces) - int(volumes); }
};

Counts Count(const ReferenceMap& map) {
  const std::vector<unsigned> n = map.lcc().count_all_cells();
  return {n[0], n[1], n[2], n[3], n[4]};
}

ReferenceMap BuildCase(const RandomCase& c) {
  return ReferenceMap::Build(c.grid[0], c.grid[1], c.grid[2],
                             [&c](uint32_t i, uint32_t j, uint32_t k) { return c.Corner(i, j, k); });
}

TEST(ReferenceMap, GridHasTheCountsOfASolidBox) {
  const ReferenceMap map = ReferenceMap::Build(2, 3, 4, Unit);
  EXPECT_TRUE(map.lcc().is_valid());
  EXPECT_EQ(Count(map), (Counts{3 * 4 * 5, 2 * 4 * 5 + 3 * 3 * 5 + 3 * 4 * 4,
                                3 * 3 * 4 + 2 * 4 * 4 + 2 * 3 * 5, 2 * 3 * 4, 1}));
  EXPECT_EQ(map.lcc().vertex_attributes().size(), 3u * 4 * 5);
}

TEST(ReferenceMap, UniformRefinementOfTwoByTwoByTwoIsAGridOfEight) {
  ReferenceMap map = ReferenceMap::Build(2, 2, 2, Unit);
  for (int level = 0; level < 2; ++level) {
    for (const CellId id : map.Leaves()) ASSERT_EQ(map.Refine(id), absl::OkStatus());
  }
  EXPECT_TRUE(map.lcc().is_valid());
  EXPECT_EQ(Count(map), (Counts{9 * 9 * 9, 3 * 8 * 9 * 9, 3 * 9 * 8 * 8, 8 * 8 * 8, 1}));
  EXPECT_EQ(map.lcc().vertex_attributes().size(), 9u * 9 * 9);
  EXPECT_EQ(map.lcc().number_of_darts(), 8u * 8 * 8 * 24);
  for (auto it = map.lcc().attributes<3>().begin(); it != map.lcc().attributes<3>().end(); ++it) {
    EXPECT_EQ(it->info().level, 2);
  }
}

TEST(ReferenceMap, ChildrenKeepTheCornerThatNamesThem) {
  ReferenceMap map = ReferenceMap::Build(2, 1, 2, Unit);
  const CellId cell = CellId::Initial(3);  // (1, 0, 1)
  ASSERT_EQ(map.Refine(cell), absl::OkStatus());
  ASSERT_EQ(map.Refine(cell.Child(6)), absl::OkStatus());
  for (unsigned c = 0; c < 8; ++c) {
    for (unsigned e = 0; e < 8; ++e) {
      const auto expected = [&](Point3 origin, unsigned child, double side) {
        for (int a = 0; a < 3; ++a) origin[a] += side * (child >> a & 1) + side * (e >> a & 1);
        return origin;
      };
      if (c != 6) {
        EXPECT_EQ(map.Corners(cell.Child(c))[e], expected({1, 0, 1}, c, 0.5));
      }
      EXPECT_EQ(map.Corners(cell.Child(6).Child(c))[e], expected({1, 0.5, 1.5}, c, 0.25));
    }
  }
}

TEST(ReferenceMap, NewPointsFollowTheFormulasOfTheProtocol) {
  const std::array<Point3, 8> p = {{{0.1, 0.2, 0.3},
                                    {1.7, 0.1, 0.2},
                                    {0.3, 1.9, 0.4},
                                    {1.3, 1.1, 0.7},
                                    {0.2, 0.1, 1.4},
                                    {1.6, 0.3, 1.3},
                                    {0.1, 1.2, 1.8},
                                    {1.5, 1.4, 1.1}}};
  ReferenceMap map =
      ReferenceMap::Build(1, 1, 1, [&p](uint32_t i, uint32_t j, uint32_t k) { return p[i + 2 * j + 4 * k]; });
  ASSERT_EQ(map.Refine(CellId::Initial(0)), absl::OkStatus());
  const std::array<Point3, 8> first = map.Corners(CellId::Initial(0).Child(0));
  for (int a = 0; a < 3; ++a) {
    const auto face = [&](int w, int x, int y, int z) {
      return ((p[w][a] + p[y][a]) / 2 + (p[x][a] + p[z][a]) / 2) / 2;
    };
    EXPECT_EQ(first[0][a], p[0][a]);
    EXPECT_EQ(first[1][a], (p[0][a] + p[1][a]) / 2);
    EXPECT_EQ(first[2][a], (p[0][a] + p[2][a]) / 2);
    EXPECT_EQ(first[3][a], face(0, 1, 3, 2));
    EXPECT_EQ(first[4][a], (p[0][a] + p[4][a]) / 2);
    EXPECT_EQ(first[5][a], face(0, 1, 5, 4));
    EXPECT_EQ(first[6][a], face(0, 2, 6, 4));
    std::array<double, 4> values;
    for (int c = 0; c < 4; ++c) values[c] = (p[c][a] + p[7 - c][a]) / 2;
    std::sort(values.begin(), values.end());
    EXPECT_EQ(first[7][a], ((values[0] + values[1]) / 2 + (values[2] + values[3]) / 2) / 2);
  }
}

TEST(ReferenceMap, NeighbourRefinedThreeDeepFirst) {
  ReferenceMap map = ReferenceMap::Build(2, 1, 1, Unit);
  CellId id = CellId::Initial(0);
  for (const unsigned child : {7, 1, 3}) {  // At the common face x = 1.
    ASSERT_EQ(map.Refine(id), absl::OkStatus());
    ASSERT_TRUE(map.lcc().is_valid());
    id = id.Child(child);
  }
  ASSERT_EQ(map.Refine(CellId::Initial(1)), absl::OkStatus());
  ASSERT_TRUE(map.lcc().is_valid());
  const Counts counts = Count(map);
  EXPECT_EQ(counts.volumes, 7u + 7 + 8 + 8);
  EXPECT_EQ(counts.components, 1u);
  EXPECT_EQ(counts.Euler(), 1);

  ReferenceMap other = ReferenceMap::Build(2, 1, 1, Unit);
  ASSERT_EQ(other.Refine(CellId::Initial(1)), absl::OkStatus());
  ASSERT_EQ(other.Refine(CellId::Initial(0)), absl::OkStatus());
  ASSERT_EQ(other.Refine(CellId::Initial(0).Child(7)), absl::OkStatus());
  ASSERT_EQ(other.Refine(CellId::Initial(0).Child(7).Child(1)), absl::OkStatus());
  const auto name = [](const ReferenceMap& m) {
    return [&m](ReferenceLcc::Dart_const_handle d) { return NameOf(m.lcc(), d); };
  };
  EXPECT_EQ(CompareMaps(map.lcc(), other.lcc(), name(map), name(other)), absl::OkStatus());
}

TEST(ReferenceMap, RefusesHexahedraThatItDoesNotHave) {
  ReferenceMap map = ReferenceMap::Build(1, 1, 1, Unit);
  const CellId id = CellId::Initial(0);
  EXPECT_EQ(map.Refine(id.Child(2)).code(), absl::StatusCode::kNotFound);
  ASSERT_EQ(map.Refine(id), absl::OkStatus());
  EXPECT_EQ(map.Refine(id).code(), absl::StatusCode::kNotFound);
  ASSERT_EQ(map.Remove(id.Child(2)), absl::OkStatus());
  EXPECT_EQ(map.Remove(id.Child(2)).code(), absl::StatusCode::kNotFound);
}

TEST(ReferenceMap, RemovalLeavesValidMaps) {
  ReferenceMap map = ReferenceMap::Build(2, 2, 1, Unit);
  ASSERT_EQ(map.Refine(CellId::Initial(0)), absl::OkStatus());
  std::vector<CellId> leaves = map.Leaves();
  std::mt19937_64 engine(5);
  while (!leaves.empty()) {
    const size_t at = engine() % leaves.size();
    ASSERT_EQ(map.Remove(leaves[at]), absl::OkStatus());
    leaves.erase(leaves.begin() + at);
    ASSERT_TRUE(map.lcc().is_valid());
    EXPECT_EQ(Count(map).volumes, leaves.size());
    EXPECT_EQ(map.lcc().vertex_attributes().size(), Count(map).vertices);
    EXPECT_EQ(map.Leaves(), leaves);
  }
  EXPECT_TRUE(map.lcc().is_empty());
}

// Any order that has parents before children: repeatedly a random one of those whose parent is refined.
std::vector<CellId> Shuffled(const std::vector<CellId>& refined, uint64_t seed) {
  std::mt19937_64 engine(seed);
  std::vector<CellId> waiting = refined, order;
  while (!waiting.empty()) {
    const size_t at = engine() % waiting.size();
    const CellId id = waiting[at];
    if (id.level() > 0 && std::count(order.begin(), order.end(), id.Parent()) == 0) continue;
    order.push_back(id);
    waiting.erase(waiting.begin() + at);
  }
  return order;
}

void CheckRandomCase(uint64_t seed) {
  const RandomCase c = MakeRandomCase(seed);
  SCOPED_TRACE(c.Describe());
  ReferenceMap map = BuildCase(c), other = BuildCase(c);
  for (size_t step = 0; step < c.refined.size(); ++step) {
    ASSERT_EQ(map.Refine(c.refined[step]), absl::OkStatus());
    if (step < 12) {
      ASSERT_TRUE(map.lcc().is_valid()) << "after refining " << c.refined[step].ToString();
    }
  }
  for (const CellId id : Shuffled(c.refined, c.seed + 1)) ASSERT_EQ(other.Refine(id), absl::OkStatus());
  ASSERT_TRUE(map.lcc().is_valid());
  EXPECT_EQ(map.Leaves(), c.Leaves());
  const Counts counts = Count(map);
  EXPECT_EQ(counts.volumes, c.cells() + 7 * c.refined.size());
  EXPECT_EQ(counts.components, 1u);
  EXPECT_EQ(counts.Euler(), 1);
  EXPECT_EQ(map.lcc().vertex_attributes().size(), counts.vertices);

  const auto name_map = [&](ReferenceLcc::Dart_const_handle d) { return NameOf(map.lcc(), d); };
  const auto name_other = [&](ReferenceLcc::Dart_const_handle d) { return NameOf(other.lcc(), d); };
  EXPECT_EQ(CompareMaps(map.lcc(), other.lcc(), name_map, name_other), absl::OkStatus());

  for (const CellId id : c.removed) ASSERT_EQ(map.Remove(id), absl::OkStatus());
  for (size_t i = c.removed.size(); i-- > 0;) ASSERT_EQ(other.Remove(c.removed[i]), absl::OkStatus());
  ASSERT_TRUE(map.lcc().is_valid());
  EXPECT_EQ(map.lcc().vertex_attributes().size(), Count(map).vertices);
  EXPECT_EQ(CompareMaps(map.lcc(), other.lcc(), name_map, name_other), absl::OkStatus());
}

constexpr uint64_t kSeedsPerTest = 20;

class RandomCases : public testing::TestWithParam<uint64_t> {};

TEST_P(RandomCases, AreValidAndIndependentOfTheOrder) {
  for (uint64_t i = 0; i < kSeedsPerTest; ++i) CheckRandomCase(GetParam() * kSeedsPerTest + i);
}

INSTANTIATE_TEST_SUITE_P(Seeds, RandomCases, testing::Range(uint64_t{0}, uint64_t{10}));

}  // namespace
}  // namespace ndmap::reference

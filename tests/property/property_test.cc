// SPDX-License-Identifier: GPL-3.0-or-later
#include <memory>
#include <string>
#include <vector>

#include "gtest/gtest.h"
#include "tests/property/property_case.h"

namespace ndmap {
namespace {

using Types = MapTypes<3, StorageKind::kFlat>;

// Seeds in groups, so that they run in parallel; tests/property/run_2000.sh runs more.
class CentralPropertyTest : public testing::TestWithParam<int> {};

TEST_P(CentralPropertyTest, GlobalMapIsTheReferenceOnBothStorages) {
  const auto group = static_cast<uint64_t>(GetParam());
  for (uint64_t seed = 25 * group; seed < 25 * (group + 1); ++seed) {
    for (StorageKind storage : {StorageKind::kFlat, StorageKind::kCgal}) {
      const absl::Status status = RunPropertyCase(seed, storage);
      EXPECT_TRUE(status.ok()) << status;
    }
  }
}
INSTANTIATE_TEST_SUITE_P(Seeds, CentralPropertyTest, testing::Range(0, 8),
                         [](const auto& info) { return "From" + std::to_string(25 * info.param); });

// On channels that keep order nothing is ever kept; on others something is, or the test would show nothing.
TEST(KeptMessagesTest, OrderedChannelsNeedNone) {
  int64_t kept_ordered = 0, kept_random = 0;
  for (uint64_t seed = 0; seed < 60; ++seed) {
    for (bool ordered : {true, false}) {
      const reference::RandomCase random_case = reference::MakeRandomCase(seed);
      SimulatorOptions options;
      options.seed = seed;
      options.ordered_channels = ordered;
      SimulatedMap<Block3> map(random_case.blocks, Routing::kDirect, options);
      ASSERT_TRUE(map.BuildGrid(
                         random_case.grid,
                         [&](uint32_t i, uint32_t j, uint32_t k) { return random_case.Corner(i, j, k); },
                         random_case.block_of)
                      .ok());
      const absl::Status status = map.RefineList(random_case.refined, false);
      ASSERT_TRUE(status.ok()) << status;
      (ordered ? kept_ordered : kept_random) += map.refined().counts.at("messages_kept");
    }
  }
  EXPECT_EQ(kept_ordered, 0);
  EXPECT_GT(kept_random, 0);
}

// A grid of unit cubes whose hexahedra are given to blocks, and what is refined in it.
struct Configuration {
  std::array<uint32_t, 3> grid;
  std::vector<uint32_t> block_of;
  std::vector<const char*> refined;
};

reference::RandomCase CaseOf(const Configuration& configuration) {
  reference::RandomCase c;
  c.grid = configuration.grid;
  c.block_of = configuration.block_of;
  for (uint32_t b : c.block_of) c.blocks = std::max(c.blocks, b + 1);
  for (uint32_t k = 0; k <= c.grid[2]; ++k) {
    for (uint32_t j = 0; j <= c.grid[1]; ++j) {
      for (uint32_t i = 0; i <= c.grid[0]; ++i) c.corners.push_back({double(i), double(j), double(k)});
    }
  }
  for (const char* id : configuration.refined) c.refined.push_back(*CellId::Parse(id));
  return c;
}

// In every order of 200 schedules, with duplicates, direct and broadcast, the result is the reference.
void ExpectRight(const Configuration& configuration) {
  const reference::RandomCase c = CaseOf(configuration);
  for (uint64_t seed = 0; seed < 200; ++seed) {
    PropertyVariant variant = VariantOf(seed);
    const absl::Status status = RunPropertyCase(c, variant, StorageKind::kFlat);
    ASSERT_TRUE(status.ok()) << status;
  }
}

int64_t MessagesOf(const Configuration& configuration) {
  const reference::RandomCase c = CaseOf(configuration);
  SimulatorOptions options;
  options.duplicates_per_mille = 0;
  SimulatedMap<Block3> map(c.blocks, Routing::kDirect, options);
  EXPECT_TRUE(
      map.BuildGrid(
             c.grid, [&](uint32_t i, uint32_t j, uint32_t k) { return c.Corner(i, j, k); }, c.block_of)
          .ok());
  EXPECT_TRUE(map.RefineList(c.refined, false).ok());
  return static_cast<int64_t>(map.simulator().statistics().messages);
}

// Published Figure 5: a hexahedron is split beside another block; the critical face must be split on both
// sides. The smallest case that a label rule without signs gets wrong; and it costs one message.
TEST(PublishedConfigurationTest, Figure5CriticalFaceIsSplitOnBothSides) {
  const Configuration one = {{2, 1, 1}, {0, 1}, {"h0"}};
  ExpectRight(one);
  EXPECT_EQ(MessagesOf(one), 1);
  ExpectRight({{2, 1, 1}, {0, 1}, {"h1"}});
  ExpectRight({{2, 1, 1}, {0, 1}, {"h0", "h1"}});
  ExpectRight({{2, 1, 1}, {0, 1}, {"h0", "h0/1", "h0/3", "h1", "h1/0", "h1/0.2"}});
}

// Published Figure 7: four hexahedra around an edge, two opposite ones in one block: that block has the
// global edge twice, and learns of the split of one from a block that was told by the other (the relay).
TEST(PublishedConfigurationTest, Figure7OneGlobalEdgeTwiceInABlock) {
  ExpectRight({{2, 2, 1}, {0, 1, 2, 0}, {"h0"}});
  ExpectRight({{2, 2, 1}, {0, 1, 1, 0}, {"h1"}});
  ExpectRight({{2, 2, 1}, {0, 1, 2, 0}, {"h1", "h1/2", "h3", "h2", "h2/1", "h2/1.1"}});
  ExpectRight({{2, 2, 2}, {0, 1, 2, 0, 3, 4, 4, 3}, {"h0", "h0/7", "h7", "h7/0", "h7/0.0"}});
}

}  // namespace
}  // namespace ndmap

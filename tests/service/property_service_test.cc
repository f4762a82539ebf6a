// SPDX-License-Identifier: GPL-3.0-or-later
// The central property through real services: the random cases of tests/property, refined and trimmed by
// block servers that talk to each other, satisfy Definition 1 and give the canonical hash of the simulated
// map, which is compared with the reference dart by dart.
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "gtest/gtest.h"
#include "tests/property/property_case.h"
#include "tests/service/cluster.h"

namespace ndmap {
namespace {

using reference::RandomCase;

constexpr uint64_t kSeeds = 100;

std::string DigestInOneBlock(const RandomCase& c) {
  SimulatedMap<Block3> map(1, Routing::kDirect, {});
  EXPECT_TRUE(map.BuildGrid(
                     c.grid, [&](uint32_t i, uint32_t j, uint32_t k) { return c.Corner(i, j, k); },
                     std::vector<uint32_t>(c.cells(), 0))
                  .ok());
  EXPECT_TRUE(map.RefineList(c.refined, false).ok());
  EXPECT_TRUE(map.Run("trim", Parameters().Set("cells", TextOf(c.removed))).ok());
  auto hash = map.Run("hash", {});
  EXPECT_TRUE(hash.ok()) << hash.status();
  return hash->digest.ToString();
}

v1::CreateMapRequest CreateRequest(const RandomCase& c, bool broadcast) {
  v1::CreateMapRequest request;
  request.set_map(absl::StrCat("seed-", c.seed));
  request.set_block_count(c.blocks);
  request.set_routing(broadcast ? v1::ROUTING_BROADCAST : v1::ROUTING_DIRECT);
  for (uint32_t n : c.grid) {
    request.mutable_grid()->add_cells(n);
    request.mutable_grid()->add_lo(0);
    request.mutable_grid()->add_hi(1);
  }
  auto& parameters = *request.mutable_parameters();
  parameters["assignment"] = Assignment::FromTable(c.block_of).Encode();
  parameters["corners"] = absl::StrJoin(c.corners, " ", [](std::string* out, const Point3& p) {
    absl::StrAppendFormat(out, "%.17g,%.17g,%.17g", p[0], p[1], p[2]);
  });
  return request;
}

std::vector<std::pair<std::string, Cluster::Values>> Phases(const RandomCase& c, bool by_level) {
  int depth = 0;
  for (const CellId& id : c.refined) depth = std::max(depth, id.level() + 1);
  Cluster::Values refine = {{"oracle", "list"}, {"cells", TextOf(c.refined)}, {"depth", absl::StrCat(depth)}};
  std::vector<std::pair<std::string, Cluster::Values>> phases;
  if (!by_level) phases.push_back({"refine", refine});
  for (int level = 0; by_level && level < depth; ++level) {
    refine["level"] = absl::StrCat(level);
    phases.push_back({"refine", refine});
  }
  phases.push_back({"trim", {{"cells", TextOf(c.removed)}}});
  phases.push_back({"check", {}});
  phases.push_back({"hash", {}});
  return phases;
}

TEST(CentralPropertyOnServicesTest, RandomCasesHaveTheHashOfOneBlock) {
  Cluster cluster(3);
  for (uint64_t seed = 0; seed < kSeeds; ++seed) {
    const RandomCase c = reference::MakeRandomCase(seed);
    const PropertyVariant variant = VariantOf(seed);
    SCOPED_TRACE(c.Describe());
    const v1::Job created = cluster.Create(CreateRequest(c, variant.routing == Routing::kBroadcast));
    ASSERT_EQ(created.state(), v1::JOB_STATE_DONE) << created.error();
    const v1::Job job = cluster.Run(absl::StrCat("seed-", seed), Phases(c, variant.by_level));
    ASSERT_EQ(job.state(), v1::JOB_STATE_DONE) << job.error();
    const v1::Report& check = job.results(job.results_size() - 2).report();
    EXPECT_EQ(check.counts().at("findings"), 0) << check.DebugString();
    const v1::Report& hash = job.results(job.results_size() - 1).report();
    const absl::Status simulated = RunPropertyCase(c, variant, StorageKind::kFlat);
    EXPECT_TRUE(simulated.ok()) << simulated;
    EXPECT_EQ(absl::StrFormat("%016x%016x", hash.digest_hi(), hash.digest_lo()), DigestInOneBlock(c));
  }
}

}  // namespace
}  // namespace ndmap

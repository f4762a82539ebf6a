// SPDX-License-Identifier: GPL-3.0-or-later
// `ndmap run`, from a surface to a mesh, on real services.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>
#include <string>
#include <vector>

#include "tests/cli/command.h"

namespace ndmap::testing {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::Not;

class RunTest : public ::testing::Test {
 protected:
  void SetUp() override {
    surface_ = folder_ / "torus.off";
    ASSERT_EQ(Ndmap({"sample", "bumpy-torus", "-o", surface_, "--triangles", "2000"}).code, 0);
  }
  // Runs with --json; nothing may be left running.
  json Run(std::vector<std::string> arguments, int code = 0) {
    arguments.insert(arguments.begin(), {"run", surface_, "--json", "--grid", "8x8x3", "--depth", "2"});
    Command command(arguments);
    const Outcome outcome = command.Finish();
    EXPECT_EQ(outcome.code, code) << outcome.err;
    EXPECT_TRUE(command.WaitForAllToEnd());
    error_ = outcome.err;
    return outcome.json();
  }

  TemporaryFolder folder_;
  std::string surface_;
  std::string error_;
};

TEST_F(RunTest, TheMapDoesNotDependOnTheNumberOfBlocks) {
  const json one = Run({"--blocks", "1"});
  ASSERT_TRUE(one.is_object()) << error_;
  EXPECT_EQ(one["valid"], true);
  EXPECT_EQ(one["hash"].get<std::string>().size(), 32u);
  EXPECT_EQ(one["critical_darts"], 0);
  const std::vector<std::vector<std::string>> variants = {
      {"--blocks", "4"},
      {"--blocks", "4", "--routing", "broadcast", "--processes", "1"},
      {"--blocks", "3", "--partition", "lpt", "--async"},
      // Erased as soon as it is known.
      {"--blocks", "4", "--parts", "8"},
      {"--blocks", "5", "--parts", "3", "--routing", "broadcast"},
  };
  for (const auto& variant : variants) {
    const json many = Run(variant);
    ASSERT_TRUE(many.is_object()) << error_;
    EXPECT_EQ(many["valid"], true);
    EXPECT_GT(many["critical_darts"], 0);
    EXPECT_GT(many["messages"], 0);
    for (const char* same : {"hash", "made", "hexahedra", "removed", "cut", "inside", "darts", "vertices"}) {
      EXPECT_EQ(many[same], one[same]) << same << " with " << variant[1] << " blocks";
    }
  }
}

TEST_F(RunTest, TheObjectHasEveryField) {
  const json run = Run({"--blocks", "4", "--processes", "2"});
  ASSERT_TRUE(run.is_object()) << error_;
  for (const char* count : {"made", "hexahedra", "removed", "cut", "inside", "darts", "vertices",
                            "critical_darts", "messages", "message_bytes"}) {
    EXPECT_TRUE(run[count].is_number_integer()) << count;
    EXPECT_GT(run[count], 0) << count;
  }
  EXPECT_EQ(run["hexahedra"].get<int>() + run["removed"].get<int>(), run["made"]);
  EXPECT_EQ(run["hexahedra"], run["cut"].get<int>() + run["inside"].get<int>());
  double sum = 0;
  for (const char* phase : {"read", "start", "load", "build", "refine", "classify", "trim", "count", "hash",
                            "check", "export", "stop"}) {
    EXPECT_TRUE(run["seconds"][phase].is_number()) << phase;
    EXPECT_TRUE(run["cpu_seconds"][phase].is_number()) << phase;
    sum += run["seconds"][phase].get<double>();
  }
  EXPECT_LE(sum, run["seconds"]["total"].get<double>() * 1.05);
  EXPECT_GT(run["cpu_seconds"]["total"], 0);
  // This process, the coordinator, two servers, max and sum.
  EXPECT_EQ(run["peak_rss_bytes"].size(), 6u);
  EXPECT_GE(run["peak_rss_bytes"]["sum"], run["peak_rss_bytes"]["max"]);
  ASSERT_EQ(run["levels"].size(), 3u);
  ASSERT_EQ(run["blocks"].size(), 4u);
  int64_t hexahedra = 0, by_level = 0;
  for (const json& block : run["blocks"]) {
    for (const char* field : {"hexahedra", "darts", "critical_darts", "accounted_bytes", "messages"}) {
      EXPECT_GT(block[field], 0) << field;
    }
    hexahedra += block["hexahedra"].get<int64_t>();
  }
  for (const json& level : run["levels"]) by_level += level["hexahedra"].get<int64_t>();
  EXPECT_EQ(hexahedra, run["hexahedra"]);
  EXPECT_EQ(by_level, run["hexahedra"]);
}

TEST_F(RunTest, PeopleGetATableOnStandardOutput) {
  Command command({"run", surface_, "--grid", "4x4x2", "--depth", "1", "--blocks", "2", "--no-check"});
  const Outcome outcome = command.Finish();
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("block  hexahedra"));
  EXPECT_THAT(outcome.out, HasSubstr("hash "));
  EXPECT_THAT(outcome.out, Not(HasSubstr("valid")));
  EXPECT_THAT(outcome.err, HasSubstr("refine level 0"));
  EXPECT_THAT(outcome.err, Not(HasSubstr("\r")));
}

TEST_F(RunTest, AMemoryLimitStopsWithAValidMapAndSaysSo) {
  const json run = Run({"--blocks", "2", "--memory-limit", "300KiB"});
  ASSERT_TRUE(run.is_object()) << error_;
  EXPECT_EQ(run["valid"], true);
  EXPECT_EQ(run["stopped_by_memory"], true);
  EXPECT_THAT(error_, HasSubstr("memory limit reached"));
  EXPECT_EQ(Run({"--blocks", "2"})["stopped_by_memory"], false);
}

TEST_F(RunTest, KeepAllRemovesNothing) {
  const json run = Run({"--keep", "all"});
  ASSERT_TRUE(run.is_object()) << error_;
  EXPECT_EQ(run["removed"], 0);
  EXPECT_EQ(run["hexahedra"], run["made"]);
  EXPECT_EQ(run["made"].get<int>(),
            run["cut"].get<int>() + run["inside"].get<int>() + run["outside"].get<int>());
}

TEST_F(RunTest, WhatIsErasedEarlyIsWhatWouldBeErasedAtTheEnd) {
  for (const char* keep : {"cut", "inside"}) {
    const json late = Run({"--blocks", "3", "--keep", keep, "--async"});
    ASSERT_TRUE(late.is_object()) << error_;
    const json early = Run({"--blocks", "3", "--keep", keep, "--parts", "2"});
    ASSERT_TRUE(early.is_object()) << error_;
    EXPECT_EQ(early["valid"], true);
    for (const char* same : {"hash", "made", "hexahedra", "removed", "cut", "inside", "outside"}) {
      EXPECT_EQ(early[same], late[same]) << same << ", --keep " << keep;
    }
    EXPECT_EQ(early["levels"].size(), late["levels"].size());
  }
}

TEST_F(RunTest, PartsAndAsyncExcludeEachOther) {
  const Outcome outcome = Command({"run", surface_, "--parts", "2", "--async"}).Finish();
  EXPECT_NE(outcome.code, 0);
  EXPECT_THAT(outcome.err, HasSubstr("--async"));
  EXPECT_NE(Command({"run", surface_, "--parts", "9"}).Finish().code, 0);
}

TEST_F(RunTest, SizeChoosesTheDepth) {
  Command command({"run", surface_, "--json", "--cubes", "6", "--size", "0.26", "--blocks", "2"});
  const Outcome outcome = command.Finish();
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  // The longest side is about 2.9: cubes of 0.49, halved once.
  EXPECT_EQ(outcome.json()["depth"], 1);
}

TEST_F(RunTest, TheDryRunIsCloseToTheRun) {
  const json run = Run({});
  const json dry = Run({"--dry-run"});
  EXPECT_NEAR(dry["made"].get<double>() / run["made"].get<double>(), 1, 0.05);
  EXPECT_NEAR(dry["cut"].get<double>() / run["cut"].get<double>(), 1, 0.05);
  EXPECT_NEAR(dry["inside"].get<double>() / run["inside"].get<double>(), 1, 0.05);
}

// What ndmap_octree_count, which has no map, counts on the surface.
json OctreeCount(const std::string& surface, const std::string& grid, const std::string& depth) {
  const std::string command =
      std::string(NDMAP_OCTREE_COUNT) + " " + surface + " --grid " + grid + " --depth " + depth;
  FILE* pipe = popen(command.c_str(), "r");
  std::string out;
  for (int c = 0; pipe != nullptr && (c = fgetc(pipe)) != EOF;) out += static_cast<char>(c);
  EXPECT_EQ(pclose(pipe), 0) << command;
  return json::parse(out, nullptr, false);
}

// One and four blocks make what the octree counts, and the same map.
void ExpectWhatTheOctreeCounts(const std::string& surface, const std::string& grid,
                               const std::string& depth = "3") {
  const json expected = OctreeCount(surface, grid, depth);
  ASSERT_TRUE(expected.is_object());
  EXPECT_GT(expected["inside"], 0);
  json first;
  for (const char* blocks : {"1", "4"}) {
    const Outcome outcome =
        Ndmap({"run", surface, "--grid", grid, "--depth", depth, "--blocks", blocks, "--json"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    const json run = outcome.json();
    EXPECT_EQ(run["valid"], true);
    if (first.is_null()) first = run;
    EXPECT_EQ(run["hash"], first["hash"]);
    for (const char* count : {"made", "cut", "inside"}) EXPECT_EQ(run[count], expected[count]) << count;
  }
}

TEST_F(RunTest, OneAndFourBlocksMakeWhatAnOctreeCounts) {
  const std::string knot = folder_ / "knot.off";
  ASSERT_EQ(Ndmap({"sample", "knot", "-o", knot, "--triangles", "3000"}).code, 0);
  ExpectWhatTheOctreeCounts(knot, "9x9x5");
}

// Its sides lie in planes of the grid's hexahedra, so a centre that is off by an ulp makes boxes meet what
// they should not.
TEST_F(RunTest, SidesInThePlanesOfTheGridAreCountedAsTheOctreeDoes) {
  const std::string tetrahedron = folder_ / "tetrahedron.off";
  std::ofstream(tetrahedron) << "OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n"
                                "3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";
  ExpectWhatTheOctreeCounts(tetrahedron, "4x4x4", "2");
  ExpectWhatTheOctreeCounts(tetrahedron, "3x5x7", "3");
}

#ifdef NDMAP_MESHES
TEST(RunOnRealData, ElephantWithOneAndFourBlocks) {
  ExpectWhatTheOctreeCounts(std::string(NDMAP_MESHES) + "/surfaces/elephant.off", "9x12x8");
}
#endif

}  // namespace
}  // namespace ndmap::testing

// SPDX-License-Identifier: GPL-3.0-or-later
// Commands against a cluster that `ndmap up` keeps running.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "absl/time/clock.h"
#include "client/sdk/client.h"
#include "core/io/surface_reader.h"
#include "tests/cli/command.h"

namespace ndmap::testing {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::Not;

class ClusterTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    up_ = new Command({"up", "--processes", "2", "--json"});
    ASSERT_TRUE(up_->WaitFor("use it with --coordinator"));
    ASSERT_TRUE(up_->WaitFor("\n}\n"));
    coordinator_ = new std::string(CoordinatorOf(*up_));
    folder_ = new TemporaryFolder;
    ASSERT_EQ(Ndmap({"sample", "torus", "-o", *folder_ / "torus.off", "--triangles", "2000"}).code, 0);
  }
  static void TearDownTestSuite() {
    delete folder_;
    delete coordinator_;
    delete up_;
  }
  static Outcome Call(std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"--json", "--coordinator", *coordinator_});
    return Ndmap(arguments);
  }
  // Must work; its object.
  static json Do(const std::vector<std::string>& arguments) {
    const Outcome outcome = Call(arguments);
    EXPECT_EQ(outcome.code, 0) << arguments[0] << ": " << outcome.err;
    const json object = outcome.json();
    EXPECT_TRUE(object.is_object()) << outcome.out;
    return object;
  }
  // Must not; its one line.
  static std::string Fails(const std::vector<std::string>& arguments) {
    const Outcome outcome = Call(arguments);
    EXPECT_EQ(outcome.code, 1) << arguments[0];
    // What was going on before may be told, too.
    const size_t sentence = outcome.err.find("ndmap " + arguments[0] + ": ");
    EXPECT_NE(sentence, std::string::npos) << outcome.err;
    EXPECT_EQ(outcome.err.find('\n', sentence) + 1, outcome.err.size()) << outcome.err;
    EXPECT_EQ(outcome.out, "");
    return sentence == std::string::npos ? "" : outcome.err.substr(sentence);
  }
  static void Create(const std::string& map, const std::string& routing = "direct") {
    Do({"create", map, *folder_ / "torus.off", "--grid", "6x6x3", "--blocks", "2", "--routing", routing});
  }

  static Command* up_;
  static std::string* coordinator_;
  static TemporaryFolder* folder_;
};
Command* ClusterTest::up_ = nullptr;
std::string* ClusterTest::coordinator_ = nullptr;
TemporaryFolder* ClusterTest::folder_ = nullptr;

TEST_F(ClusterTest, AMapFromCreationToDeletion) {
  Create("torus");
  EXPECT_THAT(Fails({"create", "torus", *folder_ / "torus.off"}), HasSubstr("torus"));
  const json maps = Do({"maps"});
  ASSERT_EQ(maps["maps"].size(), 1u);
  EXPECT_EQ(maps["maps"][0]["state"], "ready");
  EXPECT_EQ(maps["maps"][0]["grid"], "6x6x3");
  EXPECT_EQ(Do({"stats", "torus"})["counts"]["hexahedra"], 108);

  const json refined = Do({"refine", "torus", "--depth", "2"});
  EXPECT_EQ(refined["state"], "done");
  ASSERT_EQ(refined["phases"].size(), 3u);
  EXPECT_EQ(refined["phases"][2]["phase"], "classify");
  const json trimmed = Do({"trim", "torus"});
  EXPECT_GT(trimmed["phases"][1]["counts"]["removed"], 0);
  const json stats = Do({"stats", "torus"});
  EXPECT_EQ(stats["blocks"].size(), 2u);
  EXPECT_EQ(stats["counts"]["hexahedra"], trimmed["phases"][1]["counts"]["hexahedra"]);
  EXPECT_EQ(Do({"check", "torus"})["valid"], true);

  // The same as a run in one command.
  const Outcome run = Ndmap({"run", *folder_ / "torus.off", "--grid", "6x6x3", "--depth", "2", "--json"});
  EXPECT_EQ(Do({"hash", "torus"})["hash"], run.json()["hash"]);

  const json jobs = Do({"jobs", "--map", "torus"});
  EXPECT_GE(jobs["jobs"].size(), 6u);
  const json watched = Do({"watch", jobs["jobs"][1]["job"].dump()});
  EXPECT_EQ(watched["state"], "done");
  EXPECT_EQ(Do({"cancel", jobs["jobs"][1]["job"].dump()})["state"], "done");
  EXPECT_EQ(Do({"delete", "torus"})["surface_deleted"], true);
  EXPECT_THAT(Fails({"stats", "torus"}), HasSubstr("torus"));
  EXPECT_EQ(Do({"maps"})["maps"].size(), 0u);
}

TEST_F(ClusterTest, OraclesRefineWhatTheyShould) {
  Create("oracles");
  const auto refined = [&](std::vector<std::string> options) {
    options.insert(options.begin(), {"refine", "oracles"});
    int64_t sum = 0;
    const json job = Do(options);
    for (const json& phase : job["phases"]) sum += phase["counts"].value("refined", int64_t{0});
    return sum;
  };
  EXPECT_EQ(refined({"--depth", "1", "--oracle", "list", "--cells", "h0 h5"}), 2);
  EXPECT_EQ(refined({"--depth", "1", "--oracle", "sphere", "--centre", "100,0,0", "--radius", "1"}), 0);
  EXPECT_EQ(refined({"--depth", "1", "--oracle", "box", "--lo=-100,-100,-100", "--hi", "100,100,100"}), 106);
  EXPECT_EQ(refined({"--depth", "1", "--oracle", "size", "--size", "1000"}), 0);
  EXPECT_EQ(refined({"--depth", "2", "--oracle", "everything", "--async"}), 108 * 8);
  EXPECT_EQ(Do({"check", "oracles"})["valid"], true);
  EXPECT_THAT(Fails({"refine", "oracles", "--oracle", "list", "--cells", "x7"}), HasSubstr("x7"));
  EXPECT_THAT(Fails({"refine", "oracles", "--oracle", "box", "--lo", "0,2,0", "--hi", "1,1,1"}),
              HasSubstr("the box is empty: --lo is 2.0 in y, above --hi, which is 1.0"));
  EXPECT_THAT(Fails({"refine", "oracles", "--oracle", "list", "--cells", "h3 h3/0", "--depth", "1"}),
              HasSubstr("--cells: h3/0 is of level 1, and --depth 1 refines levels below 1: take --depth 2"));
  EXPECT_THAT(Fails({"refine", "oracles", "--oracle", "list", "--cells", " "}), HasSubstr("no hexahedron"));
  Do({"delete", "oracles"});
}

TEST_F(ClusterTest, ListedHexahedraThatNobodyHasAreTold) {
  Create("listed");
  const auto refine = [&](const std::string& cells, std::vector<std::string> more = {}) {
    std::vector<std::string> arguments = {"refine", "listed",  "--oracle", "list",          "--cells",
                                          cells,    "--depth", "2",        "--coordinator", *coordinator_};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Outcome outcome = Ndmap(arguments);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return outcome.out;
  };
  // A child that the same job makes is found, in a phase of its own or in the same.
  EXPECT_THAT(refine("h0 h107 h0/3"), Not(HasSubstr("not found")));
  EXPECT_THAT(refine("h1 h106 h1/3", {"--async"}), Not(HasSubstr("not found")));
  EXPECT_THAT(refine("h0 h2 h108 h9999/1"),
              HasSubstr("3 of 4 listed hexahedra were not found: they were split, removed, or never there"));
  EXPECT_THAT(refine("h5000", {"--async"}), HasSubstr("1 of 1 listed hexahedra were not found"));
  const json job = Do({"refine", "listed", "--oracle", "list", "--cells", "h3 h200", "--depth", "1"});
  EXPECT_EQ(job["phases"][0]["counts"]["listed"], 2);
  EXPECT_EQ(job["phases"][0]["counts"]["listed_found"], 1);
  EXPECT_THAT(Fails({"jobs", "--map", "nosuch"}), HasSubstr("there is no map \"nosuch\""));
  Do({"delete", "listed"});
}

TEST_F(ClusterTest, AJobCanBeStartedWatchedAndCancelled) {
  Create("long");
  const json started = Do({"refine", "long", "--depth", "12", "--no-wait"});
  const std::string job = started["job"].dump();
  EXPECT_THAT(Fails({"trim", "long"}), HasSubstr(job));
  EXPECT_EQ(Do({"maps"})["maps"][0]["running_jobs"][0].dump(), job);
  EXPECT_EQ(Do({"cancel", job})["state"], "cancelled");
  EXPECT_THAT(Fails({"watch", job}), HasSubstr("was cancelled"));
  EXPECT_EQ(Do({"check", "long"})["valid"], true);
  EXPECT_THAT(Fails({"watch", "123456"}), HasSubstr("123456"));
  Do({"delete", "long"});
}

// A critical dart of block 0.
int CriticalDart(const MapHandle& map) {
  for (uint32_t dart = 0; dart < 2000; ++dart) {
    v1::DartRef ref;
    ref.set_dart(dart);
    const auto at = map.Beta({ref}, {});
    if (at.ok() && at->front().at.critical()) return static_cast<int>(dart);
  }
  return -1;
}

// The threads that watch the sockets of a server once slept for a tenth of a second after each second in
// which they had nothing else to do, and a call that came then waited. Where other programs take the cores
// away calls wait as well, but not in every second.
TEST_F(ClusterTest, NoCallWaitsForAThreadThatSleeps) {
  Create("rested");
  const auto client = Client::Connect(*coordinator_);
  ASSERT_TRUE(client.ok()) << client.status();
  const auto map = client->OpenMap("rested");
  ASSERT_TRUE(map.ok()) << map.status();
  absl::Duration best = absl::InfiniteDuration();
  for (int round = 0; round < 8 && best > absl::Milliseconds(80); ++round) {
    absl::Duration worst;
    const absl::Time end = absl::Now() + absl::Milliseconds(1300);
    for (absl::Time begin = absl::Now(); begin < end;) {
      const absl::Status status = map->AnyDart(0).status();
      ASSERT_TRUE(status.ok()) << status;
      const absl::Time now = absl::Now();
      worst = std::max(worst, now - begin);
      begin = now;
    }
    best = std::min(best, worst);
  }
  EXPECT_LT(best, absl::Milliseconds(80));
  Do({"delete", "rested"});
}

TEST_F(ClusterTest, BetaCrossesServicesAndComesBack) {
  for (const char* routing : {"direct", "broadcast"}) {
    Create("walk", routing);
    const auto client = Client::Connect(*coordinator_);
    ASSERT_TRUE(client.ok()) << client.status();
    const auto map = client->OpenMap("walk");
    ASSERT_TRUE(map.ok()) << map.status();
    const int dart = CriticalDart(*map);
    ASSERT_GE(dart, 0);
    const std::string start = "0:" + std::to_string(dart);

    const json there = Do({"beta", "walk", start, "3"});
    EXPECT_EQ(there["server_crossings"], 1);
    EXPECT_EQ(there["steps"][0]["block"], 1);
    EXPECT_EQ(there["steps"][0]["crossed_server"], true);
    // Beta 3 is an involution.
    const json back = Do({"beta", "walk", start, "3,3"});
    EXPECT_EQ(back["dart"], start);
    EXPECT_EQ(back["server_crossings"], 2);
    // Faces of the initial grid have four edges, also seen from the other block.
    EXPECT_EQ(Do({"beta", "walk", start, "1,1,1,1"})["dart"], start);
    EXPECT_EQ(Do({"beta", "walk", there["dart"], "1111"})["dart"], there["dart"]);
    // The two faces of a critical face run against each other: 3,1,3,1 leads back.
    EXPECT_EQ(Do({"beta", "walk", start, "3,1,3,1"})["dart"], start);
    EXPECT_EQ(Do({"beta", "walk", start, "0,1"})["dart"], start);
    EXPECT_THAT(Ndmap({"beta", "walk", start, "3", "--coordinator", *coordinator_}).out,
                HasSubstr("crossed to block 1 on another service"));
    Do({"delete", "walk"});
  }
}

TEST_F(ClusterTest, ADepthThatFilesCannotNumberIsRefusedBeforeAnythingIsRefined) {
  EXPECT_THAT(Fails({"create", "deep", *folder_ / "torus.off", "--grid", "6x6x3", "--depth", "29"}),
              HasSubstr("on a grid of 6x6x3 numbers in files reach level 18"));
  Create("deep");
  EXPECT_THAT(Fails({"refine", "deep", "--depth", "19", "--oracle", "list", "--cells", "h0"}),
              HasSubstr("on a grid of 6x6x3 numbers in files reach level 18"));
  EXPECT_EQ(Do({"refine", "deep", "--depth", "18", "--oracle", "list", "--cells", "h0"})["state"], "done");
  Do({"delete", "deep"});
}

TEST_F(ClusterTest, ATrimmedMapThatIsRefinedIsClassifiedAndTrimmedAgain) {
  Create("trimmed");
  Do({"trim", "trimmed"});
  const json refined = Do({"refine", "trimmed", "--depth", "1"});
  EXPECT_GT(refined["phases"][1]["counts"]["outside"], 0);
  EXPECT_EQ(Do({"trim", "trimmed"})["phases"][1]["counts"]["removed"],
            refined["phases"][1]["counts"]["outside"]);
  Do({"delete", "trimmed"});
}

TEST_F(ClusterTest, ACreateThatIsRefusedOrFailsLeavesNoSurface) {
  const auto client = Client::Connect(*coordinator_);
  ASSERT_TRUE(client.ok()) << client.status();
  Create("first");
  ASSERT_EQ(Ndmap({"sample", "knot", "-o", *folder_ / "knot.off", "--triangles", "1000"}).code, 0);
  Fails({"create", "first", *folder_ / "knot.off"});
  const auto knot = ReadSurface(*folder_ / "knot.off");
  ASSERT_TRUE(knot.ok()) << knot.status();
  SurfaceView view;
  view.points = knot->surface.points;
  view.triangles = knot->surface.triangles;
  EXPECT_EQ(client->DeleteSurface(SurfaceId(view)).code(), absl::StatusCode::kNotFound);
  // What other maps use stays.
  Fails({"create", "first", *folder_ / "torus.off"});
  EXPECT_EQ(Do({"delete", "first"})["surface_deleted"], true);
}

TEST_F(ClusterTest, BetaRefusesDartsThatAreNotThere) {
  Create("small");
  EXPECT_THAT(Fails({"beta", "small", "0:4000000000", "1"}), HasSubstr("4000000000"));
  EXPECT_THAT(Fails({"beta", "small", "7:0", "1"}), HasSubstr("no block 7"));
  EXPECT_THAT(Fails({"beta", "none", "0:0", "1"}), HasSubstr("none"));
  const json any = Do({"beta", "small", "1:any", "1"});
  EXPECT_EQ(any["start"]["block"], 1);
  Do({"delete", "small"});
}

TEST_F(ClusterTest, VersionsOfTheCluster) {
  const json version = Do({"version"});
  EXPECT_EQ(version["coordinator"]["address"], *coordinator_);
  EXPECT_EQ(version["servers"].size(), 2u);
  EXPECT_EQ(version["servers"][0]["release"], version["ndmap"]);
}

}  // namespace
}  // namespace ndmap::testing

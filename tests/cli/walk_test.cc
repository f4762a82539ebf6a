// SPDX-License-Identifier: GPL-3.0-or-later
// ndmap walk: keys from a pipe and from a terminal.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pty.h>
#include <signal.h>
#include <termios.h>
#include <unistd.h>

#include <string>
#include <vector>

#include "client/sdk/client.h"
#include "client/sdk/explore.h"
#include "tests/cli/map_cluster.h"

namespace ndmap::testing {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::StartsWith;

class WalkTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() { cluster_ = new MapCluster; }
  static void TearDownTestSuite() { delete cluster_; }
  static Outcome Walk(std::vector<std::string> arguments, const std::string& keys) {
    arguments.insert(arguments.begin(), "walk");
    return NdmapWithInput(cluster_->With(arguments), keys);
  }
  // A face that two blocks share.
  static std::string SharedFace() {
    const auto client = Client::Connect(cluster_->coordinator());
    EXPECT_TRUE(client.ok()) << client.status();
    const auto map = client->OpenMap("m");
    EXPECT_TRUE(map.ok()) << map.status();
    v1::ExploreRequest request = CellsAt(BlockAnchor(0), 2);
    request.set_give(v1::GIVE_CELL_DETAILS);
    const auto answer = map->Explore(request);
    EXPECT_TRUE(answer.ok()) << answer.status();
    for (const v1::CellDetails& face : answer->cells()) {
      if (face.blocks_size() == 2) return face.text();
    }
    ADD_FAILURE() << "no face is shared";
    return "";
  }

  static MapCluster* cluster_;
};
MapCluster* WalkTest::cluster_ = nullptr;

TEST_F(WalkTest, KeysFromAPipe) {
  const Outcome outcome = Walk({"m", "h50"}, "1\n1 1 1\nc\nq never read");
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, StartsWith("start  "));
  EXPECT_THAT(outcome.out, HasSubstr("of h50, level 0, block "));
  // Once around a face.
  const std::string first = outcome.out.substr(7, outcome.out.find('\n') - 7);
  const size_t last = outcome.out.rfind("beta 1 ");
  ASSERT_NE(last, std::string::npos);
  EXPECT_EQ(outcome.out.substr(last + 7, first.size()), first);
  EXPECT_THAT(outcome.out, HasSubstr("\ncells  vertex v"));
  EXPECT_THAT(outcome.out, HasSubstr(", hexahedron h50\n"));
}

TEST_F(WalkTest, CrossingsAndTheWayBackAreTold) {
  const std::string face = SharedFace();
  const Outcome outcome = Walk({"m", face}, "3bb");
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("crossed to block "));
  EXPECT_THAT(outcome.out, HasSubstr(" on another service, 127.0.0.1:"));
  EXPECT_THAT(outcome.out, HasSubstr("back   this is where the walk began\n"));

  const json walk = Walk({"m", face, "--json"}, "3cb").json();
  EXPECT_EQ(walk["block_crossings"], 2);
  EXPECT_EQ(walk["server_crossings"], 2);
  ASSERT_EQ(walk["steps"].size(), 3u);
  EXPECT_EQ(walk["steps"][1]["how"], "beta 3");
  // Both darts are of the one face.
  EXPECT_EQ(walk["steps"][1]["cells"]["face"], face);
  EXPECT_EQ(walk["steps"][2]["dart"], walk["steps"][0]["dart"]);
  EXPECT_EQ(walk["dart"], walk["steps"][0]["dart"]);
}

TEST_F(WalkTest, TheBoundaryAndOtherKeysChangeNothing) {
  // From hexahedron 0 straight on: 2 turns to another face, 3 goes through it.
  const Outcome outcome = Walk({"m"}, "232323232323232323x");
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("keys: 0-3 apply a beta"));
  EXPECT_THAT(Walk({"m", "f0:0"}, "3").out,
              HasSubstr("beta 3 the dart is free, this is the boundary of the map\n"));
}

TEST_F(WalkTest, ErrorsAreOneLine) {
  const auto fails = [](const std::vector<std::string>& arguments) {
    const Outcome outcome = Walk(arguments, "1");
    EXPECT_EQ(outcome.code, 1);
    EXPECT_EQ(outcome.error_lines(), 1) << outcome.err;
    return outcome.err;
  };
  EXPECT_THAT(fails({"none"}), HasSubstr("none"));
  EXPECT_THAT(fails({"m", "h4000"}), HasSubstr("h4000"));
  EXPECT_THAT(fails({"m", "7:0"}), HasSubstr("no block 7"));
}

// A terminal of the test's own.
class Terminal {
 public:
  Terminal() { EXPECT_EQ(openpty(&ours_, &its_, nullptr, nullptr, nullptr), 0); }
  ~Terminal() {
    close(ours_);
    close(its_);
  }
  int its() const { return its_; }
  void Type(const std::string& keys) const {
    EXPECT_EQ(write(ours_, keys.data(), keys.size()), static_cast<ssize_t>(keys.size()));
  }
  // Whether it gives whole lines and shows what is typed, as it did at first.
  bool IsAsBefore() const {
    termios now{};
    tcgetattr(its_, &now);
    return (now.c_lflag & ICANON) != 0 && (now.c_lflag & ECHO) != 0;
  }

 private:
  int ours_ = -1, its_ = -1;
};

TEST_F(WalkTest, ATerminalGivesKeysAtOnceAndIsPutBack) {
  // q, ctrl-D and a signal all end the walk.
  for (const std::string end : {"q", "\x04", "signal"}) {
    const Terminal terminal;
    ASSERT_TRUE(terminal.IsAsBefore());
    Command walk(cluster_->With({"walk", "m", "h50"}), terminal.its());
    ASSERT_TRUE(walk.WaitFor("start  "));
    EXPECT_FALSE(terminal.IsAsBefore());
    EXPECT_THAT(walk.so_far().out, StartsWith("keys: "));
    terminal.Type("1");
    ASSERT_TRUE(walk.WaitFor("beta 1 "));
    if (end == "signal") {
      walk.Signal(SIGINT);
    } else {
      terminal.Type(end);
    }
    EXPECT_EQ(walk.Finish().code, end == "signal" ? 128 + SIGINT : 0);
    EXPECT_TRUE(terminal.IsAsBefore()) << end;
  }
}

}  // namespace
}  // namespace ndmap::testing

// SPDX-License-Identifier: GPL-3.0-or-later
// However `ndmap` ends, nothing that it started goes on. WaitForAllToEnd() sees every descendant, because all
// of them inherit one end of a pipe.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <string>

#include "tests/cli/command.h"

namespace ndmap::testing {
namespace {

using ::testing::HasSubstr;

class InterruptTest : public ::testing::Test {
 protected:
  void SetUp() override {
    surface_ = folder_ / "torus.off";
    ASSERT_EQ(Ndmap({"sample", "bumpy-torus", "-o", surface_}).code, 0);
  }
  // A run that would take hours.
  std::vector<std::string> LongRun() const {
    return {"run", surface_, "--depth", "12", "--blocks", "4", "--processes", "2", "-o", folder_ / "out"};
  }

  TemporaryFolder folder_;
  std::string surface_;
};

TEST_F(InterruptTest, CtrlCWhileTheClusterWorks) {
  for (int signal : {SIGINT, SIGTERM, SIGHUP}) {
    Command run(LongRun());
    ASSERT_TRUE(run.WaitFor("refine level 1"));
    EXPECT_EQ(run.Children().size(), 3u);
    run.Signal(signal);
    const Outcome outcome = run.Finish();
    EXPECT_EQ(outcome.code, 128 + signal);
    EXPECT_THAT(outcome.err, HasSubstr("interrupted: stopping"));
    EXPECT_EQ(outcome.out, "");
    EXPECT_TRUE(run.WaitForAllToEnd());
    EXPECT_FALSE(Exists(folder_ / "out"));
  }
}

TEST_F(InterruptTest, CtrlCRightAtTheBeginning) {
  Command run(LongRun());
  ASSERT_TRUE(run.WaitFor("read"));
  run.Signal(SIGINT);
  EXPECT_EQ(run.Finish().code, 130);
  EXPECT_TRUE(run.WaitForAllToEnd());
}

TEST_F(InterruptTest, ASecondCtrlCEndsServicesThatDoNotAnswer) {
  Command run(LongRun());
  ASSERT_TRUE(run.WaitFor("refine level 1"));
  // A stopped process does nothing about SIGTERM.
  for (pid_t child : run.Children()) kill(child, SIGSTOP);
  run.Signal(SIGINT);
  ASSERT_TRUE(run.WaitFor("interrupted: stopping"));
  run.Signal(SIGINT);
  EXPECT_EQ(run.Finish().code, 130);
  EXPECT_TRUE(run.WaitForAllToEnd());
}

TEST_F(InterruptTest, ServicesDieWithARunThatIsKilled) {
  Command run(LongRun());
  ASSERT_TRUE(run.WaitFor("refine level 1"));
  run.Signal(SIGKILL);
  EXPECT_EQ(run.Finish().code, 128 + SIGKILL);
  EXPECT_TRUE(run.WaitForAllToEnd());
}

TEST_F(InterruptTest, AServerThatDiesEndsTheRunWithOneSentence) {
  Command run(LongRun());
  ASSERT_TRUE(run.WaitFor("refine level 1"));
  kill(run.Children().back(), SIGKILL);
  const Outcome outcome = run.Finish();
  EXPECT_EQ(outcome.code, 1);
  EXPECT_THAT(outcome.err, HasSubstr("ndmap run: ndmap-server ended (signal 9)"));
  EXPECT_TRUE(run.WaitForAllToEnd());
  EXPECT_FALSE(Exists(folder_ / "out"));
}

TEST_F(InterruptTest, UpStopsWithCtrlC) {
  Command up({"up", "--processes", "2"});
  ASSERT_TRUE(up.WaitFor("use it with --coordinator"));
  EXPECT_EQ(up.Children().size(), 3u);
  up.Signal(SIGINT);
  EXPECT_EQ(up.Finish().code, 130);
  EXPECT_TRUE(up.WaitForAllToEnd());
}

TEST_F(InterruptTest, CtrlCCancelsARemoteJobAndLeavesAValidMap) {
  Command up({"up", "--processes", "1", "--json"});
  ASSERT_TRUE(up.WaitFor("use it with --coordinator"));
  ASSERT_TRUE(up.WaitFor("\n}\n"));
  const std::string coordinator = CoordinatorOf(up);
  ASSERT_EQ(Ndmap({"create", "m", surface_, "--blocks", "2", "--coordinator", coordinator}).code, 0);
  Command refine({"refine", "m", "--depth", "12", "--coordinator", coordinator});
  ASSERT_TRUE(refine.WaitFor("refine level 1"));
  refine.Signal(SIGINT);
  const Outcome outcome = refine.Finish();
  EXPECT_EQ(outcome.code, 1);
  EXPECT_THAT(outcome.err, HasSubstr("was cancelled; the map is valid"));
  const Outcome check = Ndmap({"check", "m", "--json", "--coordinator", coordinator});
  EXPECT_EQ(check.code, 0) << check.err;
  EXPECT_EQ(check.json()["valid"], true);
}

}  // namespace
}  // namespace ndmap::testing

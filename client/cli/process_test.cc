// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/process.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <thread>

#include "absl/synchronization/notification.h"
#include "absl/time/clock.h"

namespace ndmap::cli {
namespace {

bool Runs(pid_t pid) { return kill(pid, 0) == 0; }

TEST(ChildProcesses, TellsHowAChildEnded) {
  ChildProcesses children;
  const pid_t good = *children.Start({"/bin/true"});
  const pid_t bad = *children.Start({"/bin/sh", "-c", "exit 7"});
  const pid_t none = *children.Start({"/nonexistent"});
  EXPECT_EQ(children.Wait(good), 0);
  EXPECT_EQ(children.Wait(bad), 7);
  EXPECT_EQ(children.Wait(none), 127);
  EXPECT_EQ(children.Ended(bad), "exit code 7");
}

TEST(ChildProcesses, SettingsOfOtherServicesDoNotReachChildren) {
  setenv("NDMAP_ADVERTISE", "nowhere:1", 1);
  setenv("OTHER_SETTING", "here", 1);
  ChildProcesses children;
  const pid_t child =
      *children.Start({"/bin/sh", "-c", "test -z \"$NDMAP_ADVERTISE\" && test -n \"$OTHER_SETTING\""});
  EXPECT_EQ(children.Wait(child), 0);
  unsetenv("NDMAP_ADVERTISE");
  unsetenv("OTHER_SETTING");
}

TEST(ChildProcesses, StopAsksThenKills) {
  ChildProcesses children;
  const pid_t polite = *children.Start({"/bin/sleep", "100"});
  int ready[2];
  ASSERT_EQ(pipe(ready), 0);
  ChildOptions options;
  options.error_descriptor = ready[1];
  // Says when it has begun to ignore the signal.
  const pid_t deaf =
      *children.Start({"/bin/sh", "-c", "trap '' TERM; echo ready; while :; do sleep 100; done"}, options);
  char byte = 0;
  ASSERT_EQ(read(ready[0], &byte, 1), 1);
  EXPECT_EQ(children.Ended(polite), "");
  children.Stop(absl::Milliseconds(100));
  EXPECT_EQ(children.Ended(polite), "signal 15");
  EXPECT_EQ(children.Ended(deaf), "signal 9");
  EXPECT_FALSE(children.Start({"/bin/true"}).ok());
  close(ready[0]);
  close(ready[1]);
}

TEST(ChildProcesses, KillAllWorksWhileStopWaits) {
  ChildProcesses children;
  int ready[2];
  ASSERT_EQ(pipe(ready), 0);
  ChildOptions options;
  options.error_descriptor = ready[1];
  const pid_t deaf =
      *children.Start({"/bin/sh", "-c", "trap '' TERM; echo ready; while :; do sleep 100; done"}, options);
  char byte = 0;
  ASSERT_EQ(read(ready[0], &byte, 1), 1);
  const absl::Time begin = absl::Now();
  std::thread stop([&] { children.Stop(absl::Minutes(10)); });
  children.KillAll();
  stop.join();
  EXPECT_LT(absl::Now() - begin, absl::Minutes(1));
  EXPECT_EQ(children.Ended(deaf), "signal 9");
  close(ready[0]);
  close(ready[1]);
}

TEST(ChildProcesses, ChildrenDieWithTheirParentHoweverItDies) {
  int pids[2];
  ASSERT_EQ(pipe(pids), 0);
  const pid_t parent = fork();
  if (parent == 0) {
    ChildProcesses children;
    const pid_t child = *children.Start({"/bin/sleep", "1000"});
    if (write(pids[1], &child, sizeof(child)) != sizeof(child)) _exit(1);
    for (;;) pause();
  }
  close(pids[1]);
  pid_t child = 0;
  ASSERT_EQ(read(pids[0], &child, sizeof(child)), static_cast<ssize_t>(sizeof(child)));
  ASSERT_TRUE(Runs(child));
  kill(parent, SIGKILL);
  waitpid(parent, nullptr, 0);
  // The child holds the pipe's other end no more once it is gone.
  char byte = 0;
  EXPECT_EQ(read(pids[0], &byte, 1), 0);
  close(pids[0]);
}

TEST(FindProgram, SaysWhereItLooked) {
  EXPECT_TRUE(FindProgram("sh").ok());
  const auto missing = FindProgram("ndmap-no-such-program");
  EXPECT_EQ(missing.status().code(), absl::StatusCode::kNotFound);
  EXPECT_NE(missing.status().message().find("ndmap-no-such-program"), std::string::npos);
}

}  // namespace
}  // namespace ndmap::cli

// SPDX-License-Identifier: GPL-3.0-or-later
// Child processes that never outlive this one.
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"

namespace ndmap::cli {

// The program beside this one's binary, or else on PATH. NOT_FOUND names both places.
absl::StatusOr<std::string> FindProgram(absl::string_view name);

struct ChildOptions {
  // The child's standard output goes to its standard error, and that to this descriptor; -1: to ours.
  int error_descriptor = -1;
};

// Children in one process group of their own, so that a Ctrl-C on the terminal reaches only this process,
// which then decides. The kernel kills them when the thread that starts them ends, however it ends: start
// them from the main thread. Thread-safe.
class ChildProcesses {
 public:
  ChildProcesses() = default;
  // Kills what is left.
  ~ChildProcesses();
  ChildProcesses(const ChildProcesses&) = delete;
  ChildProcesses& operator=(const ChildProcesses&) = delete;

  // arguments[0] is the program's path. The child gets this process's environment without NDMAP_...: flags of
  // services that are set there are for services that are started by hand.
  absl::StatusOr<pid_t> Start(const std::vector<std::string>& arguments, const ChildOptions& options = {});
  // How a child ended ("exit code 1", "signal 9"); empty while it runs. Reaps it.
  std::string Ended(pid_t pid);
  // Waits for one child to end; its exit code, or 128 + signal.
  int Wait(pid_t pid);
  // Waits until some child has ended; reaps nothing.
  void WaitForAnyEnd();
  // Asks all to end, waits at most `patience`, kills those that are left, and reaps all. No child can be
  // started afterwards.
  void Stop(absl::Duration patience = absl::Seconds(3));
  // Kills all and does not wait. From any thread, also while another one is in Stop().
  void KillAll();

 private:
  struct Child {
    pid_t pid = 0;
    bool reaped = false;
    int status = 0;
  };
  // Collects the statuses of those that have ended; whether all have.
  bool Reap() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Signal(int signal) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  absl::Mutex mutex_;
  pid_t group_ ABSL_GUARDED_BY(mutex_) = 0;
  bool closed_ ABSL_GUARDED_BY(mutex_) = false;
  std::vector<Child> children_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace ndmap::cli

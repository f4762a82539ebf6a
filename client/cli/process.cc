// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/process.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <climits>
#include <cstdlib>
#include <cstring>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/time/clock.h"
#include "client/cli/interrupt.h"

namespace ndmap::cli {
namespace {

std::string OwnFolder() {
  char path[PATH_MAX];
  const ssize_t length = readlink("/proc/self/exe", path, sizeof(path));
  const std::string own(path, length > 0 ? static_cast<size_t>(length) : 0);
  return own.substr(0, own.rfind('/'));
}

// Everything between fork and exec; only calls that are safe there. Ends the child if anything fails.
[[noreturn]] void Become(char* const* arguments, char* const* environment, pid_t parent, pid_t group,
                         const ChildOptions& options) {
  setpgid(0, group);
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  // The parent may have died before the line above took effect.
  if (getppid() != parent) _exit(127);
  const int error = options.error_descriptor < 0 ? STDERR_FILENO : options.error_descriptor;
  dup2(error, STDERR_FILENO);
  dup2(STDERR_FILENO, STDOUT_FILENO);
  const int nothing = open("/dev/null", O_RDONLY);
  if (nothing >= 0) dup2(nothing, STDIN_FILENO);
  UnblockSignalsInChild();
  execve(arguments[0], arguments, environment);
  _exit(127);
}

int ExitCode(int status) { return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status); }

}  // namespace

absl::StatusOr<std::string> FindProgram(absl::string_view name) {
  const std::string beside = absl::StrCat(OwnFolder(), "/", name);
  if (access(beside.c_str(), X_OK) == 0) return beside;
  const char* path = std::getenv("PATH");
  for (absl::string_view folder : absl::StrSplit(path == nullptr ? "" : path, ':', absl::SkipEmpty())) {
    std::string candidate = absl::StrCat(folder, "/", name);
    if (access(candidate.c_str(), X_OK) == 0) return candidate;
  }
  return absl::NotFoundError(
      absl::StrCat("the program ", name, " is neither in ", OwnFolder(), " nor on PATH"));
}

ChildProcesses::~ChildProcesses() {
  KillAll();
  Stop(absl::ZeroDuration());
}

absl::StatusOr<pid_t> ChildProcesses::Start(const std::vector<std::string>& arguments,
                                            const ChildOptions& options) {
  std::vector<char*> argv;
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  // What is set for somebody else's services must not reach ours.
  std::vector<char*> environment;
  for (char** e = environ; *e != nullptr; ++e) {
    if (!absl::StartsWith(*e, "NDMAP_")) environment.push_back(*e);
  }
  environment.push_back(nullptr);
  absl::MutexLock lock(&mutex_);
  if (closed_) return absl::CancelledError("interrupted");
  const pid_t parent = getpid();
  const pid_t pid = fork();
  if (pid < 0) {
    return absl::ResourceExhaustedError(
        absl::StrCat("cannot start ", arguments[0], ": ", std::strerror(errno)));
  }
  if (pid == 0) Become(argv.data(), environment.data(), parent, group_, options);
  // The child does the same; whoever is first.
  setpgid(pid, group_ == 0 ? pid : group_);
  if (group_ == 0) group_ = pid;
  children_.push_back({pid});
  return pid;
}

bool ChildProcesses::Reap() {
  bool all = true;
  for (Child& child : children_) {
    if (!child.reaped) child.reaped = waitpid(child.pid, &child.status, WNOHANG) == child.pid;
    all = all && child.reaped;
  }
  return all;
}

void ChildProcesses::Signal(int signal) {
  // One by one, too: a child that has not yet joined the group must not be missed.
  for (const Child& child : children_) {
    if (!child.reaped) kill(child.pid, signal);
  }
  if (group_ > 0) killpg(group_, signal);
}

std::string ChildProcesses::Ended(pid_t pid) {
  absl::MutexLock lock(&mutex_);
  Reap();
  for (const Child& child : children_) {
    if (child.pid != pid || !child.reaped) continue;
    return WIFEXITED(child.status) ? absl::StrCat("exit code ", WEXITSTATUS(child.status))
                                   : absl::StrCat("signal ", WTERMSIG(child.status));
  }
  return "";
}

int ChildProcesses::Wait(pid_t pid) {
  // Waits without reaping, so that whoever holds the lock can do so at any time.
  siginfo_t info;
  while (waitid(P_PID, static_cast<id_t>(pid), &info, WEXITED | WNOWAIT) != 0 && errno == EINTR) {
  }
  absl::MutexLock lock(&mutex_);
  Reap();
  for (const Child& child : children_) {
    if (child.pid == pid) return ExitCode(child.status);
  }
  return 127;
}

void ChildProcesses::WaitForAnyEnd() {
  siginfo_t info;
  while (waitid(P_ALL, 0, &info, WEXITED | WNOWAIT) != 0 && errno == EINTR) {
  }
}

void ChildProcesses::Stop(absl::Duration patience) {
  const absl::Time deadline = absl::Now() + patience;
  {
    absl::MutexLock lock(&mutex_);
    closed_ = true;
    if (children_.empty()) return;
    Signal(SIGTERM);
  }
  for (bool killed = false;;) {
    {
      absl::MutexLock lock(&mutex_);
      if (Reap()) {
        // The group's last members: what the children may have started themselves.
        if (group_ > 0) killpg(group_, SIGKILL);
        group_ = 0;
        return;
      }
      if (!killed && absl::Now() >= deadline) {
        Signal(SIGKILL);
        killed = true;
      }
    }
    absl::SleepFor(absl::Milliseconds(2));
  }
}

void ChildProcesses::KillAll() {
  absl::MutexLock lock(&mutex_);
  closed_ = true;
  Signal(SIGKILL);
}

}  // namespace ndmap::cli

// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/cli/command.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>

namespace ndmap::testing {
namespace {

double Now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

int BoundSocket(int* port) {
  const int bound = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof(address);
  if (bind(bound, reinterpret_cast<sockaddr*>(&address), size) != 0) abort();
  getsockname(bound, reinterpret_cast<sockaddr*>(&address), &size);
  *port = ntohs(address.sin_port);
  return bound;
}

}  // namespace

int Outcome::error_lines() const { return static_cast<int>(std::count(err.begin(), err.end(), '\n')); }

nlohmann::json Outcome::json() const { return nlohmann::json::parse(out, nullptr, false); }

Command::Command(const std::vector<std::string>& arguments, int input) {
  std::string program = NDMAP_PROGRAM;
  std::vector<char*> argv = {program.data()};
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  int out[2], err[2], life[2];
  if (pipe2(out, O_CLOEXEC) != 0 || pipe2(err, O_CLOEXEC) != 0 || pipe2(life, O_CLOEXEC) != 0) abort();
  outcome_.seconds = Now();
  pid_ = fork();
  if (pid_ == 0) {
    if (input >= 0) dup2(input, STDIN_FILENO);
    dup2(out[1], STDOUT_FILENO);
    dup2(err[1], STDERR_FILENO);
    fcntl(life[1], F_SETFD, 0);
    unsetenv("NDMAP_COORDINATOR");
    execv(argv[0], argv.data());
    _exit(127);
  }
  for (int end : {out[1], err[1], life[1]}) close(end);
  out_ = out[0];
  err_ = err[0];
  lifeline_ = life[0];
}

Command::~Command() {
  if (!finished_) {
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
  for (int end : {out_, err_, lifeline_}) {
    if (end >= 0) close(end);
  }
}

bool Command::ReadSome() {
  pollfd streams[2] = {{out_, POLLIN, 0}, {err_, POLLIN, 0}};
  if (out_ < 0 && err_ < 0) return false;
  poll(streams, 2, -1);
  for (int i = 0; i < 2; ++i) {
    if (streams[i].revents == 0) continue;
    char bytes[4096];
    const ssize_t got = read(streams[i].fd, bytes, sizeof(bytes));
    if (got > 0) {
      (i == 0 ? outcome_.out : outcome_.err).append(bytes, static_cast<size_t>(got));
    } else {
      close(streams[i].fd);
      (i == 0 ? out_ : err_) = -1;
    }
  }
  return out_ >= 0 || err_ >= 0;
}

bool Command::WaitFor(const std::string& text) {
  for (;;) {
    if (outcome_.out.find(text) != std::string::npos || outcome_.err.find(text) != std::string::npos)
      return true;
    if (!ReadSome()) return outcome_.err.find(text) != std::string::npos;
  }
}

void Command::Signal(int signal) const { kill(pid_, signal); }

std::vector<pid_t> Command::Children() const {
  const std::string pid = std::to_string(pid_);
  std::ifstream in("/proc/" + pid + "/task/" + pid + "/children");
  std::vector<pid_t> children;
  for (pid_t child = 0; in >> child;) children.push_back(child);
  return children;
}

Outcome Command::Finish() {
  while (ReadSome()) {
  }
  int status = 0;
  waitpid(pid_, &status, 0);
  finished_ = true;
  outcome_.code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  outcome_.seconds = Now() - outcome_.seconds;
  return outcome_;
}

bool Command::WaitForAllToEnd() {
  pollfd life{lifeline_, POLLIN, 0};
  return poll(&life, 1, 60000) == 1 && (life.revents & POLLHUP) != 0;
}

std::string CoordinatorOf(const Command& up) {
  return up.so_far().json().value("coordinator", std::string());
}

Outcome Ndmap(const std::vector<std::string>& arguments) { return Command(arguments).Finish(); }

Outcome NdmapWithInput(const std::vector<std::string>& arguments, const std::string& input) {
  const int file = memfd_create("input", MFD_CLOEXEC);
  if (write(file, input.data(), input.size()) != static_cast<ssize_t>(input.size())) abort();
  lseek(file, 0, SEEK_SET);
  const Outcome outcome = Command(arguments, file).Finish();
  close(file);
  return outcome;
}

int FreePort() {
  int port = 0;
  close(BoundSocket(&port));
  return port;
}

SilentListener::SilentListener() {
  socket_ = BoundSocket(&port_);
  if (listen(socket_, 16) != 0) abort();
}

SilentListener::~SilentListener() { close(socket_); }

TemporaryFolder::TemporaryFolder() {
  path_ = ::testing::TempDir() + "/ndmap-cli-XXXXXX";
  if (mkdtemp(path_.data()) == nullptr) abort();
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code error;
  std::filesystem::remove_all(path_, error);
}

bool Exists(const std::string& path) { return access(path.c_str(), F_OK) == 0; }

}  // namespace ndmap::testing

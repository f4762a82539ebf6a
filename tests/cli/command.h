// SPDX-License-Identifier: GPL-3.0-or-later
// Runs the real `ndmap` for tests: to its end, or in the background with an eye on everything that it starts.
#pragma once

#include <sys/types.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace ndmap::testing {

struct Outcome {
  int code = 0;  // 128 + signal if a signal ended it.
  std::string out;
  std::string err;
  double seconds = 0;

  // Lines on standard error.
  int error_lines() const;
  // Standard output as one JSON object; null if it is not.
  nlohmann::json json() const;
};

// A process under test. The destructor kills it.
class Command {
 public:
  // With `input` that descriptor is its standard input.
  explicit Command(const std::vector<std::string>& arguments, int input = -1);
  ~Command();
  Command(const Command&) = delete;
  Command& operator=(const Command&) = delete;

  pid_t pid() const { return pid_; }
  // Reads until `text` was said on standard output or error; false if the process closed both first.
  bool WaitFor(const std::string& text);
  void Signal(int signal) const;
  // Its children.
  std::vector<pid_t> Children() const;
  // What was read so far.
  const Outcome& so_far() const { return outcome_; }
  // Waits for the end of the process.
  Outcome Finish();
  // Waits until the process and everything that it started, directly or not, has ended; false if that takes
  // more than a minute.
  bool WaitForAllToEnd();

 private:
  // Reads what is there, waiting for it; false when both streams are closed.
  bool ReadSome();

  pid_t pid_ = 0;
  int out_ = -1;
  int err_ = -1;
  // Nobody writes into this pipe: it ends when the last process that inherited it has ended.
  int lifeline_ = -1;
  bool finished_ = false;
  Outcome outcome_;
};

// The address that `ndmap up --json` has said.
std::string CoordinatorOf(const Command& up);

Outcome Ndmap(const std::vector<std::string>& arguments);
// With this on standard input, from a file.
Outcome NdmapWithInput(const std::vector<std::string>& arguments, const std::string& input);

// A port of the loopback interface that was free a moment ago.
int FreePort();

// Listens on a port, and does nothing else, until destroyed.
class SilentListener {
 public:
  SilentListener();
  ~SilentListener();
  int port() const { return port_; }

 private:
  int socket_ = -1;
  int port_ = 0;
};

// A folder that goes away.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  std::string operator/(const std::string& name) const { return path_ + "/" + name; }
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

bool Exists(const std::string& path);

}  // namespace ndmap::testing

// SPDX-License-Identifier: GPL-3.0-or-later
// What the main functions of both services do alike: log, flags that they share, signals, the end.
#pragma once

#include <CLI/CLI.hpp>

#include <functional>
#include <string>

#include "absl/status/status.h"

namespace ndmap::service {

struct ProgramOptions {
  std::string listen = "127.0.0.1:0";
  std::string port_file;
  std::string log_level = "info";
  bool exit_with_parent = false;
};

// Each flag can also come from the environment as NDMAP_..., or from a file (--config).
void AddProgramOptions(CLI::App& app, ProgramOptions& options);

// Parses; on --help, --version or an error prints one message and sets the exit code. True: go on.
bool Parse(CLI::App& app, int argc, char** argv, int& exit_code);

// Call first in main, before any thread is made: SIGINT and SIGTERM are from then on taken by AwaitSignal()
// alone.
void BlockSignals();
// Sets up logging to standard error, and the death of this process with its parent.
absl::Status BeginProgram(const ProgramOptions& options);
// Writes the port's number into the file (first under another name, so that a reader never sees half of it).
// Nothing when the file's name is empty.
absl::Status WritePortFile(const std::string& file, int port);
// Waits for SIGINT or SIGTERM, runs `stop`, and ends the process anyway when that takes more than 5 seconds.
void AwaitSignal(const std::function<void()>& stop);

}  // namespace ndmap::service

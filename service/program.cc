// SPDX-License-Identifier: GPL-3.0-or-later
#include "service/program.h"

#include <signal.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <iostream>

#include "absl/strings/str_cat.h"
#include "service/channel.h"
#include "service/version.h"

namespace ndmap::service {
namespace {

constexpr unsigned kStopSeconds = 5;

sigset_t EndSignals() {
  sigset_t set;
  sigemptyset(&set);
  sigaddset(&set, SIGINT);
  sigaddset(&set, SIGTERM);
  return set;
}

}  // namespace

void AddProgramOptions(CLI::App& app, ProgramOptions& options) {
  app.set_version_flag("--version", std::string(kRelease));
  app.set_config("--config", "", "read flags from a file of name=value lines");
  app.add_option("--listen", options.listen, "HOST:PORT to serve; port 0: any free one")
      ->envname("NDMAP_LISTEN")
      ->capture_default_str();
  app.add_option("--port-file", options.port_file, "write the port's number into this file when serving")
      ->envname("NDMAP_PORT_FILE");
  app.add_option("--log-level", options.log_level, "what to log")
      ->envname("NDMAP_LOG_LEVEL")
      ->check(CLI::IsMember({"debug", "info", "warn", "error", "off"}))
      ->capture_default_str();
  app.add_flag("--exit-with-parent", options.exit_with_parent,
               "stop when the process that started this one ends");
}

bool Parse(CLI::App& app, int argc, char** argv, int& exit_code) {
  try {
    app.parse(argc, argv);
    return true;
  } catch (const CLI::Success& done) {
    exit_code = app.exit(done);
  } catch (const CLI::ParseError& error) {
    std::cerr << app.get_name() << ": " << error.what() << '\n';
    exit_code = 2;
  }
  return false;
}

void BlockSignals() {
  const sigset_t set = EndSignals();
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
  signal(SIGPIPE, SIG_IGN);
}

absl::Status BeginProgram(const ProgramOptions& options) {
  auto logger = spdlog::stderr_logger_mt("ndmap");
  logger->set_pattern("%Y-%m-%dT%H:%M:%S.%e %l %v");
  logger->set_level(spdlog::level::from_str(options.log_level));
  spdlog::set_default_logger(std::move(logger));
  RouteGrpcLog();
  if (options.exit_with_parent) {
    const pid_t parent = getppid();
    if (prctl(PR_SET_PDEATHSIG, SIGTERM) != 0) {
      return absl::InternalError(absl::StrCat("--exit-with-parent: ", std::strerror(errno)));
    }
    // It may have ended before; its orphans go to process 1 or to a subreaper.
    if (parent == 1 || getppid() != parent) return absl::CancelledError("the parent process has ended");
  }
  return absl::OkStatus();
}

absl::Status WritePortFile(const std::string& file, int port) {
  if (file.empty()) return absl::OkStatus();
  const std::string part = file + ".part";
  std::ofstream out(part);
  out << port << '\n';
  out.close();
  if (!out || std::rename(part.c_str(), file.c_str()) != 0) {
    return absl::UnavailableError(
        absl::StrCat("cannot write --port-file ", file, ": ", std::strerror(errno)));
  }
  return absl::OkStatus();
}

void AwaitSignal(const std::function<void()>& stop) {
  const sigset_t set = EndSignals();
  int number = 0;
  sigwait(&set, &number);
  spdlog::info("{}: stopping", number == SIGINT ? "SIGINT" : "SIGTERM");
  // A handler, because process 1 of a container ignores signals without one.
  signal(SIGALRM, [](int) { _exit(1); });
  alarm(kStopSeconds);
  stop();
  alarm(0);
}

}  // namespace ndmap::service

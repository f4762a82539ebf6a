// SPDX-License-Identifier: GPL-3.0-or-later
// ndmap-coordinator: places blocks on servers and runs jobs.
#include <spdlog/spdlog.h>

#include <iostream>

#include "coordinator/coordinator_server.h"
#include "service/program.h"

int main(int argc, char** argv) {
  using namespace ndmap;
  service::BlockSignals();
  CLI::App app("ndmap-coordinator: places the blocks of maps on servers and runs jobs", "ndmap-coordinator");
  service::ProgramOptions program;
  program.listen = "127.0.0.1:7100";
  service::AddProgramOptions(app, program);
  coordinator::CoordinatorOptions options;
  double stall_seconds = 60, lease_seconds = 10;
  app.add_option("--max-surface-bytes", options.state.max_surface_bytes,
                 "limit of all surfaces that are kept")
      ->envname("NDMAP_MAX_SURFACE_BYTES")
      ->transform(CLI::AsSizeValue(false))
      ->capture_default_str();
  app.add_option("--stall-timeout", stall_seconds, "seconds without progress after which a job has failed")
      ->envname("NDMAP_STALL_TIMEOUT")
      ->check(CLI::Range(1.0, 1e6))
      ->capture_default_str();
  app.add_option("--lease", lease_seconds, "seconds without a sign of life after which a server is lost")
      ->envname("NDMAP_LEASE")
      ->check(CLI::Range(1.0, 1e6))
      ->capture_default_str();
  app.add_option("--max-watches", options.limits.max_watches, "most clients that watch jobs at one time")
      ->envname("NDMAP_MAX_WATCHES")
      ->check(CLI::Range(1u, 65536u))
      ->capture_default_str();
  app.add_option("--max-uploads", options.limits.max_uploads, "most surfaces that are received at one time")
      ->envname("NDMAP_MAX_UPLOADS")
      ->check(CLI::Range(1u, 65536u))
      ->capture_default_str();
  int exit_code = 0;
  if (!service::Parse(app, argc, argv, exit_code)) return exit_code;
  auto fail = [](const absl::Status& status) {
    std::cerr << "ndmap-coordinator: " << status.message() << '\n';
    return 1;
  };
  if (absl::Status status = service::BeginProgram(program); !status.ok()) return fail(status);
  options.listen = program.listen;
  options.runner.stall_timeout = absl::Seconds(stall_seconds);
  options.state.lease = absl::Seconds(lease_seconds);
  auto server = coordinator::CoordinatorServer::Start(std::move(options));
  if (!server.ok()) return fail(server.status());
  if (absl::Status s = service::WritePortFile(program.port_file, (*server)->port()); !s.ok()) return fail(s);
  spdlog::info("serving at {}", (*server)->address());
  service::AwaitSignal([&] { (*server)->Stop(); });
  return 0;
}

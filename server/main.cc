// SPDX-License-Identifier: GPL-3.0-or-later
// ndmap-server: hosts blocks of maps.
#include <spdlog/spdlog.h>

#include <iostream>

#include "core/algorithm/registry.h"
#include "server/block_server.h"
#include "service/program.h"

int main(int argc, char** argv) {
  using namespace ndmap;
  service::BlockSignals();
  CLI::App app("ndmap-server: hosts blocks of distributed maps", "ndmap-server");
  service::ProgramOptions program;
  service::AddProgramOptions(app, program);
  server::BlockServerOptions options;
  app.add_option("--coordinator", options.coordinator, "HOST:PORT of the coordinator")
      ->envname("NDMAP_COORDINATOR");
  double coordinator_timeout = 4;
  app.add_option("--coordinator-timeout", coordinator_timeout,
                 "seconds to wait for the coordinator at the start")
      ->envname("NDMAP_COORDINATOR_TIMEOUT")
      ->check(CLI::Range(0.1, 1e6))
      ->capture_default_str();
  app.add_option("--advertise", options.advertise,
                 "HOST:PORT that peers and clients connect to; default: --listen")
      ->envname("NDMAP_ADVERTISE");
  app.add_option("--threads", options.host.threads, "worker threads; 0: as many as cores")
      ->envname("NDMAP_THREADS")
      ->check(CLI::Range(0u, 4096u))
      ->capture_default_str();
  app.add_option("--data-dir", options.service.data_folder,
                 "folder below which clients may have files written")
      ->envname("NDMAP_DATA_DIR")
      ->check(CLI::ExistingDirectory);
  app.add_option("--max-surface-bytes", options.service.max_surface_bytes,
                 "limit of all surfaces that are kept")
      ->envname("NDMAP_MAX_SURFACE_BYTES")
      ->transform(CLI::AsSizeValue(false))
      ->capture_default_str();
  app.add_option("--max-piece-bytes", options.host.max_piece_bytes,
                 "limit of all pieces of meshes that are kept, as they were sent")
      ->envname("NDMAP_MAX_PIECE_BYTES")
      ->transform(CLI::AsSizeValue(false))
      ->capture_default_str();
  double piece_seconds = absl::ToDoubleSeconds(options.host.max_piece_time);
  app.add_option("--max-piece-seconds", piece_seconds,
                 "how long pieces of a mesh wait for their map after the last came")
      ->envname("NDMAP_MAX_PIECE_SECONDS")
      ->check(CLI::Range(1e-3, 1e6))
      ->capture_default_str();
  app.add_option("--max-query-darts", options.service.max_query_darts,
                 "limit of the darts that one question of a client may come to")
      ->envname("NDMAP_MAX_QUERY_DARTS")
      ->check(CLI::Range(uint64_t{1}, server::kMostQueryDarts))
      ->capture_default_str();
  server::QueryLimits& limits = options.service.query_limits;
  app.add_option("--max-queries", limits.max_queries, "most questions of clients answered at one time")
      ->envname("NDMAP_MAX_QUERIES")
      ->check(CLI::Range(1u, 65536u))
      ->capture_default_str();
  app.add_option("--max-response-bytes", limits.max_response_bytes, "limit of one answer, exports excepted")
      ->envname("NDMAP_MAX_RESPONSE_BYTES")
      ->transform(CLI::AsSizeValue(false))
      ->check(CLI::Range(uint64_t{1}, uint64_t{1} << 40))
      ->capture_default_str();
  double query_seconds = absl::ToDoubleSeconds(limits.max_query_time);
  app.add_option("--max-query-seconds", query_seconds, "longest time that a question of a client may take")
      ->envname("NDMAP_MAX_QUERY_SECONDS")
      ->check(CLI::Range(1e-3, 1e6))
      ->capture_default_str();
  double export_seconds = absl::ToDoubleSeconds(limits.max_export_time);
  app.add_option("--max-export-seconds", export_seconds,
                 "longest time that the export of a piece may take, or reading or writing all values")
      ->envname("NDMAP_MAX_EXPORT_SECONDS")
      ->check(CLI::Range(1e-3, 1e6))
      ->capture_default_str();
  int exit_code = 0;
  if (!service::Parse(app, argc, argv, exit_code)) return exit_code;
  auto fail = [](const absl::Status& status) {
    std::cerr << "ndmap-server: " << status.message() << '\n';
    return 1;
  };
  if (options.coordinator.empty())
    return fail(absl::InvalidArgumentError("--coordinator HOST:PORT is missing"));
  if (absl::Status status = service::BeginProgram(program); !status.ok()) return fail(status);
  options.listen = program.listen;
  options.coordinator_timeout = absl::Seconds(coordinator_timeout);
  options.host.max_piece_time = absl::Seconds(piece_seconds);
  limits.max_query_time = absl::Seconds(query_seconds);
  limits.max_export_time = absl::Seconds(export_seconds);
  options.host.factory = [](absl::string_view name, const Parameters& parameters,
                            const Environment& environment,
                            Block3& block) { return MakeAlgorithm(name, parameters, environment, block); };
  auto server = server::BlockServer::Start(std::move(options));
  if (!server.ok()) return fail(server.status());
  if (absl::Status s = service::WritePortFile(program.port_file, (*server)->port()); !s.ok()) return fail(s);
  spdlog::info("serving at {}", (*server)->address());
  service::AwaitSignal([&] { (*server)->Stop(); });
  return 0;
}

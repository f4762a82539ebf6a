// SPDX-License-Identifier: GPL-3.0-or-later
// run, up and sample: what needs no cluster yet.
#include <algorithm>
#include <cstdio>
#include <memory>
#include <thread>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "client/cli/context.h"
#include "client/cli/local_cluster.h"
#include "client/cli/output_folder.h"
#include "client/cli/run.h"
#include "client/cli/run_phases.h"
#include "client/cli/text.h"
#include "core/io/sample_surface.h"
#include "core/io/surface_reader.h"

namespace ndmap::cli {
namespace {

void AddProcessOptions(CLI::App* command, uint32_t* processes, uint32_t* threads, bool* show_logs) {
  command->add_option("--processes", *processes, "block servers (default: one a core, at most one a block)")
      ->check(WholeNumber(1, 1024));
  command->add_option("--threads", *threads, "worker threads of each block server")
      ->check(WholeNumber(1, 1024));
  command->add_flag("--show-logs", *show_logs, "the services' logs on standard error");
}

absl::StatusOr<int> Up(Context& context, const LocalClusterOptions& options) {
  ChildProcesses children;
  context.interrupts.SetHandlers(
      [&] {
        context.progress.Note("stopping (again: at once)");
        children.Stop();
        return true;
      },
      [&] { children.KillAll(); });
  absl::StatusOr<LocalCluster> cluster = LocalCluster::Start(options, children);
  if (!cluster.ok()) {
    context.interrupts.YieldToHandler();
    context.interrupts.ClearHandlers();
    return cluster.status();
  }
  context.Print({{"coordinator", cluster->address()}, {"processes", options.servers}},
                absl::StrCat("coordinator ", cluster->address(), "\n"));
  std::fflush(stdout);
  context.progress.Note(absl::StrCat("use it with --coordinator ", cluster->address(),
                                     ", or export NDMAP_COORDINATOR=", cluster->address(),
                                     "; Ctrl-C stops it"));
  const absl::Status ended = cluster->WaitForEnd();
  context.interrupts.YieldToHandler();
  context.interrupts.ClearHandlers();
  return ended;
}

}  // namespace

void AddRunCommand(CLI::App& app, Action& action) {
  CLI::App* command =
      AddCommand(app, "run", "refine a surface on a cluster of this machine, from file to mesh",
                 "ndmap run bunny.off --blocks 4 --depth 5 -o out/bunny --png bunny.png");
  auto options = std::make_shared<RunOptions>();
  command->add_option("SURFACE", options->surface, "OFF, OBJ, PLY or STL file of a closed surface (also .xz)")
      ->required();
  AddGridOptions(command, &options->grid);
  AddDepthOptions(command, &options->depth);
  AddProcessOptions(command, &options->processes, &options->threads, &options->show_logs);
  command
      ->add_option("--memory-limit", options->memory_limit,
                   "stop refining a block at this size (256MiB, 1GiB)")
      ->transform(ByteSize());
  CLI::Option* async =
      command->add_flag("--async", options->async, "refine all levels in one phase, and erase at the end");
  command
      ->add_option("--parts", options->parts,
                   "refine the last level in this many parts, erasing after each (default: by size)")
      ->check(WholeNumber(1, kMostParts))
      ->excludes(async);
  AddKeepOption(command, &options->keep);
  AddCellsOption(command, &options->cells);
  command->add_flag("!--no-check", options->check, "do not check the map at the end");
  command->add_option("-o,--output", options->output, "folder for the mesh (VTU pieces and mesh.pvtu)");
  command->add_option("--png", options->png, "draw the mesh into this file");
  command->add_flag("--dry-run", options->dry_run, "predict hexahedra, memory, time and disk; start nothing");
  command->callback(
      [&action, options] { action = [options](Context& context) { return Run(context, *options); }; });
}

void AddUpCommand(CLI::App& app, Action& action) {
  CLI::App* command = AddCommand(app, "up", "keep a cluster running on this machine until Ctrl-C",
                                 "ndmap up --processes 4 --port 7000");
  struct Options {
    LocalClusterOptions cluster;
    uint32_t processes = 0, threads = 0, port = 0;
  };
  auto options = std::make_shared<Options>();
  AddProcessOptions(command, &options->processes, &options->threads, &options->cluster.show_logs);
  command->add_option("--port", options->port, "the coordinator's port (default: a free one)")
      ->check(WholeNumber(1, 65535));
  command->callback([&action, options] {
    action = [options](Context& context) {
      const uint32_t cores = std::max(1u, std::thread::hardware_concurrency());
      options->cluster.servers = options->processes > 0 ? options->processes : cores;
      options->cluster.threads =
          options->threads > 0 ? options->threads : std::max(1u, cores / options->cluster.servers);
      options->cluster.port = static_cast<uint16_t>(options->port);
      return Up(context, options->cluster);
    };
  });
}

void AddSampleCommand(CLI::App& app, Action& action) {
  CLI::App* command = AddCommand(app, "sample", "make a closed sample surface",
                                 "ndmap sample bumpy-torus -o bumpy-torus.off");
  struct Options {
    std::string kind, output;
    SampleOptions sample;
  };
  auto options = std::make_shared<Options>();
  command->add_option("KIND", options->kind, absl::StrJoin(SampleKinds(), ", "))
      ->required()
      ->check(OneOf(SampleKinds()));
  command->add_option("-o,--output", options->output, "the OFF file")->required();
  command->add_option("--triangles", options->sample.triangles, "about that many")
      ->check(WholeNumber(100, 20000000))
      ->capture_default_str();
  command->add_option("--scale", options->sample.scale, "coordinates are multiplied by it")
      ->check(PositiveNumber())
      ->capture_default_str();
  command->callback([&action, options] {
    action = [options](Context& context) -> absl::StatusOr<int> {
      absl::StatusOr<TriangleSurface> surface = MakeSample(options->kind, options->sample);
      if (!surface.ok()) return surface.status();
      absl::Status status = MakeParentFolder(options->output);
      if (status.ok()) status = WriteOff(options->output, *surface);
      if (!status.ok()) return status;
      context.Print({{"file", options->output},
                     {"points", surface->points.size()},
                     {"triangles", surface->triangles.size()}},
                    absl::StrCat(options->output, ": ", surface->triangles.size(), " triangles, ",
                                 surface->points.size(), " points\n"));
      return 0;
    };
  });
}

}  // namespace ndmap::cli

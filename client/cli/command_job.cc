// SPDX-License-Identifier: GPL-3.0-or-later
// jobs, watch, cancel, export, version.
#include <memory>

#include "absl/strings/str_cat.h"
#include "client/cli/context.h"
#include "client/cli/export.h"
#include "client/cli/grid_options.h"
#include "client/cli/job_display.h"
#include "client/cli/map_report.h"
#include "client/cli/text.h"

namespace ndmap::cli {
namespace {

void AddJobs(CLI::App& app, Action& action) {
  auto map = std::make_shared<std::string>();
  CLI::App* command =
      AddCommand(app, "jobs", "the jobs of a cluster, or of one map", "ndmap jobs --map bunny");
  command->add_option("--map", *map, "only of this map");
  command->callback([&action, map] {
    action = [map](Context& context) -> absl::StatusOr<int> {
      absl::StatusOr<Client> client = context.Connect();
      if (!client.ok()) return client.status();
      absl::StatusOr<std::vector<v1::Job>> jobs = client->ListJobs(*map);
      if (!jobs.ok()) return jobs.status();
      PrintJobs(context, *jobs);
      return 0;
    };
  });
}

CLI::App* AddJobCommand(CLI::App& app, const char* name, const char* what, const char* example,
                        uint64_t* job) {
  CLI::App* command = AddCommand(app, name, what, example);
  command->add_option("JOB", *job, "number of the job")
      ->required()
      ->check(WholeNumber(1, std::numeric_limits<int64_t>::max()));
  return command;
}

void AddWatch(CLI::App& app, Action& action) {
  auto number = std::make_shared<uint64_t>(0);
  CLI::App* command = AddJobCommand(app, "watch", "watch a job until it ends (Ctrl-C leaves it running)",
                                    "ndmap watch 3", number.get());
  command->callback([&action, number] {
    action = [number](Context& context) -> absl::StatusOr<int> {
      absl::StatusOr<Client> client = context.Connect();
      if (!client.ok()) return client.status();
      absl::StatusOr<v1::Job> job = WatchJob(context, client->Job(*number), false);
      if (!job.ok()) return job.status();
      context.Print(JobAsJson(*job), JobAsText(*job));
      return 0;
    };
  });
}

void AddCancel(CLI::App& app, Action& action) {
  auto number = std::make_shared<uint64_t>(0);
  CLI::App* command = AddJobCommand(app, "cancel", "stop a job at the next safe place: its map stays valid",
                                    "ndmap cancel 3", number.get());
  command->callback([&action, number] {
    action = [number](Context& context) -> absl::StatusOr<int> {
      absl::StatusOr<Client> client = context.Connect();
      if (!client.ok()) return client.status();
      const JobHandle handle = client->Job(*number);
      absl::Status status = handle.Cancel();
      if (!status.ok()) return status;
      absl::StatusOr<v1::Job> job = handle.Wait();
      if (!job.ok()) return job.status();
      context.Print(JobAsJson(*job), JobAsText(*job));
      return 0;
    };
  });
}

struct ExportOptions {
  std::string map, output, cells = "hexahedron", png, attributes = "all";
};

absl::StatusOr<int> Export(Context& context, const ExportOptions& options) {
  absl::StatusOr<Client> client = context.Connect();
  if (!client.ok()) return client.status();
  absl::StatusOr<MapHandle> map = client->OpenMap(options.map);
  if (!map.ok()) return map.status();
  absl::StatusOr<std::vector<std::string>> notes = CheckExportedAttributes(map->info(), options.attributes);
  if (!notes.ok()) return notes.status();
  for (const std::string& note : *notes) context.progress.Note(note);
  MadeFiles made;
  ChildProcesses picture;
  absl::Status status = made.MakeFolder(options.output);
  if (status.ok()) status = made.LockFolder(options.output);
  if (!status.ok()) return status;
  context.interrupts.SetHandlers(
      [&] {
        picture.Stop(absl::Milliseconds(500));
        made.TakeBack();
        return true;
      },
      [&] { picture.KillAll(); });
  absl::StatusOr<Exported> exported =
      ExportMap(*map, options.cells, options.attributes, options.output, made, context.progress);
  if (exported.ok() && !options.png.empty()) {
    made.Expect(options.png);
    status = DrawPicture(exported->index, options.png, picture, context.progress);
    if (!status.ok()) context.progress.Note(absl::StrCat("note: ", status.message()));
  }
  context.interrupts.ClearHandlers();
  if (!exported.ok()) return exported.status();
  made.Keep();
  Json json{{"map", options.map},
            {"index", exported->index},
            {"pieces", exported->pieces},
            {"bytes", exported->bytes},
            {"cells", exported->cells}};
  context.Print(json, absl::StrCat(exported->index, ": ", FormatBytes(exported->bytes), " in ",
                                   exported->pieces.size(), " pieces; open it in ParaView\n"));
  return 0;
}

void AddExport(CLI::App& app, Action& action) {
  auto options = std::make_shared<ExportOptions>();
  CLI::App* command =
      AddCommand(app, "export", "write a map as VTU pieces and mesh.pvtu", "ndmap export bunny -o out/bunny");
  command->add_option("MAP", options->map, "name of the map")->required();
  command->add_option("-o,--output", options->output, "folder for the files")->required();
  AddCellsOption(command, &options->cells);
  command
      ->add_option("--attributes", options->attributes,
                   "attributes of vertices and hexahedra to write: all, none, or names separated by commas")
      ->capture_default_str();
  command->add_option("--png", options->png, "draw the mesh into this file");
  command->callback(
      [&action, options] { action = [options](Context& context) { return Export(context, *options); }; });
}

}  // namespace

void AddJobCommands(CLI::App& app, Action& action) {
  AddExport(app, action);
  AddJobs(app, action);
  AddWatch(app, action);
  AddCancel(app, action);
}

void AddVersionCommand(CLI::App& app, Action& action) {
  CLI::App* command = AddCommand(
      app, "version", "versions of this program and, if one is named, of a cluster", "ndmap version");
  command->callback([&action] {
    action = [](Context& context) -> absl::StatusOr<int> {
      Json json{{"ndmap", NDMAP_RELEASE}, {"protocol", int{v1::PROTOCOL_CURRENT}}};
      std::string text =
          absl::StrCat("ndmap ", NDMAP_RELEASE, ", protocol ", int{v1::PROTOCOL_CURRENT}, "\n");
      if (!context.coordinator.empty()) {
        absl::StatusOr<Client> client = context.Connect();
        if (!client.ok()) return client.status();
        absl::StatusOr<std::vector<v1::Server>> servers = client->ListServers();
        if (!servers.ok()) return servers.status();
        json["coordinator"] = {{"address", client->target()}, {"release", client->version().release()}};
        absl::StrAppend(&text, "coordinator ", client->target(), " ", client->version().release(), "\n");
        json["servers"] = Json::array();
        for (const v1::Server& server : *servers) {
          json["servers"].push_back({{"address", server.address()},
                                     {"release", server.version().release()},
                                     {"threads", server.capacity()},
                                     {"blocks", server.blocks()},
                                     {"alive", server.alive()}});
          absl::StrAppend(&text, "block server ", server.address(), " ", server.version().release(), ", ",
                          server.capacity(), " threads, ", server.blocks(), " blocks",
                          server.alive() ? "" : ", LOST", "\n");
        }
      }
      context.Print(json, text);
      return 0;
    };
  });
}

}  // namespace ndmap::cli

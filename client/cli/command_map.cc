// SPDX-License-Identifier: GPL-3.0-or-later
// Commands that make, change, ask and delete maps of a running cluster.
#include <algorithm>
#include <cstdio>
#include <memory>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/cli/cell_report.h"
#include "client/cli/command_create.h"
#include "client/cli/context.h"
#include "client/cli/grid_options.h"
#include "client/cli/job_display.h"
#include "client/cli/map_report.h"
#include "client/cli/text.h"
#include "core/algorithm/refine/oracle.h"
#include "core/map/ids.h"

namespace ndmap::cli {
namespace {

// A command with one argument, the map's name.
CLI::App* AddMapCommand(CLI::App& app, const char* name, const char* what, const char* example,
                        std::string* map) {
  CLI::App* command = AddCommand(app, name, what, example);
  command->add_option("MAP", *map, "name of the map")->required();
  return command;
}

absl::StatusOr<int> PrintJob(Context& context, const absl::StatusOr<v1::Job>& job) {
  if (!job.ok()) return job.status();
  context.Print(JobAsJson(*job), JobAsText(*job));
  return 0;
}

struct RefineOptions {
  std::string map;
  int depth = 4;
  uint64_t memory_limit = 0;
  bool async = false, no_wait = false;
  // Of the oracle; empty: not given.
  std::string oracle = "surface", lo, hi, centre, radius, size, cells;
};

absl::Status CheckBox(const std::string& lo_text, const std::string& hi_text) {
  const auto lo = ParsePoint(lo_text), hi = ParsePoint(hi_text);
  if (!lo.ok()) return absl::InvalidArgumentError(absl::StrCat("--lo: ", lo.status().message()));
  if (!hi.ok()) return absl::InvalidArgumentError(absl::StrCat("--hi: ", hi.status().message()));
  for (size_t c = 0; c < 3; ++c) {
    if ((*lo)[c] <= (*hi)[c]) continue;
    return absl::InvalidArgumentError(absl::StrCat("the box is empty: --lo is ", ExactNumber((*lo)[c]),
                                                   " in ", std::string(1, "xyz"[c]),
                                                   ", above --hi, which is ", ExactNumber((*hi)[c])));
  }
  return absl::OkStatus();
}

// Hexahedra of the depth and beyond are not refined: whoever lists one means a greater depth.
absl::Status CheckListed(const std::string& text, int depth) {
  const auto cells = ParseCellIds(text);
  if (!cells.ok()) return absl::InvalidArgumentError(absl::StrCat("--cells: ", cells.status().message()));
  if (cells->empty()) return absl::InvalidArgumentError("--cells lists no hexahedron");
  const auto deepest = std::max_element(cells->begin(), cells->end(), [](const CellId& a, const CellId& b) {
    return std::pair(a.level(), b) < std::pair(b.level(), a);
  });
  if (deepest->level() < depth) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("--cells: ", deepest->ToString(), " is of level ", deepest->level(), ", and --depth ",
                   depth, " refines levels below ", depth, ": take --depth ", deepest->level() + 1));
}

// The oracle's parameters, or which one is missing or out of place.
absl::StatusOr<std::vector<std::pair<std::string, std::string>>> OracleParameters(const RefineOptions& o) {
  const std::pair<const char*, const std::string*> all[] = {{"lo", &o.lo},         {"hi", &o.hi},
                                                            {"centre", &o.centre}, {"radius", &o.radius},
                                                            {"size", &o.size},     {"cells", &o.cells}};
  const std::pair<const char*, const char*> uses[] = {{"box", "lo"},        {"box", "hi"},
                                                      {"sphere", "centre"}, {"sphere", "radius"},
                                                      {"size", "size"},     {"list", "cells"}};
  std::vector<std::pair<std::string, std::string>> parameters = {{"oracle", o.oracle}};
  for (const auto& [name, value] : all) {
    bool used = false;
    for (const auto& [oracle, parameter] : uses)
      used = used || (o.oracle == oracle && name == absl::string_view(parameter));
    if (used && value->empty()) {
      return absl::InvalidArgumentError(absl::StrCat("--oracle ", o.oracle, " needs --", name));
    }
    if (!used && !value->empty()) {
      return absl::InvalidArgumentError(absl::StrCat("--", name, " is not for --oracle ", o.oracle));
    }
    if (used) parameters.emplace_back(name, *value);
  }
  if (o.oracle == "box") {
    if (absl::Status status = CheckBox(o.lo, o.hi); !status.ok()) return status;
  }
  if (o.oracle == "list") {
    if (absl::Status status = CheckListed(o.cells, o.depth); !status.ok()) return status;
  }
  if (o.memory_limit > 0) parameters.emplace_back("memory_limit", absl::StrCat(o.memory_limit));
  return parameters;
}

absl::StatusOr<int> Refine(Context& context, const RefineOptions& options) {
  auto parameters = OracleParameters(options);
  if (!parameters.ok()) return parameters.status();
  absl::StatusOr<MapHandle> map = context.OpenMap(options.map);
  if (!map.ok()) return map.status();
  if (absl::Status s = CheckDepthOfMap(map->info(), options.depth); !s.ok()) return s;
  std::vector<v1::Phase> phases = RefinePhases(options.depth, options.async, *parameters);
  // On which side of the surface the new hexahedra are.
  if (!map->info().surface_id().empty()) phases.push_back(MakePhase("classify"));
  absl::StatusOr<JobHandle> job = map->StartJob("refine", phases);
  if (!job.ok()) return job.status();
  if (options.no_wait) {
    context.Print({{"job", job->id()}, {"map", options.map}},
                  absl::StrCat("job ", job->id(), " (ndmap watch ", job->id(), ")\n"));
    return 0;
  }
  return PrintJob(context, WatchJob(context, *job, true));
}

void AddRefine(CLI::App& app, Action& action) {
  auto options = std::make_shared<RefineOptions>();
  CLI::App* command =
      AddMapCommand(app, "refine", "split hexahedra in eight where an oracle says so",
                    "ndmap refine bunny --depth 5 --coordinator 127.0.0.1:7000", &options->map);
  command->add_option("--depth", options->depth, "hexahedra of levels 0 ... DEPTH")
      ->check(WholeNumber(1, kMaxDepth, "ids of cells hold 29 levels"))
      ->capture_default_str();
  command
      ->add_option("--oracle", options->oracle,
                   "what is refined: surface, everything, box, sphere, size or list")
      ->check(OneOf({"surface", "everything", "box", "sphere", "size", "list"}))
      ->capture_default_str();
  command->add_option("--lo", options->lo, "box: lower corner, x,y,z");
  command->add_option("--hi", options->hi, "box: upper corner, x,y,z");
  command->add_option("--centre", options->centre, "sphere: centre, x,y,z");
  command->add_option("--radius", options->radius, "sphere: radius")->check(PositiveNumber());
  command->add_option("--size", options->size, "size: hexahedra with a longer edge")->check(PositiveNumber());
  command->add_option("--cells", options->cells, "list: ids with spaces between them, \"h12 h12/0.3\"");
  command->add_flag("--async", options->async, "all levels in one phase");
  command
      ->add_option("--memory-limit", options->memory_limit,
                   "stop refining a block at this size (256MiB, 1GiB)")
      ->transform(ByteSize());
  command->add_flag("--no-wait", options->no_wait, "print the job's number and return");
  command->callback(
      [&action, options] { action = [options](Context& context) { return Refine(context, *options); }; });
}

// trim, check, hash: a job with fixed phases.
void AddTrim(CLI::App& app, Action& action) {
  struct Options {
    std::string map, keep = "inside,cut";
  };
  auto options = std::make_shared<Options>();
  CLI::App* command = AddMapCommand(app, "trim", "erase the hexahedra outside the surface",
                                    "ndmap trim bunny --keep inside,cut", &options->map);
  AddKeepOption(command, &options->keep);
  command->callback([&action, options] {
    action = [options](Context& context) -> absl::StatusOr<int> {
      absl::StatusOr<MapHandle> map = context.OpenMap(options->map);
      if (!map.ok()) return map.status();
      return PrintJob(context, RunJob(context, *map, "trim",
                                      {MakePhase("classify"), MakePhase("trim", {{"keep", options->keep}})}));
    };
  });
}

void AddCheck(CLI::App& app, Action& action) {
  auto name = std::make_shared<std::string>();
  CLI::App* command =
      AddMapCommand(app, "check", "check every property of the distributed map (exit code 1: faults)",
                    "ndmap check bunny", name.get());
  command->callback([&action, name] {
    action = [name](Context& context) -> absl::StatusOr<int> {
      absl::StatusOr<MapHandle> map = context.OpenMap(*name);
      if (!map.ok()) return map.status();
      absl::StatusOr<v1::Job> job = RunJob(context, *map, "check", {MakePhase("check")});
      if (!job.ok()) return job.status();
      return PrintCheck(context, *name, job->results(0).report());
    };
  });
}

void AddHash(CLI::App& app, Action& action) {
  auto name = std::make_shared<std::string>();
  CLI::App* command = AddMapCommand(app, "hash", "the canonical hash: equal for equal global maps",
                                    "ndmap hash bunny", name.get());
  command->callback([&action, name] {
    action = [name](Context& context) -> absl::StatusOr<int> {
      absl::StatusOr<MapHandle> map = context.OpenMap(*name);
      if (!map.ok()) return map.status();
      absl::StatusOr<v1::Job> job = RunJob(context, *map, "hash", {MakePhase("hash")});
      if (!job.ok()) return job.status();
      PrintHash(context, *name, job->results(0).report());
      return 0;
    };
  });
}

void AddStats(CLI::App& app, Action& action) {
  auto name = std::make_shared<std::string>();
  CLI::App* command = AddMapCommand(app, "stats", "hexahedra, darts and memory by block, hexahedra by level",
                                    "ndmap stats bunny --json", name.get());
  command->callback([&action, name] {
    action = [name](Context& context) -> absl::StatusOr<int> {
      absl::StatusOr<MapHandle> map = context.OpenMap(*name);
      if (!map.ok()) return map.status();
      absl::StatusOr<v1::Job> job = RunJob(context, *map, "count", {MakePhase("count")});
      if (!job.ok()) return job.status();
      absl::StatusOr<std::vector<v1::BlockStats>> blocks = map->Stats();
      if (!blocks.ok()) return blocks.status();
      PrintStats(context, map->info(), *blocks, job->results(0).report());
      return 0;
    };
  });
}

void AddDelete(CLI::App& app, Action& action) {
  auto name = std::make_shared<std::string>();
  CLI::App* command = AddMapCommand(app, "delete", "delete a map, and its surface if no other map uses it",
                                    "ndmap delete bunny", name.get());
  command->callback([&action, name] {
    action = [name](Context& context) -> absl::StatusOr<int> {
      absl::StatusOr<Client> client = context.Connect();
      if (!client.ok()) return client.status();
      absl::StatusOr<MapHandle> map = client->OpenMap(*name);
      if (!map.ok()) return map.status();
      absl::Status status = client->DeleteMap(*name);
      if (!status.ok()) return status;
      const std::string& surface = map->info().surface_id();
      if (!surface.empty()) status = client->DeleteSurface(surface);
      // FAILED_PRECONDITION: another map uses it. NOT_FOUND: whoever deleted another map of it at the same
      // time was faster.
      if (!status.ok() && !absl::IsFailedPrecondition(status) && !absl::IsNotFound(status)) return status;
      context.Print({{"deleted", *name}, {"surface_deleted", !surface.empty() && status.ok()}},
                    absl::StrCat(*name, " is deleted\n"));
      return 0;
    };
  });
}

void AddMaps(CLI::App& app, Action& action) {
  CLI::App* command = AddCommand(app, "maps", "the maps of a cluster", "ndmap maps");
  auto names = std::make_shared<bool>(false);
  command->add_flag("--names", *names, "their names alone, one a line");
  command->callback([&action, names] {
    action = [names](Context& context) -> absl::StatusOr<int> {
      absl::StatusOr<Client> client = context.Connect();
      if (!client.ok()) return client.status();
      absl::StatusOr<std::vector<v1::Map>> maps = client->ListMaps();
      if (!maps.ok()) return maps.status();
      if (*names && !context.json) {
        for (const v1::Map& map : *maps) std::printf("%s\n", map.map().c_str());
      } else {
        PrintMaps(context, *maps);
      }
      return 0;
    };
  });
}

}  // namespace

void AddMapCommands(CLI::App& app, Action& action) {
  AddCreateCommand(app, action);
  AddRefine(app, action);
  AddTrim(app, action);
  AddStats(app, action);
  AddCheck(app, action);
  AddHash(app, action);
  AddDelete(app, action);
  AddMaps(app, action);
}

}  // namespace ndmap::cli

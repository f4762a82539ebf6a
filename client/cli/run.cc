// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/run.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <thread>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "client/cli/export.h"
#include "client/cli/job_display.h"
#include "client/cli/local_cluster.h"
#include "client/cli/output_folder.h"
#include "client/cli/report.h"
#include "client/cli/run_phases.h"
#include "client/cli/text.h"

namespace ndmap::cli {
namespace {

constexpr const char* kMapName = "run";

double OwnCpuSeconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

v1::ProcessStats OwnStats() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  v1::ProcessStats stats;
  stats.set_program("ndmap");
  stats.set_pid(getpid());
  stats.set_peak_rss_bytes(static_cast<uint64_t>(usage.ru_maxrss) * 1024);
  stats.set_user_seconds(static_cast<double>(usage.ru_utime.tv_sec) +
                         1e-6 * static_cast<double>(usage.ru_utime.tv_usec));
  stats.set_system_seconds(static_cast<double>(usage.ru_stime.tv_sec) +
                           1e-6 * static_cast<double>(usage.ru_stime.tv_usec));
  return stats;
}

// One run from beginning to end. What it starts and makes is taken back by the destructor or by an interrupt.
class Runner {
 public:
  Runner(Context& context, const RunOptions& options) : context_(context), options_(options) {}
  ~Runner() { context_.interrupts.ClearHandlers(); }

  absl::StatusOr<int> Go();

 private:
  // Takes the time of a step on this side of the wire.
  template <class F>
  absl::Status Step(const char* name, F step) {
    const absl::Time begin = absl::Now();
    const double cpu = OwnCpuSeconds();
    absl::Status status = step();
    report_.steps.push_back({name, absl::ToDoubleSeconds(absl::Now() - begin), OwnCpuSeconds() - cpu});
    return status;
  }
  void HandleInterrupts();
  absl::Status Prepare();
  absl::Status StartCluster();
  absl::Status Load();
  absl::Status Create();
  absl::Status Refine();
  // The last level, classifying and erasing: in turn where that is worth it.
  absl::Status RefineLastLevel(const PhaseParameters& parameters);
  // One job on the map, its results kept for the report.
  absl::Status Job(const std::string& kind, const std::vector<v1::Phase>& phases, uint64_t cells);
  absl::Status Finished(const absl::StatusOr<v1::Job>& job);
  absl::Status Export();
  absl::Status AskProcesses();

  Context& context_;
  const RunOptions& options_;
  // In this order: children outlive the cluster, files go last.
  MadeFiles made_;
  ChildProcesses picture_;
  ChildProcesses children_;
  std::unique_ptr<LocalCluster> cluster_;
  std::unique_ptr<MapHandle> map_;
  SurfaceFile file_;
  GridShape grid_;
  int depth_ = 0;
  Processes processes_;
  std::string surface_id_;
  std::string folder_;
  RunReport report_;
};

void Runner::HandleInterrupts() {
  context_.interrupts.SetHandlers(
      [this] {
        context_.progress.Note("interrupted: stopping (again: at once)");
        picture_.Stop(absl::Milliseconds(500));
        children_.Stop();
        made_.TakeBack();
        return true;
      },
      [this] {
        picture_.KillAll();
        children_.KillAll();
      });
}

absl::Status Runner::Prepare() {
  absl::StatusOr<Processes> processes = ProcessesFor(options_);
  if (!processes.ok()) return processes.status();
  processes_ = *processes;
  if (!options_.output.empty()) {
    absl::Status status = made_.MakeFolder(options_.output);
    if (status.ok()) status = made_.LockFolder(options_.output);
    if (!status.ok()) return status;
    folder_ = options_.output;
  }
  absl::StatusOr<SurfaceFile> file = ReadSurfaceAndTell(options_.surface, context_.progress);
  if (!file.ok()) return file.status();
  file_ = *std::move(file);
  absl::StatusOr<GridShape> grid = MakeGrid(options_.grid, file_.surface);
  if (!grid.ok()) return grid.status();
  grid_ = *grid;
  absl::StatusOr<int> depth = DepthOf(options_.depth, grid_);
  if (!depth.ok()) return depth.status();
  depth_ = *depth;
  WarnAboutSmallComponents(file_.surface, grid_, context_.progress);
  if (options_.png.empty()) return absl::OkStatus();
  const std::string png_folder = std::filesystem::path(options_.png).parent_path().string();
  absl::Status status = made_.MakeFolder(png_folder.empty() ? "." : png_folder);
  if (!status.ok() || !folder_.empty()) return status;
  // A picture is drawn from an export, which nobody wants to keep here.
  absl::StatusOr<std::string> temporary = made_.MakeTemporaryFolder();
  if (temporary.ok()) folder_ = *temporary;
  return temporary.status();
}

absl::Status Runner::StartCluster() {
  context_.progress.Begin("start");
  LocalClusterOptions options;
  options.servers = processes_.servers;
  options.threads = processes_.threads;
  options.show_logs = options_.show_logs;
  absl::StatusOr<LocalCluster> cluster = LocalCluster::Start(options, children_);
  if (!cluster.ok()) {
    context_.progress.Abandon();
    return cluster.status();
  }
  cluster_ = std::make_unique<LocalCluster>(*std::move(cluster));
  context_.progress.End(absl::StrCat("coordinator and ", options.servers, " block server",
                                     options.servers == 1 ? "" : "s", " with ", options.threads, " thread",
                                     options.threads == 1 ? "" : "s", " each"));
  return absl::OkStatus();
}

absl::Status Runner::Load() {
  context_.progress.Begin("load");
  absl::StatusOr<std::string> id = cluster_->client().UploadSurface(
      ViewOf(file_.surface, options_.surface), [&](uint64_t sent, uint64_t total) {
        context_.progress.Update(static_cast<double>(sent) / static_cast<double>(total), FormatBytes(sent));
      });
  if (!id.ok()) {
    context_.progress.Abandon();
    return id.status();
  }
  surface_id_ = *id;
  report_.triangles = file_.surface.triangles.size();
  const uint64_t bytes = file_.surface.points.size() * 24 + report_.triangles * 12;
  // The services have it now.
  file_ = {};
  context_.progress.End(FormatBytes(bytes));
  return absl::OkStatus();
}

absl::Status Runner::Finished(const absl::StatusOr<v1::Job>& job) {
  if (!job.ok()) return job.status();
  for (const v1::PhaseResult& result : job->results()) report_.phases.push_back(result);
  return StatusOf(*job);
}

absl::Status Runner::Create() {
  absl::StatusOr<JobHandle> job =
      cluster_->client().CreateMap(CreateRequest(kMapName, surface_id_, grid_, options_.grid, depth_));
  if (!job.ok()) return job.status();
  JobDisplay display(context_.progress, 0);
  absl::Status status = Finished(display.Wait(*job));
  if (!status.ok()) return status;
  absl::StatusOr<MapHandle> map = cluster_->client().OpenMap(kMapName);
  if (!map.ok()) return map.status();
  map_ = std::make_unique<MapHandle>(*std::move(map));
  return absl::OkStatus();
}

absl::Status Runner::Job(const std::string& kind, const std::vector<v1::Phase>& phases, uint64_t cells) {
  absl::StatusOr<JobHandle> job = map_->StartJob(kind, phases);
  if (!job.ok()) return job.status();
  JobDisplay display(context_.progress, cells);
  return Finished(display.Wait(*job));
}

absl::Status Runner::Refine() {
  PhaseParameters parameters = {{"oracle", "surface"}};
  if (options_.memory_limit > 0) parameters.emplace_back("memory_limit", absl::StrCat(options_.memory_limit));
  std::vector<v1::Phase> phases = RefinePhases(depth_, options_.async, parameters);
  absl::Status status;
  if (ErasesEarly(options_.async, depth_, options_.keep)) {
    phases.pop_back();
    status = Job("refine", phases, grid_.CellCount());
    if (status.ok()) status = RefineLastLevel(parameters);
  } else {
    phases.push_back(MakePhase("classify"));
    status = Job("refine", phases, grid_.CellCount());
    if (status.ok()) status = Job("trim", {MakePhase("trim", {{"keep", options_.keep}})}, 0);
  }
  if (!status.ok()) return status;
  phases = {MakePhase("count"), MakePhase("hash")};
  if (options_.check) phases.push_back(MakePhase("check"));
  return Job("check", phases, 0);
}

absl::Status Runner::RefineLastLevel(const PhaseParameters& parameters) {
  const auto cells = 8 * static_cast<uint64_t>(CountOf(report_.phases.back().report(), "refined"));
  // About half of them meet the surface.
  const uint32_t parts = options_.parts > 0 ? options_.parts : PartsFor(4 * static_cast<double>(cells));
  if (parts > 0) return Job("refine", ErasingPhases(depth_, options_.keep, parts, parameters), 0);
  absl::Status status =
      Job("refine", {RefinePhases(depth_, false, parameters).back(), MakePhase("classify")}, cells);
  if (!status.ok()) return status;
  return Job("trim", {MakePhase("trim", {{"keep", options_.keep}})}, 0);
}

absl::Status Runner::Export() {
  if (folder_.empty()) return absl::OkStatus();
  absl::StatusOr<Exported> exported =
      ExportMap(*map_, options_.cells, "none", folder_, made_, context_.progress);
  if (!exported.ok()) return exported.status();
  report_.output_bytes = exported->bytes;
  if (!options_.output.empty()) report_.output = exported->index;
  if (options_.png.empty()) return absl::OkStatus();
  made_.Expect(options_.png);
  absl::Status status = DrawPicture(exported->index, options_.png, picture_, context_.progress);
  // The mesh is there all the same.
  if (!status.ok() && context_.interrupts.signal() == 0) {
    context_.progress.Note(absl::StrCat("note: ", status.message()));
  }
  return absl::OkStatus();
}

absl::Status Runner::AskProcesses() {
  absl::StatusOr<v1::ProcessStats> coordinator = cluster_->client().CoordinatorStats();
  if (!coordinator.ok()) return coordinator.status();
  absl::StatusOr<std::vector<v1::ProcessStats>> servers = map_->ServerStats();
  if (!servers.ok()) return servers.status();
  report_.processes_at_end.emplace_back("ndmap", OwnStats());
  report_.processes_at_end.emplace_back("ndmap-coordinator", *coordinator);
  for (size_t i = 0; i < servers->size(); ++i) {
    report_.processes_at_end.emplace_back(absl::StrCat("ndmap-server-", i), (*servers)[i]);
  }
  return absl::OkStatus();
}

absl::StatusOr<int> Runner::Go() {
  const absl::Time begin = absl::Now();
  HandleInterrupts();
  absl::Status status = Step("read", [&] { return Prepare(); });
  if (status.ok()) status = Step("start", [&] { return StartCluster(); });
  if (status.ok()) status = Step("load", [&] { return Load(); });
  if (status.ok()) status = Create();
  if (status.ok()) status = Refine();
  if (status.ok()) status = Step("export", [&] { return Export(); });
  if (status.ok()) status = AskProcesses();
  if (!status.ok()) {
    context_.interrupts.YieldToHandler();
    // What a service said last explains more than the call that it did not answer.
    absl::Status services = cluster_ == nullptr ? absl::OkStatus() : cluster_->Check();
    return services.ok() ? status : services;
  }
  report_.surface = options_.surface;
  report_.map = map_->info();
  report_.depth = depth_;
  report_.processes = processes_.servers;
  status = Step("stop", [&] {
    // Nothing of theirs is wanted any more.
    children_.Stop(absl::Milliseconds(50));
    return absl::OkStatus();
  });
  report_.total_seconds = absl::ToDoubleSeconds(absl::Now() - begin);
  context_.interrupts.ClearHandlers();
  made_.Keep();
  if (const v1::PhaseResult* check = report_.Find("check")) {
    for (const std::string& finding : check->report().findings()) context_.progress.Note(finding);
  }
  context_.Print(ToJson(report_), ToText(report_));
  return report_.valid().value_or(true) ? 0 : 1;
}

}  // namespace

absl::StatusOr<Processes> ProcessesFor(const RunOptions& options) {
  if (options.processes > options.grid.blocks) {
    return absl::InvalidArgumentError(absl::StrCat("--processes ", options.processes, ": there are only ",
                                                   options.grid.blocks, " blocks to host"));
  }
  const uint32_t cores = std::max(1u, std::thread::hardware_concurrency());
  Processes processes;
  processes.servers = options.processes > 0 ? options.processes : std::min(options.grid.blocks, cores);
  processes.threads = options.threads > 0 ? options.threads : std::max(1u, cores / processes.servers);
  return processes;
}

absl::StatusOr<int> Run(Context& context, const RunOptions& options) {
  if (options.dry_run) return DryRun(context, options);
  return Runner(context, options).Go();
}

}  // namespace ndmap::cli

// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>
#include <memory>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/cli/estimate.h"
#include "client/cli/run.h"
#include "client/cli/run_phases.h"
#include "client/cli/table.h"
#include "client/cli/text.h"

namespace ndmap::cli {
namespace {

// Three digits are more than the estimate is worth.
std::string About(double value) {
  if (value < 1000) return FormatCount(std::llround(value));
  const double unit = std::pow(10, std::floor(std::log10(value)) - 2);
  return FormatCount(std::llround(std::round(value / unit) * unit));
}

Json LevelsAsJson(const Estimate& estimate) {
  Json levels = Json::array();
  for (size_t l = 0; l < estimate.levels.size(); ++l) {
    const Estimate::Level& level = estimate.levels[l];
    levels.push_back({{"level", l},
                      {"cells", std::llround(level.cells)},
                      {"refined", std::llround(level.refined)},
                      {"cut", std::llround(level.cut)},
                      {"inside", std::llround(level.inside)},
                      {"outside", std::llround(level.outside)}});
  }
  return levels;
}

std::string LevelsAsText(const Estimate& estimate) {
  Table table({"level", "hexahedra", "refined", "inside", "outside", "cut"});
  for (size_t l = 0; l < estimate.levels.size(); ++l) {
    const Estimate::Level& level = estimate.levels[l];
    table.Add({absl::StrCat(l), About(level.cells), About(level.refined), About(level.inside),
               About(level.outside), About(level.cut)});
  }
  return table.Text();
}

double Kept(const Estimate& estimate, const std::string& keep) {
  if (keep == "all") return estimate.made();
  if (keep == "inside") return estimate.inside();
  if (keep == "cut") return estimate.cut();
  return estimate.inside() + estimate.cut();
}

// The most hexahedra at one time: all that are made, or less where erasing comes in between (run.cc).
double Held(const Estimate& estimate, const RunOptions& options, int depth) {
  if (!ErasesEarly(options.async, depth, options.keep)) return estimate.made();
  const uint32_t parts =
      options.parts > 0 ? options.parts : PartsFor(4 * estimate.levels[static_cast<size_t>(depth) - 1].cells);
  if (parts == 0) return estimate.made();
  const Estimate::Level& last = estimate.levels.back();
  const bool sides = options.keep != "cut";
  const double kept = estimate.cut() + (sides ? estimate.inside() : 0);
  return kept + (last.outside + (sides ? 0 : last.inside)) / parts;
}

}  // namespace

absl::StatusOr<int> DryRun(Context& context, const RunOptions& options) {
  absl::StatusOr<Processes> processes = ProcessesFor(options);
  if (!processes.ok()) return processes.status();
  absl::StatusOr<SurfaceFile> file = ReadSurfaceAndTell(options.surface, context.progress);
  if (!file.ok()) return file.status();
  absl::StatusOr<GridShape> grid = MakeGrid(options.grid, file->surface);
  if (!grid.ok()) return grid.status();
  absl::StatusOr<int> depth = DepthOf(options.depth, *grid);
  if (!depth.ok()) return depth.status();
  WarnAboutSmallComponents(file->surface, *grid, context.progress);
  context.progress.Begin("estimate");
  const uint64_t triangles = file->surface.triangles.size();
  const auto surface = std::make_shared<const TriangleSurface>(std::move(file->surface));
  const Estimate estimate = EstimateRefinement(surface, *grid, *depth);
  context.progress.End("");
  const double kept = Kept(estimate, options.keep);
  const Cost cost =
      CostOf(estimate.made(), Held(estimate, options, *depth), kept, triangles, processes->servers);
  const double workers = std::min<double>(options.grid.blocks, processes->servers * processes->threads);
  const double seconds = cost.cpu_seconds / workers;
  const Json json{{"dry_run", true},
                  {"depth", *depth},
                  {"made", std::llround(estimate.made())},
                  {"cut", std::llround(estimate.cut())},
                  {"inside", std::llround(estimate.inside())},
                  {"hexahedra", std::llround(kept)},
                  {"memory_bytes", std::llround(cost.memory_bytes)},
                  {"cpu_seconds", cost.cpu_seconds},
                  {"seconds", seconds},
                  {"disk_bytes", std::llround(cost.disk_bytes)},
                  {"levels", LevelsAsJson(estimate)}};
  std::string text = LevelsAsText(estimate);
  absl::StrAppend(&text, "\nabout ", About(estimate.made()), " hexahedra made on ", grid->cells[0], "x",
                  grid->cells[1], "x", grid->cells[2], " to depth ", *depth, ", ", About(kept), " kept (",
                  About(estimate.cut()), " cut, ", About(estimate.inside()), " inside)\n", "about ",
                  FormatBytes(static_cast<uint64_t>(cost.memory_bytes)), " of memory in ", processes->servers,
                  " block servers\n", "about ", FormatSeconds(seconds), ", ", FormatSeconds(cost.cpu_seconds),
                  " of CPU\n", "about ", FormatBytes(static_cast<uint64_t>(cost.disk_bytes)), " on disk\n",
                  "nothing was started or written\n");
  context.Print(json, text);
  return 0;
}

}  // namespace ndmap::cli

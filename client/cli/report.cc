// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/report.h"

#include <algorithm>
#include <map>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/cli/job_display.h"
#include "client/cli/map_report.h"
#include "client/cli/table.h"
#include "client/cli/text.h"

namespace ndmap::cli {
namespace {

// One block, over all phases.
struct BlockTotals {
  int64_t hexahedra = 0, darts = 0, critical_darts = 0, accounted_bytes = 0;
  uint64_t messages = 0, message_bytes = 0;
  double busy_seconds = 0;
};

std::map<uint32_t, BlockTotals> TotalsByBlock(const RunReport& report) {
  std::map<uint32_t, BlockTotals> totals;
  for (const v1::PhaseResult& phase : report.phases) {
    for (const v1::BlockReport& block : phase.blocks()) {
      BlockTotals& sum = totals[block.progress().block()];
      sum.messages += block.progress().messages_sent();
      sum.message_bytes += block.progress().bytes_sent();
      sum.busy_seconds += block.progress().busy_seconds();
      if (phase.phase().algorithm() != "count") continue;
      sum.hexahedra = CountOf(block.report(), "hexahedra");
      sum.darts = CountOf(block.report(), "darts");
      sum.critical_darts = CountOf(block.report(), "critical_darts");
      sum.accounted_bytes = CountOf(block.report(), "accounted_bytes");
    }
  }
  return totals;
}

// Level by level: what was refined, and what stays.
Json Levels(const RunReport& report) {
  std::map<int, Json> levels;
  const v1::PhaseResult* count = report.Find("count");
  for (int level = 0; level <= report.depth; ++level) {
    const int64_t stay = count == nullptr ? 0 : CountOf(count->report(), absl::StrCat("level_", level));
    levels[level] = Json{{"level", level}, {"hexahedra", stay}};
  }
  for (const v1::PhaseResult& phase : report.phases) {
    const auto level = phase.phase().parameters().find("level");
    if (phase.phase().algorithm() != "refine" || level == phase.phase().parameters().end()) continue;
    Json& entry = levels[std::atoi(level->second.c_str())];
    // A level may have been refined in parts.
    const auto add = [&entry](const char* name, auto value) {
      entry[name] = entry.value(name, decltype(value){}) + value;
    };
    add("refined", CountOf(phase.report(), "refined"));
    add("refined_at_boundary", CountOf(phase.report(), "refined_at_boundary"));
    add("messages", phase.messages());
    add("message_bytes", phase.message_bytes());
    add("seconds", phase.wall_seconds());
    add("cpu_seconds", phase.user_seconds() + phase.system_seconds());
  }
  Json array = Json::array();
  for (auto& [level, entry] : levels) array.push_back(std::move(entry));
  return array;
}

Json Blocks(const RunReport& report) {
  std::map<uint32_t, std::string> addresses;
  for (const v1::BlockPlacement& placement : report.map.blocks()) {
    addresses[placement.block()] = placement.address();
  }
  Json array = Json::array();
  for (const auto& [block, totals] : TotalsByBlock(report)) {
    array.push_back({{"block", block},
                     {"server", addresses[block]},
                     {"hexahedra", totals.hexahedra},
                     {"darts", totals.darts},
                     {"critical_darts", totals.critical_darts},
                     {"accounted_bytes", totals.accounted_bytes},
                     {"messages", totals.messages},
                     {"message_bytes", totals.message_bytes},
                     {"busy_seconds", totals.busy_seconds}});
  }
  return array;
}

// Wall and CPU seconds by phase, the latter of the services also as user and system seconds; refinement's
// levels are one phase here.
void AddSeconds(const RunReport& report, Json& json) {
  Json seconds = Json::object(), cpu = Json::object();
  Json user = Json::object(), system = Json::object();
  const auto add = [](Json& object, const std::string& name, double value) {
    object[name] = object.value(name, 0.0) + value;
  };
  for (const RunReport::Step& step : report.steps) {
    add(seconds, step.name, step.seconds);
    add(cpu, step.name, step.cpu_seconds);
  }
  for (const v1::PhaseResult& phase : report.phases) {
    add(seconds, phase.phase().algorithm(), phase.wall_seconds());
    add(cpu, phase.phase().algorithm(), phase.user_seconds() + phase.system_seconds());
    add(user, phase.phase().algorithm(), phase.user_seconds());
    add(system, phase.phase().algorithm(), phase.system_seconds());
  }
  Json peak = Json::object();
  uint64_t most = 0, sum = 0;
  for (const auto& [name, stats] : report.processes_at_end) {
    add(user, "total", stats.user_seconds());
    add(system, "total", stats.system_seconds());
    peak[name] = stats.peak_rss_bytes();
    most = std::max(most, stats.peak_rss_bytes());
    sum += stats.peak_rss_bytes();
  }
  seconds["total"] = report.total_seconds;
  cpu["total"] = user.value("total", 0.0) + system.value("total", 0.0);
  peak["max"] = most;
  peak["sum"] = sum;
  json["seconds"] = std::move(seconds);
  json["cpu_seconds"] = std::move(cpu);
  json["user_seconds"] = std::move(user);
  json["system_seconds"] = std::move(system);
  json["peak_rss_bytes"] = std::move(peak);
}

int64_t Count(const v1::PhaseResult* phase, const char* name) {
  return phase == nullptr ? 0 : CountOf(phase->report(), name);
}

}  // namespace

const v1::PhaseResult* RunReport::Find(const std::string& algorithm) const {
  for (const v1::PhaseResult& phase : phases) {
    if (phase.phase().algorithm() == algorithm) return &phase;
  }
  return nullptr;
}

std::optional<bool> RunReport::valid() const {
  const v1::PhaseResult* check = Find("check");
  if (check == nullptr) return std::nullopt;
  return Count(check, "findings") == 0;
}

bool RunReport::stopped_by_memory() const {
  return std::any_of(phases.begin(), phases.end(), [](const v1::PhaseResult& phase) {
    return CountOf(phase.report(), "stopped_by_memory") > 0;
  });
}

int64_t RunReport::removed() const {
  int64_t removed = 0;
  for (const v1::PhaseResult& phase : phases) {
    if (phase.phase().algorithm() == "trim") removed += CountOf(phase.report(), "removed");
  }
  return removed;
}

int64_t RunReport::made() const {
  int64_t left = 0;
  for (const v1::PhaseResult& phase : phases) {
    if (phase.phase().algorithm() == "trim") left = CountOf(phase.report(), "hexahedra");
  }
  return removed() + left;
}

int64_t RunReport::InState(const std::string& state) const {
  int64_t erased = 0, left = 0;
  for (const v1::PhaseResult& phase : phases) {
    if (phase.phase().algorithm() == "classify") left = CountOf(phase.report(), state);
    if (phase.phase().algorithm() != "trim") continue;
    const auto keep = phase.phase().parameters().find("keep");
    if (keep == phase.phase().parameters().end() || keep->second == "all" ||
        absl::StrContains(keep->second, state)) {
      continue;
    }
    erased += left;
    left = 0;
  }
  return erased + left;
}

std::string HashText(const v1::Report& report) {
  return absl::StrFormat("%016x%016x", report.digest_hi(), report.digest_lo());
}

std::string RunReport::hash() const {
  const v1::PhaseResult* hash = Find("hash");
  return hash == nullptr ? "" : HashText(hash->report());
}

int RunReport::levels_reached() const {
  const v1::PhaseResult* count = Find("count");
  int highest = 0;
  for (int level = 0; level <= depth; ++level) {
    if (Count(count, absl::StrCat("level_", level).c_str()) > 0) highest = level;
  }
  return highest;
}

Json ToJson(const RunReport& report) {
  const v1::PhaseResult* count = report.Find("count");
  const v1::PhaseResult* check = report.Find("check");
  uint64_t messages = 0, message_bytes = 0;
  for (const v1::PhaseResult& phase : report.phases) {
    messages += phase.messages();
    message_bytes += phase.message_bytes();
  }
  Json json{{"surface", report.surface},
            {"triangles", report.triangles},
            {"grid", GridText(report.map.grid())},
            {"depth", report.depth},
            {"block_count", report.map.block_count()},
            {"processes", report.processes},
            {"routing", report.map.routing() == v1::ROUTING_BROADCAST ? "broadcast" : "direct"},
            {"partition", report.map.partition()},
            {"hash", report.hash()},
            {"valid", nullptr},
            {"findings", Json::array()},
            {"made", report.made()},
            {"hexahedra", Count(count, "hexahedra")},
            {"removed", report.removed()},
            {"cut", report.InState("cut")},
            {"inside", report.InState("inside")},
            {"outside", report.InState("outside")},
            {"darts", Count(count, "darts")},
            {"vertices", Count(count, "vertices")},
            {"critical_darts", Count(count, "critical_darts")},
            {"messages", messages},
            {"message_bytes", message_bytes},
            {"stopped_by_memory", report.stopped_by_memory()},
            {"levels_reached", report.levels_reached()}};
  if (report.valid().has_value()) json["valid"] = *report.valid();
  if (check != nullptr) {
    for (const std::string& finding : check->report().findings()) json["findings"].push_back(finding);
  }
  AddSeconds(report, json);
  json["levels"] = Levels(report);
  json["blocks"] = Blocks(report);
  json["output"] = report.output.empty() ? Json(nullptr) : Json(report.output);
  json["output_bytes"] = report.output_bytes;
  return json;
}

std::string ToText(const RunReport& report) {
  Table table({"block", "hexahedra", "darts", "critical", "memory", "messages", "sent", "busy"});
  BlockTotals all;
  const auto row = [&](const std::string& name, const BlockTotals& t) {
    table.Add({name, FormatCount(t.hexahedra), FormatCount(t.darts), FormatCount(t.critical_darts),
               FormatBytes(static_cast<uint64_t>(t.accounted_bytes)),
               FormatCount(static_cast<int64_t>(t.messages)), FormatBytes(t.message_bytes),
               FormatSeconds(t.busy_seconds)});
  };
  for (const auto& [block, totals] : TotalsByBlock(report)) {
    row(absl::StrCat(block), totals);
    all.hexahedra += totals.hexahedra;
    all.darts += totals.darts;
    all.critical_darts += totals.critical_darts;
    all.accounted_bytes += totals.accounted_bytes;
    all.messages += totals.messages;
    all.message_bytes += totals.message_bytes;
    all.busy_seconds += totals.busy_seconds;
  }
  row("all", all);
  const Json json = ToJson(report);
  const auto count = [&](const char* name) { return FormatCount(json[name].get<int64_t>()); };
  std::string text = table.Text(true);
  absl::StrAppend(&text, "\n", count("made"), " hexahedra made on ", GridText(report.map.grid()),
                  " to depth ", report.depth, ": ", count("cut"), " cut, ", count("inside"), " inside, ",
                  count("removed"), " removed\n", count("hexahedra"), " hexahedra, ", count("darts"),
                  " darts, ", count("vertices"), " vertices\n", "hash ", report.hash(), "\n");
  if (report.valid().has_value()) {
    absl::StrAppend(&text, *report.valid() ? "valid: every property of the distributed map holds\n"
                                           : "NOT VALID: see the findings above\n");
  }
  if (report.stopped_by_memory()) {
    absl::StrAppend(&text, "stopped by the memory limit: levels 0 ... ", report.levels_reached(),
                    " of 0 ... ", report.depth,
                    " were reached, and not everywhere; the map is valid as far as it goes\n");
  }
  absl::StrAppend(&text, FormatSeconds(report.total_seconds), " in all, ",
                  FormatSeconds(json["cpu_seconds"]["total"].get<double>()), " of CPU, peak memory ",
                  FormatBytes(json["peak_rss_bytes"]["sum"].get<uint64_t>()), " in ",
                  report.processes_at_end.size(), " processes\n");
  if (!report.output.empty()) absl::StrAppend(&text, "open ", report.output, " in ParaView\n");
  return text;
}

}  // namespace ndmap::cli

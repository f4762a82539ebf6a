// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/map_report.h"

#include <map>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "absl/time/clock.h"
#include "client/cli/job_display.h"
#include "client/cli/report.h"
#include "client/cli/table.h"
#include "client/cli/text.h"
#include "core/map/ids.h"

namespace ndmap::cli {
namespace {

// The grid that the map was made from, or the mesh.
std::string MadeFrom(const v1::Map& map) {
  if (!map.has_mesh()) return GridText(map.grid());
  return map.mesh().name().empty() ? "a mesh" : map.mesh().name();
}

Json MeshAsJson(const v1::MeshSummary& mesh) {
  return {{"name", mesh.name()},         {"hexahedra", mesh.hexahedra()},   {"prisms", mesh.prisms()},
          {"pyramids", mesh.pyramids()}, {"tetrahedra", mesh.tetrahedra()}, {"points", mesh.points()}};
}

// 3-cells of all kinds.
int64_t CellsIn(const v1::Report& count) {
  int64_t cells = 0;
  for (const char* kind : {"hexahedra", "prisms", "pyramids", "tetrahedra"}) cells += CountOf(count, kind);
  return cells;
}

// By name, in a fixed order whatever protobuf's map does.
Json Counts(const v1::Report& report) {
  const std::map<std::string, int64_t> sorted(report.counts().begin(), report.counts().end());
  Json json = Json::object();
  for (const auto& [name, value] : sorted) json[name] = value;
  return json;
}

double Seconds(const v1::Job& job) {
  return (job.ended() > 0 ? job.ended() : absl::ToDoubleSeconds(absl::Now() - absl::UnixEpoch())) -
         job.started();
}

}  // namespace

std::string GridText(const v1::Grid& grid) {
  return grid.cells_size() != 3 ? "" : absl::StrCat(grid.cells(0), "x", grid.cells(1), "x", grid.cells(2));
}

std::string StateName(v1::JobState state) {
  return absl::AsciiStrToLower(absl::StripPrefix(v1::JobState_Name(state), "JOB_STATE_"));
}
std::string StateName(v1::MapState state) {
  return absl::AsciiStrToLower(absl::StripPrefix(v1::MapState_Name(state), "MAP_STATE_"));
}

Json JobAsJson(const v1::Job& job) {
  Json json{{"job", job.job()},       {"map", job.map()},
            {"kind", job.kind()},     {"state", StateName(job.state())},
            {"error", job.error()},   {"seconds", Seconds(job)},
            {"phases", Json::array()}};
  for (int i = 0; i < job.results_size(); ++i) {
    const v1::PhaseResult& result = job.results(i);
    json["phases"].push_back({{"phase", PhaseName(result.phase())},
                              {"counts", Counts(result.report())},
                              {"seconds", result.wall_seconds()},
                              {"cpu_seconds", result.user_seconds() + result.system_seconds()},
                              {"messages", result.messages()},
                              {"message_bytes", result.message_bytes()},
                              {"cancelled", result.cancelled()}});
  }
  return json;
}

namespace {

// What a job on listed hexahedra did not find; empty: nothing.
std::string MissingListed(const v1::Job& job) {
  int64_t listed = 0, found = 0;
  for (const v1::PhaseResult& result : job.results()) {
    // What a phase that was stopped did not come to may be there all the same.
    if (result.cancelled() || CountOf(result.report(), "stopped_by_memory") > 0) continue;
    listed += CountOf(result.report(), "listed");
    found += CountOf(result.report(), "listed_found");
  }
  if (listed == found) return "";
  return absl::StrCat(FormatCount(listed - found), " of ", FormatCount(listed),
                      " listed hexahedra were not found: they were split, removed, or never there");
}

}  // namespace

std::string JobAsText(const v1::Job& job) {
  std::string text =
      absl::StrCat("job ", job.job(), " (", job.kind(), " of ", job.map(), "): ", StateName(job.state()),
                   " after ", FormatSeconds(Seconds(job)), "\n");
  for (const v1::PhaseResult& result : job.results()) {
    if (CountOf(result.report(), "stopped_by_memory") == 0) continue;
    absl::StrAppend(&text, "the memory limit stopped ", PhaseName(result.phase()), " in ",
                    CountOf(result.report(), "stopped_by_memory"),
                    " blocks; the map is valid as far as it goes\n");
  }
  if (const std::string missing = MissingListed(job); !missing.empty()) absl::StrAppend(&text, missing, "\n");
  return text;
}

int PrintCheck(Context& context, const std::string& map, const v1::Report& report) {
  const int64_t findings = CountOf(report, "findings");
  Json json{{"map", map},
            {"valid", findings == 0},
            {"faults", findings},
            {"findings", Json::array()},
            {"darts", CountOf(report, "darts")},
            {"critical_darts", CountOf(report, "critical_darts")}};
  std::string text = findings == 0
                         ? absl::StrCat(map, " is valid: ", FormatCount(CountOf(report, "darts")), " darts, ",
                                        FormatCount(CountOf(report, "critical_darts")), " of them critical\n")
                         : absl::StrCat(map, " is NOT VALID: ", FormatCount(findings), " faults\n");
  for (const std::string& finding : report.findings()) {
    json["findings"].push_back(finding);
    absl::StrAppend(&text, finding, "\n");
  }
  context.Print(json, text);
  return findings == 0 ? 0 : 1;
}

void PrintHash(Context& context, const std::string& map, const v1::Report& report) {
  context.Print({{"map", map}, {"hash", HashText(report)}, {"darts", CountOf(report, "darts")}},
                absl::StrCat(HashText(report), "\n"));
}

void PrintStats(Context& context, const v1::Map& map, const std::vector<v1::BlockStats>& blocks,
                const v1::Report& count) {
  std::map<uint32_t, std::string> addresses;
  for (const v1::BlockPlacement& placement : map.blocks()) addresses[placement.block()] = placement.address();
  Json json{{"map", map.map()},
            {"state", StateName(map.state())},
            {"grid", GridText(map.grid())},
            {"counts", Counts(count)},
            {"blocks", Json::array()}};
  if (map.has_mesh()) json["mesh"] = MeshAsJson(map.mesh());
  const bool hexahedra = !map.has_mesh();
  Table table(
      {"block", "<server", hexahedra ? "hexahedra" : "cells", "darts", "critical", "vertices", "memory"});
  uint64_t bytes = 0;
  for (const v1::BlockStats& block : blocks) {
    json["blocks"].push_back({{"block", block.block()},
                              {"server", addresses[block.block()]},
                              {"hexahedra", block.hexahedra()},
                              {"darts", block.darts()},
                              {"critical_darts", block.critical_darts()},
                              {"vertices", block.vertices()},
                              {"accounted_bytes", block.accounted_bytes()},
                              {"version", block.version()}});
    table.Add({absl::StrCat(block.block()), addresses[block.block()],
               FormatCount(static_cast<int64_t>(block.hexahedra())),
               FormatCount(static_cast<int64_t>(block.darts())),
               FormatCount(static_cast<int64_t>(block.critical_darts())),
               FormatCount(static_cast<int64_t>(block.vertices())), FormatBytes(block.accounted_bytes())});
    bytes += block.accounted_bytes();
  }
  const auto number = [&](const char* name) { return FormatCount(CountOf(count, name)); };
  table.Add({"all", "", FormatCount(CellsIn(count)), number("darts"), number("critical_darts"),
             number("vertices"), FormatBytes(bytes)});
  std::string text = absl::StrCat(table.Text(true), "\n");
  for (int level = 0; level <= CellId::kMaxLevel; ++level) {
    const int64_t cells = CountOf(count, absl::StrCat("level_", level));
    if (cells > 0) absl::StrAppend(&text, "level ", level, ": ", FormatCount(cells), " hexahedra\n");
  }
  for (const char* kind : {"prisms", "pyramids", "tetrahedra"}) {
    if (CountOf(count, kind) > 0) absl::StrAppend(&text, number(kind), " ", kind, "\n");
  }
  absl::StrAppend(&text, number("cut"), " cut, ", number("inside"), " inside, ", number("outside"),
                  " outside, ", number("unclassified"), " unclassified\n");
  context.Print(json, text);
}

namespace {

// A map that is whole as far as the coordinator remembers may have lost blocks with their server.
std::string StateOf(const v1::Map& map) {
  return map.state() == v1::MAP_STATE_READY && !map.error().empty() ? "lost" : StateName(map.state());
}

}  // namespace

void PrintMaps(Context& context, const std::vector<v1::Map>& maps) {
  Json json{{"maps", Json::array()}};
  Table table({"<map", "<state", "blocks", "grid", "<routing", "<partition", "jobs"});
  for (const v1::Map& map : maps) {
    const std::string routing = map.routing() == v1::ROUTING_BROADCAST ? "broadcast" : "direct";
    json["maps"].push_back({{"map", map.map()},
                            {"state", StateOf(map)},
                            {"error", map.error()},
                            {"blocks", map.block_count()},
                            {"grid", GridText(map.grid())},
                            {"mesh", map.has_mesh() ? MeshAsJson(map.mesh()) : Json()},
                            {"routing", routing},
                            {"partition", map.partition()},
                            {"surface_id", map.surface_id()},
                            {"running_jobs", Json(std::vector<uint64_t>(map.running_jobs().begin(),
                                                                        map.running_jobs().end()))}});
    table.Add({map.map(), StateOf(map), absl::StrCat(map.block_count()), MadeFrom(map), routing,
               map.partition(), absl::StrCat(map.running_jobs_size())});
  }
  context.Print(json, table.Text());
}

void PrintJobs(Context& context, const std::vector<v1::Job>& jobs) {
  Json json{{"jobs", Json::array()}};
  Table table({"job", "<map", "<kind", "<state", "phases", "time", "<error"});
  for (const v1::Job& job : jobs) {
    json["jobs"].push_back({{"job", job.job()},
                            {"map", job.map()},
                            {"kind", job.kind()},
                            {"state", StateName(job.state())},
                            {"error", job.error()},
                            {"phases", job.phases_size()},
                            {"seconds", Seconds(job)}});
    table.Add({absl::StrCat(job.job()), job.map(), job.kind(), StateName(job.state()),
               absl::StrCat(job.phases_size()), FormatSeconds(Seconds(job)), job.error()});
  }
  context.Print(json, table.Text());
}

}  // namespace ndmap::cli

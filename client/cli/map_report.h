// SPDX-License-Identifier: GPL-3.0-or-later
// Answers about maps and jobs, as JSON and as text.
#pragma once

#include <string>
#include <vector>

#include "client/cli/context.h"
#include "ndmap/v1/block_service.pb.h"
#include "ndmap/v1/coordinator.pb.h"

namespace ndmap::cli {

Json JobAsJson(const v1::Job& job);
std::string JobAsText(const v1::Job& job);
// "running", "done", ...
std::string StateName(v1::JobState state);
std::string StateName(v1::MapState state);
// "11x11x11"; empty for a map that was not made on a grid.
std::string GridText(const v1::Grid& grid);

// Exit code 1 if there are findings.
int PrintCheck(Context& context, const std::string& map, const v1::Report& report);
void PrintHash(Context& context, const std::string& map, const v1::Report& report);
void PrintStats(Context& context, const v1::Map& map, const std::vector<v1::BlockStats>& blocks,
                const v1::Report& count);
void PrintMaps(Context& context, const std::vector<v1::Map>& maps);
void PrintJobs(Context& context, const std::vector<v1::Job>& jobs);

}  // namespace ndmap::cli

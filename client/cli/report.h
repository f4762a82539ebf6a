// SPDX-License-Identifier: GPL-3.0-or-later
// What a run did: gathered from the jobs' results and told as JSON and as a table.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/cli/context.h"
#include "ndmap/v1/block_service.pb.h"
#include "ndmap/v1/coordinator.pb.h"

namespace ndmap::cli {

struct RunReport {
  std::string surface;
  uint64_t triangles = 0;
  v1::Map map;
  int depth = 0;
  uint32_t processes = 0;
  // Results of all phases, in order.
  std::vector<v1::PhaseResult> phases;
  // Steps on this side of the wire, in order, with wall seconds and, where known, CPU seconds.
  struct Step {
    std::string name;
    double seconds = 0;
    double cpu_seconds = 0;
  };
  std::vector<Step> steps;
  double total_seconds = 0;
  // All processes at the end: this one, coordinator, servers.
  std::vector<std::pair<std::string, v1::ProcessStats>> processes_at_end;
  std::string output;  // The index that was written, or empty.
  uint64_t output_bytes = 0;

  const v1::PhaseResult* Find(const std::string& algorithm) const;
  // Of the checker; nothing if it did not run.
  std::optional<bool> valid() const;
  bool stopped_by_memory() const;
  // Hexahedra that were erased, and all that ever were.
  int64_t removed() const;
  int64_t made() const;
  // Of all that ever were, those that are "cut", "inside" or "outside": when they were erased, or at the end.
  int64_t InState(const std::string& state) const;
  // 32 digits.
  std::string hash() const;
  // The highest level of which there are hexahedra.
  int levels_reached() const;
};

std::string HashText(const v1::Report& report);
Json ToJson(const RunReport& report);
std::string ToText(const RunReport& report);

}  // namespace ndmap::cli

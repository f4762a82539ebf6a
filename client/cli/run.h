// SPDX-License-Identifier: GPL-3.0-or-later
// `ndmap run`: a surface in, a distributed hexahedral mesh out, on a cluster of this machine.
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/statusor.h"
#include "client/cli/context.h"
#include "client/cli/grid_options.h"

namespace ndmap::cli {

struct RunOptions {
  std::string surface;
  GridOptions grid;
  DepthOptions depth;
  uint32_t processes = 0;     // 0: as many as cores, at most one a block
  uint32_t threads = 0;       // Of each block server; 0: what the cores give each
  uint64_t memory_limit = 0;  // Bytes a block; 0: none
  bool async = false;
  uint32_t parts = 0;  // Of the last level; 0: by size
  bool check = true;
  std::string keep = "inside,cut";
  std::string cells = "hexahedron";
  std::string output;
  std::string png;
  bool dry_run = false;
  bool show_logs = false;
};

// How many block servers, and how many worker threads each, on this machine.
struct Processes {
  uint32_t servers = 1;
  uint32_t threads = 1;
};
// INVALID_ARGUMENT if there are more processes than blocks.
absl::StatusOr<Processes> ProcessesFor(const RunOptions& options);

// Exit code 1 if the checker found faults.
absl::StatusOr<int> Run(Context& context, const RunOptions& options);

// Predicts; starts nothing, writes nothing.
absl::StatusOr<int> DryRun(Context& context, const RunOptions& options);

}  // namespace ndmap::cli

// SPDX-License-Identifier: GPL-3.0-or-later
// Options that several subcommands share: the initial grid, the cut into blocks, the depth, what is kept.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "client/sdk/client.h"
#include "core/geometry/grid_shape.h"
#include "core/geometry/surface.h"
#include "core/io/surface_reader.h"
#include "core/map/ids.h"

namespace ndmap::cli {

inline constexpr int kMaxDepth = CellId::kMaxLevel;

// A whole number within limits; the error names them, and `reason` if one is given.
CLI::Validator WholeNumber(int64_t lowest, int64_t highest, const std::string& reason = "");
// A finite number above 0, or also 0.
CLI::Validator PositiveNumber(bool zero_too = false);
// One of these words.
CLI::Validator OneOf(const std::vector<std::string>& words);
// Whatever a parser of text.h takes.
CLI::Validator ByteSize();

struct GridOptions {
  std::string grid;    // "AxBxC", or empty
  uint32_t cubes = 0;  // 0: not given
  double padding = kDefaultGridPadding;
  uint32_t blocks = 4;
  std::string routing = "direct";
  std::string partition = "hilbert";
};
void AddGridOptions(CLI::App* command, GridOptions* options);

// The grid over a surface. INVALID_ARGUMENT in one sentence, also when there are more blocks than cells,
// or more cells than the partition can cut.
absl::StatusOr<GridShape> MakeGrid(const GridOptions& options, const TriangleSurface& surface);

// OK if the map's grid or mesh allows hexahedra of this level, or is not known.
absl::Status CheckDepthOfMap(const v1::Map& map, int depth);

// The message that makes the map.
v1::CreateMapRequest CreateRequest(const std::string& map, const std::string& surface_id,
                                   const GridShape& grid, const GridOptions& options, int depth);

struct DepthOptions {
  int depth = 4;
  double size = 0;  // 0: not given
};
void AddDepthOptions(CLI::App* command, DepthOptions* options);
// INVALID_ARGUMENT if the size asks for more than kMaxDepth levels, OUT_OF_RANGE if the grid allows less than
// asked for.
absl::StatusOr<int> DepthOf(const DepthOptions& options, const GridShape& grid);

// "inside", "cut", "inside,cut" or "all" for the algorithm trim.
void AddKeepOption(CLI::App* command, std::string* keep);
void AddCellsOption(CLI::App* command, std::string* cells);

// Reads a surface and says on standard error what was mended and what is odd.
class Progress;
absl::StatusOr<SurfaceFile> ReadSurfaceAndTell(const std::string& path, Progress& progress);
// Components that a coarse hexahedron may swallow.
void WarnAboutSmallComponents(const TriangleSurface& surface, const GridShape& grid, Progress& progress);
SurfaceView ViewOf(const TriangleSurface& surface, const std::string& path);

// One phase a level, or one for all with `async`; every phase gets `parameters`.
std::vector<v1::Phase> RefinePhases(int depth, bool async,
                                    const std::vector<std::pair<std::string, std::string>>& parameters);
v1::Phase MakePhase(const std::string& algorithm,
                    const std::vector<std::pair<std::string, std::string>>& parameters = {});

}  // namespace ndmap::cli

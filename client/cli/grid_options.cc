// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/grid_options.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "client/cli/estimate.h"
#include "client/cli/progress.h"
#include "client/cli/text.h"
#include "core/algorithm/build/assignment.h"
#include "core/io/mesh_numbers.h"

namespace ndmap::cli {

CLI::Validator WholeNumber(int64_t lowest, int64_t highest, const std::string& reason) {
  return CLI::Validator(
      [=](std::string& text) -> std::string {
        int64_t number = 0;
        if (absl::SimpleAtoi(text, &number) && number >= lowest && number <= highest) return "";
        return absl::StrCat("'", text, "' is not a whole number from ", lowest, " to ", highest,
                            reason.empty() ? "" : absl::StrCat(" (", reason, ")"));
      },
      "");
}

CLI::Validator PositiveNumber(bool zero_too) {
  return CLI::Validator(
      [=](std::string& text) -> std::string {
        double number = 0;
        if (absl::SimpleAtod(text, &number) && std::isfinite(number) &&
            (zero_too ? number >= 0 : number > 0)) {
          return "";
        }
        return absl::StrCat("'", text, "' is not a number ", zero_too ? "from 0" : "above 0");
      },
      "");
}

CLI::Validator OneOf(const std::vector<std::string>& words) {
  const auto find = [words](std::string& text) -> std::string {
    if (std::find(words.begin(), words.end(), text) != words.end()) return "";
    return absl::StrCat("'", text, "' is none of ", absl::StrJoin(words, ", "));
  };
  return CLI::Validator(find, "");
}

CLI::Validator ByteSize() {
  return CLI::Validator(
      [](std::string& text) -> std::string {
        absl::StatusOr<uint64_t> bytes = ParseBytes(text);
        if (!bytes.ok()) return std::string(bytes.status().message());
        text = absl::StrCat(*bytes);
        return "";
      },
      "");
}

void AddGridOptions(CLI::App* command, GridOptions* options) {
  CLI::Option* grid = command->add_option("--grid", options->grid, "initial hexahedra, AxBxC")
                          ->check(CLI::Validator(
                              [](std::string& text) -> std::string {
                                return std::string(ParseGridCells(text).status().message());
                              },
                              ""));
  command->add_option("--cubes", options->cubes, "initial cubes, this many along the longest side")
      ->check(WholeNumber(1, 1 << 20))
      ->excludes(grid);
  command->add_option("--padding", options->padding, "how much the bounding box is enlarged about its centre")
      ->check(PositiveNumber(true))
      ->capture_default_str();
  command->add_option("--blocks", options->blocks, "blocks that the map is cut into")
      ->check(WholeNumber(1, 1 << 20))
      ->capture_default_str();
  command->add_option("--routing", options->routing, "how messages find a block: direct or broadcast")
      ->check(OneOf({"direct", "broadcast"}))
      ->capture_default_str();
  command
      ->add_option("--partition", options->partition,
                   "how hexahedra are assigned to blocks: hilbert, morton, slabs, metis, lpt")
      ->check(OneOf({"hilbert", "morton", "slabs", "metis", "lpt"}))
      ->capture_default_str();
}

absl::StatusOr<GridShape> MakeGrid(const GridOptions& options, const TriangleSurface& surface) {
  const Box3 box = BoundingBox(surface);
  absl::StatusOr<GridShape> grid;
  if (options.cubes > 0) {
    grid = GridFromCubes(box, options.cubes);
  } else if (!options.grid.empty()) {
    absl::StatusOr<std::array<uint32_t, 3>> cells = ParseGridCells(options.grid);
    if (!cells.ok()) return cells.status();
    grid = GridFromCounts(box, *cells, options.padding);
  } else {
    grid = GridAuto(box);
    if (grid.ok()) grid = GridFromCounts(box, grid->cells, options.padding);
  }
  if (grid.ok() && options.blocks > grid->CellCount()) {
    return absl::InvalidArgumentError(absl::StrCat("--blocks ", options.blocks, ": the grid has only ",
                                                   grid->CellCount(),
                                                   " hexahedra, a block needs at least one"));
  }
  if (grid.ok()) {
    if (absl::Status s = CheckPartition(options.partition, grid->CellCount()); !s.ok()) return s;
  }
  return grid;
}

absl::Status CheckDepthOfMap(const v1::Map& map, int depth) {
  if (map.has_mesh()) {
    const v1::MeshSummary& mesh = map.mesh();
    const int finest =
        MeshNumbers(mesh.tetrahedra() + mesh.pyramids() + mesh.prisms() + mesh.hexahedra()).finest_level();
    if (depth <= finest) return absl::OkStatus();
    return absl::OutOfRangeError(
        absl::StrCat("depth ", depth, " is too deep: in this mesh numbers in files reach level ", finest));
  }
  const v1::Grid& wire = map.grid();
  if (wire.cells_size() != 3 || wire.lo_size() != 3 || wire.hi_size() != 3) return absl::OkStatus();
  GridShape grid;
  for (int axis = 0; axis < 3; ++axis) {
    grid.cells[axis] = wire.cells(axis);
    grid.lo[axis] = wire.lo(axis);
    grid.hi[axis] = wire.hi(axis);
  }
  return CheckDepth(grid, depth);
}

v1::CreateMapRequest CreateRequest(const std::string& map, const std::string& surface_id,
                                   const GridShape& grid, const GridOptions& options, int depth) {
  v1::CreateMapRequest request;
  request.set_map(map);
  request.set_surface_id(surface_id);
  for (int axis = 0; axis < 3; ++axis) {
    request.mutable_grid()->add_cells(grid.cells[axis]);
    request.mutable_grid()->add_lo(grid.lo[axis]);
    request.mutable_grid()->add_hi(grid.hi[axis]);
  }
  request.set_block_count(options.blocks);
  request.set_routing(options.routing == "broadcast" ? v1::ROUTING_BROADCAST : v1::ROUTING_DIRECT);
  request.set_partition(options.partition);
  request.set_depth(static_cast<uint32_t>(depth));
  return request;
}

void AddDepthOptions(CLI::App* command, DepthOptions* options) {
  CLI::Option* depth = command->add_option("--depth", options->depth, "hexahedra of levels 0 ... DEPTH")
                           ->check(WholeNumber(0, kMaxDepth, "ids of cells hold 29 levels"))
                           ->capture_default_str();
  command->add_option("--size", options->size, "refine until no edge at the surface is longer than this")
      ->check(PositiveNumber())
      ->excludes(depth);
}

absl::StatusOr<int> DepthOf(const DepthOptions& options, const GridShape& grid) {
  const int depth = options.size == 0 ? options.depth : DepthForSize(grid, options.size);
  if (depth > kMaxDepth) {
    return absl::InvalidArgumentError(absl::StrCat("--size ", options.size, ": needs more than the ",
                                                   kMaxDepth, " levels that labels and ids hold"));
  }
  if (absl::Status status = CheckDepth(grid, depth); !status.ok()) return status;
  return depth;
}

void AddKeepOption(CLI::App* command, std::string* keep) {
  command->add_option("--keep", *keep, "hexahedra that stay: inside, cut, both (inside,cut) or all")
      ->check(OneOf({"inside", "cut", "inside,cut", "all"}))
      ->capture_default_str();
}

void AddCellsOption(CLI::App* command, std::string* cells) {
  command->add_option("--cells", *cells, "VTK cells: hexahedron, or polyhedron with every shared point")
      ->check(OneOf({"hexahedron", "polyhedron"}))
      ->capture_default_str();
}

absl::StatusOr<SurfaceFile> ReadSurfaceAndTell(const std::string& path, Progress& progress) {
  progress.Begin("read");
  absl::StatusOr<SurfaceFile> file = ReadSurface(path);
  if (!file.ok()) {
    progress.Abandon();
    return file;
  }
  progress.End(absl::StrCat(FormatCount(static_cast<int64_t>(file->surface.triangles.size())), " triangles, ",
                            FormatCount(static_cast<int64_t>(file->surface.points.size())), " points"));
  for (const std::string& note : file->notes) progress.Note(absl::StrCat("note: ", note));
  for (const std::string& warning : file->warnings) progress.Note(absl::StrCat("warning: ", warning));
  return file;
}

void WarnAboutSmallComponents(const TriangleSurface& surface, const GridShape& grid, Progress& progress) {
  double smallest = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    smallest = std::min(smallest, (grid.hi[axis] - grid.lo[axis]) / grid.cells[axis]);
  }
  for (const std::string& warning : WarnSmallComponents(surface, smallest)) {
    progress.Note(absl::StrCat("warning: ", warning));
  }
}

SurfaceView ViewOf(const TriangleSurface& surface, const std::string& path) {
  SurfaceView view;
  view.name = path;
  view.name.remove_prefix(path.rfind('/') + 1);
  view.points = surface.points;
  view.triangles = surface.triangles;
  return view;
}

v1::Phase MakePhase(const std::string& algorithm,
                    const std::vector<std::pair<std::string, std::string>>& parameters) {
  v1::Phase phase;
  phase.set_algorithm(algorithm);
  for (const auto& [name, value] : parameters) (*phase.mutable_parameters())[name] = value;
  return phase;
}

std::vector<v1::Phase> RefinePhases(int depth, bool async,
                                    const std::vector<std::pair<std::string, std::string>>& parameters) {
  std::vector<v1::Phase> phases;
  for (int level = 0; level < (async ? 1 : depth); ++level) {
    v1::Phase phase = MakePhase("refine", parameters);
    (*phase.mutable_parameters())["depth"] = absl::StrCat(depth);
    if (!async) (*phase.mutable_parameters())["level"] = absl::StrCat(level);
    phases.push_back(std::move(phase));
  }
  return phases;
}

}  // namespace ndmap::cli

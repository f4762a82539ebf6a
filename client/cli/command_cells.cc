// SPDX-License-Identifier: GPL-3.0-or-later
// Commands that ask about cells and their neighbourhoods: cell, orbit, incident, neighbors, ring, locate,
// box, nearest.
#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "client/cli/cell_arguments.h"
#include "client/cli/cell_report.h"
#include "client/cli/context.h"
#include "client/cli/grid_options.h"
#include "client/cli/table.h"
#include "client/cli/text.h"
#include "client/sdk/explore.h"
#include "core/map/ids.h"

namespace ndmap::cli {
namespace {

struct CellOptions {
  std::string map, cell, output;
  bool ids = false;
  std::optional<uint32_t> through;
  uint32_t dimension = 0, steps = 1;
  std::vector<std::string> points;
};

using CellAnswer =
    std::function<absl::StatusOr<int>(Context&, const MapHandle&, const CellOptions&, bool csv)>;

// A command about a map; the caller enters further options.
CLI::App* AddMapQuestion(CLI::App& app, Action& action, const char* name, const char* what,
                         const char* example, const std::shared_ptr<CellOptions>& options,
                         CellAnswer answer) {
  CLI::App* command = AddCommand(app, name, what, example);
  command->add_option("MAP", options->map, "name of the map")->required();
  AddOutputOption(command, &options->output);
  command->callback([&action, options, answer = std::move(answer)] {
    action = [options, answer](Context& context) -> absl::StatusOr<int> {
      absl::StatusOr<bool> csv = WantsCsv(context, options->output);
      if (!csv.ok()) return csv.status();
      absl::StatusOr<MapHandle> map = context.OpenMap(options->map);
      if (!map.ok()) return map.status();
      return answer(context, *map, *options, *csv);
    };
  });
  return command;
}

void AddCellArgument(CLI::App* command, const std::shared_ptr<CellOptions>& options) {
  command->add_option("CELL", options->cell, "id of a cell: h12/0.3.7, f12:2, e12/0:11, v12:5")
      ->required()
      ->check(CellText());
}

void AddIdsFlag(CLI::App* command, const std::shared_ptr<CellOptions>& options) {
  command->add_flag("--ids", options->ids, "only the ids: for many cells");
}

void AddThroughOption(CLI::App* command, const std::shared_ptr<CellOptions>& options) {
  command
      ->add_option("--through", options->through,
                   "neighbours share a cell of this dimension (default: one below, for vertices edges)")
      ->check(DimensionText());
}

uint32_t ThroughOf(const CellOptions& options, uint32_t dimension) {
  return options.through.value_or(dimension == 0 ? 1 : dimension - 1);
}

// What is wrong with arguments that are right one by one; empty if nothing is. A wrong command line like any
// other.
using Check = std::string (*)(const CellOptions&);
void AddCheck(CLI::App* command, const std::shared_ptr<CellOptions>& options, Check check) {
  command->parse_complete_callback([options, check] {
    if (const std::string wrong = check(*options); !wrong.empty()) throw CLI::ValidationError(wrong);
  });
}

std::string CheckThrough(const CellOptions& options) {
  absl::StatusOr<unsigned> dimension = DimensionOf(options.cell);
  if (!dimension.ok() || ThroughOf(options, *dimension) != *dimension) return "";
  return absl::StrCat("--through ", *dimension, ": ", options.cell, " is of dimension ", *dimension,
                      " itself, expected another one");
}

void PrintIds(const Context& context, bool csv, uint32_t dimension, const v1::ExploreResponse& answer,
              Json head) {
  Json ids = Json::array();
  std::string text = csv ? "cell\n" : "";
  for (int i = 0; i < std::min(answer.cell_hi_size(), answer.cell_lo_size()); ++i) {
    std::string id = CellId::FromWords(answer.cell_hi(i), answer.cell_lo(i)).ToString();
    absl::StrAppend(&text, id, "\n");
    ids.push_back(std::move(id));
  }
  if (!csv) {
    absl::StrAppend(&text, FormatCount(answer.cell_hi_size()), " ",
                    CellWord(dimension, answer.cell_hi_size() != 1), "\n");
  }
  head["count"] = ids.size();
  head["ids"] = std::move(ids);
  context.Print(head, text);
}

// Asks for cells and prints them: `head` begins the JSON object.
absl::StatusOr<int> PrintCells(const Context& context, const MapHandle& map, const CellOptions& options,
                               bool csv, v1::ExploreRequest request, Json head) {
  if (!options.ids) request.set_give(v1::GIVE_CELL_DETAILS);
  absl::StatusOr<v1::ExploreResponse> answer = map.Explore(request);
  if (!answer.ok()) return answer.status();
  if (options.ids) {
    PrintIds(context, csv, request.dimension(), *answer, std::move(head));
    return 0;
  }
  Json cells = Json::array();
  CellRows rows(csv, request.dimension());
  for (const v1::CellDetails& cell : answer->cells()) {
    cells.push_back(CellAsJson(cell));
    rows.Add(cell);
  }
  head["count"] = cells.size();
  head["cells"] = std::move(cells);
  context.Print(head, rows.Text());
  return 0;
}

absl::StatusOr<int> Cell(Context& context, const MapHandle& map, const CellOptions& options, bool csv) {
  absl::StatusOr<unsigned> dimension = DimensionOf(options.cell);
  if (!dimension.ok()) return dimension.status();
  v1::ExploreRequest request = CellsAt(CellAnchor(options.cell), *dimension);
  request.set_give(v1::GIVE_CELL_DETAILS);
  absl::StatusOr<v1::ExploreResponse> answer = map.Explore(request);
  if (!answer.ok()) return answer.status();
  if (answer->cells_size() != 1) {
    return absl::InternalError(
        absl::StrCat("the service told of ", answer->cells_size(), " cells ", options.cell));
  }
  CellRows rows(true, *dimension);
  rows.Add(answer->cells(0));
  context.Print(CellAsJson(answer->cells(0)), csv ? rows.Text() : CellAsText(answer->cells(0)));
  return 0;
}

absl::StatusOr<int> OrbitOf(Context& context, const MapHandle& map, const CellOptions& options, bool csv) {
  absl::StatusOr<v1::Anchor> anchor = CellOrDartAnchor(map, options.cell);
  if (!anchor.ok()) return anchor.status();
  absl::StatusOr<v1::ExploreResponse> answer = map.Explore(Orbit(*anchor, options.dimension));
  if (!answer.ok()) return answer.status();
  std::map<uint32_t, std::vector<uint32_t>> by_block;
  std::vector<std::vector<std::string>> rows = {{"block", "dart"}};
  const int count = std::min(answer->darts_size(), answer->dart_blocks_size());
  for (int i = 0; i < count; ++i) {
    by_block[answer->dart_blocks(i)].push_back(answer->darts(i));
    if (csv) rows.push_back({absl::StrCat(answer->dart_blocks(i)), absl::StrCat(answer->darts(i))});
  }
  std::map<uint32_t, uint64_t> versions;
  for (int i = 0; i < std::min(answer->blocks_size(), answer->versions_size()); ++i)
    versions[answer->blocks(i)] = answer->versions(i);
  Json json{{"map", map.name()}, {"at", options.cell}, {"i", options.dimension}, {"count", count}};
  json["blocks"] = Json::array();
  Table table({"block", "version", "<darts"});
  for (const auto& [block, darts] : by_block) {
    json["blocks"].push_back({{"block", block}, {"version", versions[block]}, {"darts", darts}});
    table.Add({absl::StrCat(block), absl::StrCat(versions[block]), absl::StrJoin(darts, " ")});
  }
  context.Print(json,
                csv ? CsvText(rows)
                    : absl::StrCat(table.Text(), FormatCount(count), count == 1 ? " dart\n" : " darts\n"));
  return 0;
}

absl::StatusOr<int> Incident(Context& context, const MapHandle& map, const CellOptions& options, bool csv) {
  absl::StatusOr<unsigned> own = DimensionOf(options.cell);
  if (!own.ok()) return own.status();
  return PrintCells(context, map, options, csv,
                    IncidentCells(CellAnchor(options.cell), *own, options.dimension),
                    {{"map", map.name()}, {"cell", options.cell}, {"dimension", options.dimension}});
}

absl::StatusOr<int> RingOf(Context& context, const MapHandle& map, const CellOptions& options, bool csv) {
  absl::StatusOr<unsigned> dimension = DimensionOf(options.cell);
  if (!dimension.ok()) return dimension.status();
  const uint32_t through = ThroughOf(options, *dimension);
  return PrintCells(
      context, map, options, csv, Ring(CellAnchor(options.cell), *dimension, options.steps, through),
      {{"map", map.name()}, {"cell", options.cell}, {"steps", options.steps}, {"through", through}});
}

// One question a point, so that the answer tells which cell is whose. 1 if some point is in no hexahedron.
absl::StatusOr<int> Locate(Context& context, const MapHandle& map, const CellOptions& options, bool csv) {
  Json points = Json::array();
  CellRows rows(csv, 3, "point");
  int code = 0;
  for (const std::string& text : options.points) {
    absl::StatusOr<Point> point = ParsePoint(text);
    if (!point.ok()) return point.status();
    v1::ExploreRequest request = CellsAt(PointAnchor(*point), 3);
    request.set_give(v1::GIVE_CELL_DETAILS);
    absl::StatusOr<v1::ExploreResponse> answer = map.Explore(request);
    if (!answer.ok()) return answer.status();
    Json cells = Json::array();
    for (const v1::CellDetails& cell : answer->cells()) {
      cells.push_back(CellAsJson(cell));
      rows.Add(cell, text);
    }
    if (cells.empty()) {
      rows.AddNone(text);
      code = 1;
    }
    points.push_back({{"point", *point}, {"count", cells.size()}, {"cells", std::move(cells)}});
  }
  context.Print({{"map", map.name()}, {"points", std::move(points)}}, rows.Text());
  return code;
}

absl::StatusOr<int> CellsInBox(Context& context, const MapHandle& map, const CellOptions& options, bool csv) {
  absl::StatusOr<Point> lo = ParsePoint(options.points[0]), hi = ParsePoint(options.points[1]);
  if (!lo.ok()) return lo.status();
  if (!hi.ok()) return hi.status();
  return PrintCells(context, map, options, csv, CellsAt(BoxAnchor(*lo, *hi), 3),
                    {{"map", map.name()}, {"lo", *lo}, {"hi", *hi}});
}

absl::StatusOr<int> Nearest(Context& context, const MapHandle& map, const CellOptions& options, bool csv) {
  absl::StatusOr<Point> point = ParsePoint(options.points[0]);
  if (!point.ok()) return point.status();
  v1::ExploreRequest request = CellsAt(NearestVertexAnchor(*point), 0);
  request.set_give(v1::GIVE_CELL_DETAILS);
  absl::StatusOr<v1::ExploreResponse> answer = map.Explore(request);
  if (!answer.ok()) return answer.status();
  if (answer->cells_size() != 1 || answer->cells(0).points_size() != 1) {
    return absl::NotFoundError(absl::StrCat("map '", map.name(), "' has no vertices"));
  }
  const v1::CellDetails& vertex = answer->cells(0);
  const v1::Point& at = vertex.points(0);
  const double distance = std::hypot(at.x() - (*point)[0], at.y() - (*point)[1], at.z() - (*point)[2]);
  Json json = CellAsJson(vertex);
  json["distance"] = distance;
  CellRows rows(csv, 0, "distance");
  rows.Add(vertex, csv ? ExactNumber(distance) : absl::StrCat(distance));
  context.Print(json, rows.Text());
  return 0;
}

std::string CheckBox(const CellOptions& options) {
  if (options.points.size() != 2) return "";
  absl::StatusOr<Point> lo = ParsePoint(options.points[0]), hi = ParsePoint(options.points[1]);
  for (size_t i = 0; lo.ok() && hi.ok() && i < 3; ++i) {
    if ((*lo)[i] > (*hi)[i]) {
      return absl::StrCat("box ", options.points[0], " ", options.points[1],
                          ": the first corner must not be above the second");
    }
  }
  return "";
}

void AddPointArguments(CLI::App* command, const std::shared_ptr<CellOptions>& options, int least, int most,
                       const std::string& what) {
  command->add_option("POINT", options->points, what)->required()->expected(least, most)->check(PointText());
}

void AddCommandsAboutOneCell(CLI::App& app, Action& action) {
  auto cell = std::make_shared<CellOptions>();
  AddCellArgument(AddMapQuestion(app, action, "cell", "everything about one cell, by its id",
                                 "ndmap cell bunny h12/0.3", cell, Cell),
                  cell);

  auto orbit = std::make_shared<CellOptions>();
  CLI::App* command = AddMapQuestion(app, action, "orbit", "all darts of an i-cell, in all blocks",
                                     "ndmap orbit bunny 0:12 -i 0", orbit, OrbitOf);
  command->add_option("AT", orbit->cell, "a dart, BLOCK:INDEX or BLOCK:any, or the id of a cell")
      ->required()
      ->check(CellOrDartText());
  command
      ->add_option("-i,--cell-dimension", orbit->dimension,
                   "0: darts of the vertex, ... 3: of the hexahedron")
      ->required()
      ->check(DimensionText());

  auto incident = std::make_shared<CellOptions>();
  command = AddMapQuestion(app, action, "incident", "the cells of a dimension that a cell touches",
                           "ndmap incident bunny v12:7 --dim 3", incident, Incident);
  AddCellArgument(command, incident);
  AddIdsFlag(command, incident);
  command->add_option("--dim", incident->dimension, "dimension of the cells, 0 ... 3")
      ->required()
      ->check(DimensionText());

  auto neighbors = std::make_shared<CellOptions>();
  command = AddMapQuestion(app, action, "neighbors", "the neighbours of a cell, whatever block they are in",
                           "ndmap neighbors bunny h12/0.3 --through 0", neighbors, RingOf);
  AddCellArgument(command, neighbors);
  AddIdsFlag(command, neighbors);
  AddThroughOption(command, neighbors);
  AddCheck(command, neighbors, CheckThrough);

  auto ring = std::make_shared<CellOptions>();
  command = AddMapQuestion(app, action, "ring", "the cells at most K steps away from a cell",
                           "ndmap ring bunny h12/0.3 2 --through 0", ring, RingOf);
  AddCellArgument(command, ring);
  command->add_option("K", ring->steps, "steps from neighbour to neighbour")
      ->required()
      ->check(WholeNumber(1, kMaxRing));
  AddIdsFlag(command, ring);
  AddThroughOption(command, ring);
  AddCheck(command, ring, CheckThrough);
}

}  // namespace

void AddCellCommands(CLI::App& app, Action& action) {
  AddCommandsAboutOneCell(app, action);

  auto locate = std::make_shared<CellOptions>();
  CLI::App* command = AddMapQuestion(app, action, "locate",
                                     "the hexahedra that contain points (exit code 1: some point is in none)",
                                     "ndmap locate bunny 0.1,0.2,0.3 1,0,0", locate, Locate);
  AddPointArguments(command, locate, 1, CLI::detail::expected_max_vector_size, "points X,Y,Z");

  auto box = std::make_shared<CellOptions>();
  command = AddMapQuestion(app, action, "box", "the hexahedra that a box meets",
                           "ndmap box bunny 0,0,0 0.5,0.5,0.5 --ids", box, CellsInBox);
  AddPointArguments(command, box, 2, 2, "lower and upper corner X,Y,Z");
  AddIdsFlag(command, box);
  AddCheck(command, box, CheckBox);

  auto nearest = std::make_shared<CellOptions>();
  command = AddMapQuestion(app, action, "nearest", "the vertex nearest to a point",
                           "ndmap nearest bunny 0.1,0.2,0.3", nearest, Nearest);
  AddPointArguments(command, nearest, 1, 1, "the point X,Y,Z");
}

}  // namespace ndmap::cli

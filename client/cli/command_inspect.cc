// SPDX-License-Identifier: GPL-3.0-or-later
// `ndmap inspect`: what a mesh file holds, or why it cannot be used.
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/cli/context.h"
#include "client/cli/text.h"
#include "core/io/mesh_reader.h"
#include "core/io/polygon_reader.h"
#include "core/mesh/mesh_facts.h"
#include "core/mesh/polygon_mesh.h"

namespace ndmap::cli {
namespace {

struct InspectOptions {
  std::string file;
  GlueOptions glue;
};

std::string Number(double x) { return absl::StrFormat("%.6g", x); }

std::string Many(uint64_t n, absl::string_view one, absl::string_view many) {
  return absl::StrCat(FormatCount(static_cast<int64_t>(n)), " ", n == 1 ? one : many);
}

std::string Line(absl::string_view what, absl::string_view is) {
  return absl::StrCat(absl::StrFormat("  %-12s", what), is, "\n");
}

std::string BoxText(const Box3& box) {
  const auto corner = [](const Point3& p) {
    return absl::StrCat(Number(p[0]), ",", Number(p[1]), ",", Number(p[2]));
  };
  return absl::StrCat(corner(box.lo), " to ", corner(box.hi));
}

Json BoxAsJson(const Box3& box) { return {{"lo", box.lo}, {"hi", box.hi}}; }

std::string Remarks(const std::vector<std::string>& notes, const std::vector<std::string>& warnings) {
  std::string text;
  for (const std::string& note : notes) absl::StrAppend(&text, Line("note", note));
  for (const std::string& warning : warnings) absl::StrAppend(&text, Line("warning", warning));
  return text;
}

std::string SplitText(uint64_t points, uint64_t edges) {
  return absl::StrCat("cells meet there and are not glued around them: a map has ",
                      Many(points, "vertex", "vertices"), " and ", Many(edges, "edge", "edges"), " more");
}

void PrintVolume(const Context& context, const InspectOptions& options, const std::string& format,
                 const GluedMesh& glued) {
  const MeshFacts facts = Describe(glued);
  Json cells = Json::object();
  std::string kinds;
  for (int kind = 0; kind < kCellKinds; ++kind) {
    const CellShape& shape = kCellShapes[kind];
    cells[std::string(shape.plural)] = facts.cells[kind];
    if (facts.cells[kind] == 0) continue;
    absl::StrAppend(&kinds, kinds.empty() ? "" : ", ", Many(facts.cells[kind], shape.name, shape.plural));
  }
  const VolumeMesh& mesh = glued.mesh;
  const std::string worst =
      absl::StrCat(ShapeOf(mesh.kinds[facts.worst_cell]).name, " ", mesh.source.Cell(facts.worst_cell));
  const Json object = {{"file", options.file},
                       {"format", format},
                       {"dimension", 3},
                       {"cells", cells},
                       {"points", facts.points},
                       {"edges", facts.edges},
                       {"faces", facts.faces},
                       {"components", facts.components},
                       {"euler", facts.euler},
                       {"boundary",
                        {{"faces", facts.boundary_faces},
                         {"edges", facts.boundary_edges},
                         {"points", facts.boundary_points},
                         {"components", facts.boundary_components},
                         {"euler", facts.boundary_euler},
                         {"crowded_edges", facts.crowded_boundary_edges}}},
                       {"split", {{"points", facts.split_points}, {"edges", facts.split_edges}}},
                       {"box", BoxAsJson(facts.box)},
                       {"volume", facts.volume},
                       {"worst_corner", {{"scaled_jacobian", facts.worst_corner}, {"cell", worst}}},
                       {"notes", glued.notes},
                       {"warnings", glued.warnings}};
  std::string text = absl::StrCat(options.file, ": a volume mesh in ", format, "\n");
  absl::StrAppend(
      &text, Line("cells", kinds), Line("points", FormatCount(static_cast<int64_t>(facts.points))),
      Line("whole", absl::StrCat(Many(facts.components, "component", "components"), ", Euler characteristic ",
                                 facts.euler)),
      Line("boundary", absl::StrCat(Many(facts.boundary_faces, "face", "faces"), " in ",
                                    Many(facts.boundary_components, "component", "components"),
                                    ", Euler characteristic ", facts.boundary_euler)),
      Line("box", BoxText(facts.box)), Line("volume", Number(facts.volume)),
      Line("worst", absl::StrCat("scaled corner Jacobian ", Number(facts.worst_corner), ", of ", worst)));
  if (facts.split_points + facts.split_edges > 0) {
    absl::StrAppend(&text, Line("note", SplitText(facts.split_points, facts.split_edges)));
  }
  context.Print(object, absl::StrCat(text, Remarks(glued.notes, glued.warnings)));
}

void PrintSurface(const Context& context, const InspectOptions& options, const GluedPolygons& glued) {
  const PolygonFacts facts = Describe(glued);
  const char* names[][2] = {
      {"triangle", "triangles"}, {"quadrilateral", "quadrilaterals"}, {"larger polygon", "larger polygons"}};
  std::string kinds;
  for (int i = 0; i < 3; ++i) {
    if (facts.faces[i] == 0) continue;
    absl::StrAppend(&kinds, kinds.empty() ? "" : ", ", Many(facts.faces[i], names[i][0], names[i][1]));
  }
  const Json object = {
      {"file", options.file},
      {"dimension", 2},
      {"cells",
       {{"triangles", facts.faces[0]}, {"quadrilaterals", facts.faces[1]}, {"polygons", facts.faces[2]}}},
      {"points", facts.points},
      {"edges", facts.edges},
      {"components", facts.components},
      {"euler", facts.euler},
      {"boundary", {{"edges", facts.boundary_edges}, {"cycles", facts.boundary_cycles}}},
      {"split", {{"points", facts.split_points}}},
      {"box", BoxAsJson(facts.box)},
      {"area", facts.area},
      {"notes", glued.notes},
      {"warnings", glued.warnings}};
  std::string text = absl::StrCat(options.file, ": a surface of polygons\n");
  absl::StrAppend(&text, Line("faces", kinds),
                  Line("points", FormatCount(static_cast<int64_t>(facts.points))),
                  Line("whole", absl::StrCat(Many(facts.components, "component", "components"),
                                             ", Euler characteristic ", facts.euler)),
                  Line("boundary", facts.boundary_edges == 0
                                       ? "none"
                                       : absl::StrCat(Many(facts.boundary_edges, "edge", "edges"), " in ",
                                                      Many(facts.boundary_cycles, "cycle", "cycles"))),
                  Line("box", BoxText(facts.box)), Line("area", Number(facts.area)));
  if (facts.split_points > 0) {
    absl::StrAppend(&text,
                    Line("note", absl::StrCat("faces meet in vertices only: a map has ",
                                              Many(facts.split_points, "vertex", "vertices"), " more")));
  }
  context.Print(object, absl::StrCat(text, Remarks(glued.notes, glued.warnings)));
}

absl::StatusOr<int> Inspect(const Context& context, const InspectOptions& options) {
  if (SurfaceFormatOf(options.file).ok()) {
    const auto glued = ReadGluedPolygons(options.file, options.glue);
    if (!glued.ok()) return glued.status();
    PrintSurface(context, options, *glued);
    return 0;
  }
  auto file = ReadVolumeMesh(options.file);
  if (!file.ok()) return file.status();
  auto glued = Glue(std::move(file->mesh), options.glue);
  if (!glued.ok()) return glued.status();
  glued->notes.insert(glued->notes.begin(), file->notes.begin(), file->notes.end());
  PrintVolume(context, options, file->format, *glued);
  return 0;
}

}  // namespace

void AddInspectCommand(CLI::App& app, Action& action) {
  auto options = std::make_shared<InspectOptions>();
  CLI::App* command = AddCommand(app, "inspect", "what a mesh file holds, or why it cannot be used",
                                 "ndmap inspect nozzle.msh");
  command
      ->add_option(
          "FILE", options->file,
          "a volume mesh: VTU, Gmsh 2 or 4.1, Medit, MFEM; or a surface: OFF, OBJ, PLY, STL; also .xz")
      ->required();
  command->add_flag("--merge-points", options->glue.merge_equal_points,
                    "make points of equal coordinates one, so that cells are glued across them");
  command->add_flag("--allow-concave", options->glue.allow_concave,
                    "take cells of positive volume with a corner turned inside out");
  command->callback([&action, options] {
    action = [options](Context& context) -> absl::StatusOr<int> { return Inspect(context, *options); };
  });
}

}  // namespace ndmap::cli

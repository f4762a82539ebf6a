// SPDX-License-Identifier: GPL-3.0-or-later
// The job of `ndmap run` as a user would write it without ndmap: one process, one plain CGAL linear cell
// complex with CGAL's own storage, CGAL's insert_* and remove_cell operations, AABB tree and inside test. The
// peer that ndmap's numbers are set beside. Only the formula for the grid's corners is ndmap's, so that both
// make the same hexahedra. Prints one JSON object.
//
//   bench_plain_cgal bumpy-torus.off --cubes 11 --depth 5

#include <CGAL/AABB_face_graph_triangle_primitive.h>
#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/Cell_attribute.h>
#include <CGAL/Cell_attribute_with_point.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Linear_cell_complex_for_combinatorial_map.h>
#include <CGAL/Polygon_mesh_processing/IO/polygon_mesh_io.h>
#include <CGAL/Polygon_mesh_processing/bbox.h>
#include <CGAL/Polygon_mesh_processing/triangulate_faces.h>
#include <CGAL/Side_of_triangle_mesh.h>
#include <CGAL/Surface_mesh.h>
#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <array>
#include <chrono>
#include <cstdint>
#include <iostream>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_replace.h"
#include "absl/strings/str_split.h"
#include "core/geometry/grid_shape.h"
#include "tests/reference/plain_hexahedra.h"

namespace ndmap {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;
using Tree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, CGAL::AABB_face_graph_triangle_primitive<Mesh>>>;
using Side = CGAL::Side_of_triangle_mesh<Mesh, Kernel, CGAL::Default, Tree>;

enum class State : uint8_t { kUnknown, kCut, kInside, kOutside };
struct Vertex {
  uint8_t level = 0;
};
struct Items {
  template <class Refs>
  struct Dart_wrapper {
    using Attributes = std::tuple<CGAL::Cell_attribute_with_point<Refs, Vertex>, void, void,
                                  CGAL::Cell_attribute<Refs, State>>;
  };
};
using Lcc = CGAL::Linear_cell_complex_for_combinatorial_map<3, 3, CGAL::Linear_cell_complex_traits<3>, Items>;
using Hexahedra = reference::PlainHexahedra<Lcc>;
using Dart = Lcc::Dart_handle;

double Seconds(const timeval& t) {
  return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
}

// Seconds of this process by phase: wall, user and system.
class Phases {
 public:
  // Ends the phase that was running; an unnamed phase is not reported.
  void Begin(const std::string& name) {
    const Sample now = Now();
    if (!name_.empty()) {
      Sample& sum = SumOf(name_);
      for (size_t i = 0; i < sum.size(); ++i) sum[i] += now[i] - began_[i];
    }
    name_ = name;
    began_ = now;
  }
  std::string Json() const {
    std::vector<std::string> members;
    Sample total{};
    for (const auto& [name, s] : sums_) {
      members.push_back(Member(name, s));
      for (size_t i = 0; i < s.size(); ++i) total[i] += s[i];
    }
    members.push_back(Member("total", total));
    return absl::StrCat("{", absl::StrJoin(members, ", "), "}");
  }

 private:
  using Sample = std::array<double, 3>;
  static Sample Now() {
    rusage usage;
    getrusage(RUSAGE_SELF, &usage);
    const auto wall = std::chrono::steady_clock::now().time_since_epoch();
    return {std::chrono::duration<double>(wall).count(), Seconds(usage.ru_utime), Seconds(usage.ru_stime)};
  }
  static std::string Member(const std::string& name, const Sample& s) {
    return absl::StrFormat("\"%s\": {\"wall\": %.3f, \"user\": %.3f, \"system\": %.3f}", name, s[0], s[1],
                           s[2]);
  }
  Sample& SumOf(const std::string& name) {
    for (auto& [known, sum] : sums_) {
      if (known == name) return sum;
    }
    return sums_.emplace_back(name, Sample{}).second;
  }

  std::string name_;
  Sample began_{};
  std::vector<std::pair<std::string, Sample>> sums_;
};

class Job {
 public:
  explicit Job(Phases& phases) : phases_(phases), hexahedra_(lcc_) {}

  void MakeGrid(const GridShape& grid) {
    phases_.Begin("grid");
    const auto [nx, ny, nz] = grid.cells;
    for (uint32_t k = 0; k < nz; ++k) {
      for (uint32_t j = 0; j < ny; ++j) {
        for (uint32_t i = 0; i < nx; ++i) {
          std::array<Lcc::Point, 8> points;
          for (unsigned c = 0; c < 8; ++c) {
            const Point3 p = grid.Corner(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2));
            points[c] = Lcc::Point(p[0], p[1], p[2]);
          }
          const Dart d = hexahedra_.Make(points);
          const size_t made = leaves_.size();
          if (i > 0) hexahedra_.SewAlong(leaves_[made - 1], d, 0);
          if (j > 0) hexahedra_.SewAlong(leaves_[made - nx], d, 1);
          if (k > 0) hexahedra_.SewAlong(leaves_[made - size_t{nx} * ny], d, 2);
          leaves_.push_back(d);
        }
      }
    }
    for (const Dart d : leaves_) lcc_.set_attribute<3>(d, lcc_.create_attribute<3>(State::kUnknown));
  }

  // Level by level: what the surface cuts is split in eight, down to level `depth`.
  void Refine(const Tree& tree, int depth) {
    std::vector<Dart> present = std::move(leaves_);
    leaves_.clear();
    for (int level = 0; level <= depth; ++level) {
      phases_.Begin("test");
      std::vector<Dart> cut;
      for (const Dart d : present) {
        const bool meets = tree.do_intersect(BoxOf(d, level));
        if (meets) lcc_.info<3>(d) = State::kCut;
        (meets && level < depth ? cut : leaves_).push_back(d);
        if (meets && level == depth) ++cut_;
      }
      phases_.Begin("split");
      present.clear();
      for (const Dart d : cut) {
        for (const Dart child : hexahedra_.Split(d, level)) {
          lcc_.info<3>(child) = State::kUnknown;
          present.push_back(child);
        }
      }
    }
    made_ = leaves_.size();
    darts_made_ = lcc_.number_of_darts();
  }

  // Hexahedra that are not cut and share a face are on the same side: one question a component.
  void Classify(const Tree& tree) {
    phases_.Begin("classify");
    const Side side(tree);
    std::vector<Dart> stack;
    for (const Dart first : leaves_) {
      if (lcc_.info<3>(first) != State::kUnknown) continue;
      // Any corner will do: the closed hexahedron does not meet the surface.
      const State state = side(lcc_.point(first)) == CGAL::ON_BOUNDED_SIDE ? State::kInside : State::kOutside;
      lcc_.info<3>(first) = state;
      stack.push_back(first);
      while (!stack.empty()) {
        const Dart d = stack.back();
        stack.pop_back();
        if (state == State::kInside) ++inside_;
        for (auto it = lcc_.darts_of_cell<3>(d).begin(), end = lcc_.darts_of_cell<3>(d).end(); it != end;
             ++it) {
          if (lcc_.is_free<3>(it)) continue;
          const Dart next = lcc_.beta<3>(it);
          if (lcc_.info<3>(next) != State::kUnknown) continue;
          lcc_.info<3>(next) = state;
          stack.push_back(next);
        }
      }
    }
  }

  void RemoveOutside() {
    phases_.Begin("remove");
    for (const Dart d : leaves_) {
      if (lcc_.info<3>(d) != State::kOutside) continue;
      lcc_.remove_cell<3>(d);
      ++removed_;
    }
  }

  bool Valid() const { return lcc_.is_valid(); }

  // Members of the JSON object, without braces.
  std::string Json() const {
    return absl::StrFormat(
        "\"made\": %d, \"hexahedra\": %d, \"removed\": %d, \"cut\": %d, \"inside\": %d, \"darts_made\": %d, "
        "\"darts\": %d, \"vertices\": %d",
        made_, made_ - removed_, removed_, cut_, inside_, darts_made_, lcc_.number_of_darts(),
        lcc_.vertex_attributes().size());
  }

 private:
  // The closed axis-aligned box of the corners.
  CGAL::Bbox_3 BoxOf(Dart d, int level) const {
    CGAL::Bbox_3 box;
    for (const Lcc::Point& p : hexahedra_.Corners(d, level)) box += p.bbox();
    return box;
  }

  Phases& phases_;
  Lcc lcc_;
  Hexahedra hexahedra_;
  std::vector<Dart> leaves_;  // The reference dart of each hexahedron.
  size_t made_ = 0, removed_ = 0, cut_ = 0, inside_ = 0, darts_made_ = 0;
};

absl::StatusOr<Mesh> Load(const std::string& file) {
  Mesh mesh;
  if (!CGAL::Polygon_mesh_processing::IO::read_polygon_mesh(file, mesh) || mesh.is_empty() ||
      !CGAL::is_closed(mesh)) {
    return absl::InvalidArgumentError(absl::StrCat(file, ": not readable as one closed surface"));
  }
  CGAL::Polygon_mesh_processing::triangulate_faces(mesh);
  return mesh;
}

absl::StatusOr<GridShape> MakeShape(const Mesh& mesh, const std::string& counts, uint32_t cubes) {
  const CGAL::Bbox_3 b = CGAL::Polygon_mesh_processing::bbox(mesh);
  const Box3 box{{b.xmin(), b.ymin(), b.zmin()}, {b.xmax(), b.ymax(), b.zmax()}};
  if (cubes > 0) return GridFromCubes(box, cubes);
  if (counts.empty()) return GridAuto(box);
  const std::vector<std::string> parts = absl::StrSplit(counts, 'x');
  std::array<uint32_t, 3> n;
  for (size_t a = 0; a < 3; ++a) {
    if (parts.size() != 3 || !absl::SimpleAtoi(parts[a], &n[a])) {
      return absl::InvalidArgumentError(absl::StrCat("--grid ", counts, ": expected AxBxC"));
    }
  }
  return GridFromCounts(box, n);
}

absl::Status Run(const std::string& file, const std::string& counts, uint32_t cubes, int depth, bool check) {
  Phases phases;
  phases.Begin("load");
  const absl::StatusOr<Mesh> mesh = Load(file);
  if (!mesh.ok()) return mesh.status();
  Tree tree(mesh->faces().begin(), mesh->faces().end(), *mesh);
  tree.build();
  const absl::StatusOr<GridShape> grid = MakeShape(*mesh, counts, cubes);
  if (!grid.ok()) return grid.status();
  Job job(phases);
  job.MakeGrid(*grid);
  job.Refine(tree, depth);
  job.Classify(tree);
  job.RemoveOutside();
  phases.Begin("");
  rusage usage;
  getrusage(RUSAGE_SELF, &usage);
  const bool valid = !check || job.Valid();
  std::cout << absl::StrFormat(
      "{\"program\": \"plain_cgal\", \"surface\": \"%s\", \"triangles\": %d, \"grid\": [%d, %d, %d], "
      "\"depth\": %d, %s, \"peak_rss_bytes\": %d, \"seconds\": %s%s}\n",
      absl::StrReplaceAll(file, {{"\\", "\\\\"}, {"\"", "\\\""}}), mesh->number_of_faces(), grid->cells[0],
      grid->cells[1], grid->cells[2], depth, job.Json(), int64_t{usage.ru_maxrss} * 1024, phases.Json(),
      check ? absl::StrCat(", \"valid\": ", valid ? "true" : "false") : "");
  return valid ? absl::OkStatus() : absl::InternalError("CGAL's is_valid() is false");
}

}  // namespace
}  // namespace ndmap

int main(int argc, char** argv) {
  CLI::App app("ndmap's main job on one plain CGAL linear cell complex, timed");
  std::string file, grid;
  uint32_t cubes = 0;
  int depth = 4;
  bool check = false;
  app.add_option("surface", file, "A closed surface: OFF, OBJ, PLY, STL")
      ->required()
      ->check(CLI::ExistingFile);
  CLI::Option* counts = app.add_option("--grid", grid, "Initial hexahedra along each axis, AxBxC");
  app.add_option("--cubes", cubes, "Initial cubes along the longest side")->excludes(counts);
  app.add_option("--depth", depth, "Levels 0 ... depth")->check(CLI::Range(0, 20));
  app.add_flag("--check", check, "Ask CGAL whether the map is valid at the end (not timed)");
  CLI11_PARSE(app, argc, argv);
  const absl::Status status = ndmap::Run(file, grid, cubes, depth, check);
  if (!status.ok()) std::cerr << "bench_plain_cgal: " << status.message() << "\n";
  return status.ok() ? 0 : 1;
}

// SPDX-License-Identifier: GPL-3.0-or-later
// How many hexahedra adaptive refinement must make over a surface, how many of them are cut and how many
// inside: by plain recursion over boxes with lists of triangles. No map, no blocks, and neither ndmap's tree
// of triangles nor its parity: the tests compare with it.
//   ndmap_octree_count SURFACE (--grid AxBxC [--padding 0.001] | --cubes N) --depth D
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Side_of_triangle_mesh.h>
#include <CGAL/Surface_mesh.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "core/io/sample_surface.h"
#include "core/io/surface_reader.h"

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using ndmap::Box3;
using ndmap::Point3;
using ndmap::TriangleSurface;

struct Options {
  std::string surface, grid, cubes;
  double padding = 0.001;
  int depth = 0;
};

// The corner coordinates along each axis.
struct Grid {
  std::array<std::vector<double>, 3> corners;
};

struct Counts {
  std::vector<uint64_t> hexahedra, split;  // By level.
  uint64_t cut = 0, inside = 0, outside = 0;
  double cut_volume = 0, inside_volume = 0;
};

void Fail(const std::string& what) {
  std::cerr << "ndmap_octree_count: " << what << "\n";
  std::exit(2);
}

// A coordinate is lo + (hi - lo) * i / n, in this order.
std::vector<double> Corners(double lo, double hi, int n) {
  std::vector<double> corners;
  for (int i = 0; i <= n; ++i) corners.push_back(lo + (hi - lo) * i / n);
  return corners;
}

Grid MakeGrid(const Options& options, const Box3& box) {
  Grid grid;
  std::array<int, 3> n{};
  if (!options.cubes.empty()) {
    const int cubes = std::atoi(options.cubes.c_str());
    if (cubes < 1) Fail("--cubes " + options.cubes + " is not a positive number");
    double longest = 0;
    for (int c = 0; c < 3; ++c) longest = std::max(longest, box.hi[c] - box.lo[c]);
    const double side = 1.001 * longest / cubes;
    for (int c = 0; c < 3; ++c) {
      const double centre = (box.lo[c] + box.hi[c]) / 2;
      n[c] = std::max(1, static_cast<int>(std::ceil((box.hi[c] - box.lo[c]) / side)));
      grid.corners[c] = Corners(centre - side * n[c] / 2, centre + side * n[c] / 2, n[c]);
    }
    return grid;
  }
  if (std::sscanf(options.grid.c_str(), "%dx%dx%d", &n[0], &n[1], &n[2]) != 3 || n[0] < 1 || n[1] < 1 ||
      n[2] < 1) {
    Fail("--grid AxBxC or --cubes N expected, not '" + options.grid + "'");
  }
  for (int c = 0; c < 3; ++c) {
    const double centre = (box.lo[c] + box.hi[c]) / 2, half = (box.hi[c] - box.lo[c]) / 2;
    grid.corners[c] =
        Corners(centre - half * (1 + options.padding), centre + half * (1 + options.padding), n[c]);
  }
  return grid;
}

class Counter {
 public:
  Counter(const TriangleSurface& surface, int depth) : depth_(depth) {
    std::vector<Kernel::Point_3> points;
    for (const Point3& p : surface.points) points.emplace_back(p[0], p[1], p[2]);
    for (const auto& [a, b, c] : surface.triangles) {
      triangles_.emplace_back(points[a], points[b], points[c]);
      boxes_.push_back(triangles_.back().bbox());
    }
    namespace PMP = CGAL::Polygon_mesh_processing;
    auto triangles = surface.triangles;
    if (!PMP::is_polygon_soup_a_polygon_mesh(triangles)) PMP::orient_polygon_soup(points, triangles);
    PMP::polygon_soup_to_polygon_mesh(points, triangles, mesh_);
    side_ = std::make_unique<Side>(mesh_);
    counts.hexahedra.resize(depth + 1);
    counts.split.resize(depth + 1);
  }

  // `near`: the triangles that the parent meets.
  void Descend(const CGAL::Bbox_3& box, const std::vector<uint32_t>& near, int level) {
    std::vector<uint32_t> met;
    for (uint32_t t : near) {
      // A leaf needs one triangle, not all.
      if (CGAL::do_overlap(boxes_[t], box) && CGAL::do_intersect(triangles_[t], box)) {
        met.push_back(t);
        if (level == depth_) break;
      }
    }
    ++counts.hexahedra[level];
    if (met.empty() || level == depth_) {
      Leaf(box, !met.empty());
      return;
    }
    ++counts.split[level];
    const double x[3] = {box.xmin(), (box.xmin() + box.xmax()) / 2, box.xmax()};
    const double y[3] = {box.ymin(), (box.ymin() + box.ymax()) / 2, box.ymax()};
    const double z[3] = {box.zmin(), (box.zmin() + box.zmax()) / 2, box.zmax()};
    for (int i = 0; i < 8; ++i) {
      const int a = i & 1, b = i >> 1 & 1, c = i >> 2;
      Descend({x[a], y[b], z[c], x[a + 1], y[b + 1], z[c + 1]}, met, level + 1);
    }
  }

  std::vector<uint32_t> AllTriangles() const {
    std::vector<uint32_t> all(triangles_.size());
    for (uint32_t t = 0; t < all.size(); ++t) all[t] = t;
    return all;
  }

  Counts counts;

 private:
  using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;
  using Side = CGAL::Side_of_triangle_mesh<Mesh, Kernel>;

  void Leaf(const CGAL::Bbox_3& box, bool cut) {
    const double volume = (box.xmax() - box.xmin()) * (box.ymax() - box.ymin()) * (box.zmax() - box.zmin());
    if (cut) {
      ++counts.cut;
      counts.cut_volume += volume;
      return;
    }
    const Kernel::Point_3 centre((box.xmin() + box.xmax()) / 2, (box.ymin() + box.ymax()) / 2,
                                 (box.zmin() + box.zmax()) / 2);
    if ((*side_)(centre) == CGAL::ON_BOUNDED_SIDE) {
      ++counts.inside;
      counts.inside_volume += volume;
    } else {
      ++counts.outside;
    }
  }

  int depth_;
  std::vector<Kernel::Triangle_3> triangles_;
  std::vector<CGAL::Bbox_3> boxes_;
  Mesh mesh_;
  std::unique_ptr<Side> side_;
};

double EnclosedVolume(const TriangleSurface& surface) {
  double six = 0;
  const Point3& o = surface.points[0];
  for (const auto& t : surface.triangles) {
    Point3 v[3];
    for (int k = 0; k < 3; ++k) {
      for (int c = 0; c < 3; ++c) v[k][c] = surface.points[t[k]][c] - o[c];
    }
    six += v[0][0] * (v[1][1] * v[2][2] - v[1][2] * v[2][1]) +
           v[0][1] * (v[1][2] * v[2][0] - v[1][0] * v[2][2]) +
           v[0][2] * (v[1][0] * v[2][1] - v[1][1] * v[2][0]);
  }
  return six / 6;
}

std::string List(const std::vector<uint64_t>& numbers) {
  std::string text;
  for (uint64_t n : numbers) text += (text.empty() ? "[" : ", ") + std::to_string(n);
  return text + "]";
}

Options Parse(int argc, char** argv) {
  Options options;
  for (int i = 1; i < argc; ++i) {
    const std::string arg = argv[i];
    if (arg.rfind("--", 0) != 0) {
      options.surface = arg;
      continue;
    }
    if (i + 1 == argc) Fail(arg + " needs a value");
    const std::string value = argv[++i];
    if (arg == "--grid") {
      options.grid = value;
    } else if (arg == "--cubes") {
      options.cubes = value;
    } else if (arg == "--padding") {
      options.padding = std::atof(value.c_str());
    } else if (arg == "--depth") {
      options.depth = std::atoi(value.c_str());
    } else {
      Fail("unknown flag " + arg);
    }
  }
  if (options.surface.empty()) Fail("a surface expected: a file, or sample:KIND");
  if (options.depth < 0 || options.depth > 20) Fail("--depth from 0 to 20 expected");
  return options;
}

TriangleSurface Load(const std::string& name) {
  if (name.rfind("sample:", 0) == 0) {
    const auto sample = ndmap::MakeSample(name.substr(7));
    if (!sample.ok()) Fail(std::string(sample.status().message()));
    return *sample;
  }
  ndmap::ReadLimits limits;
  limits.check_self_intersections = false;
  auto file = ndmap::ReadSurface(name, limits);
  if (!file.ok()) Fail(std::string(file.status().message()));
  return file->surface;
}

}  // namespace

int main(int argc, char** argv) {
  const Options options = Parse(argc, argv);
  const TriangleSurface surface = Load(options.surface);
  const Grid grid = MakeGrid(options, ndmap::BoundingBox(surface));
  Counter counter(surface, options.depth);
  const std::vector<uint32_t> all = counter.AllTriangles();
  const auto &x = grid.corners[0], &y = grid.corners[1], &z = grid.corners[2];
  for (size_t k = 0; k + 1 < z.size(); ++k) {
    for (size_t j = 0; j + 1 < y.size(); ++j) {
      for (size_t i = 0; i + 1 < x.size(); ++i) {
        counter.Descend({x[i], y[j], z[k], x[i + 1], y[j + 1], z[k + 1]}, all, 0);
      }
    }
  }
  const Counts& c = counter.counts;
  std::printf(
      "{\"grid\": [%zu, %zu, %zu], \"depth\": %d, \"made\": %llu, \"cut\": %llu, \"inside\": %llu, "
      "\"outside\": %llu, \"levels\": %s, \"split\": %s, \"v_inside\": %.17g, \"v_cut\": %.17g, "
      "\"v_surface\": %.17g}\n",
      x.size() - 1, y.size() - 1, z.size() - 1, options.depth,
      static_cast<unsigned long long>(c.cut + c.inside + c.outside), static_cast<unsigned long long>(c.cut),
      static_cast<unsigned long long>(c.inside), static_cast<unsigned long long>(c.outside),
      List(c.hexahedra).c_str(), List(c.split).c_str(), c.inside_volume, c.cut_volume,
      EnclosedVolume(surface));
  return 0;
}

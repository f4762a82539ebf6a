// SPDX-License-Identifier: GPL-3.0-or-later
// write_torus FOLDER DEPTH hexahedra|polyhedra: an octree mesh of a torus, written by core/io/vtu_writer as
// four pieces, an empty fifth and an index, and on standard output what a reader should find in them. It has
// no map: the octree is arithmetic on a lattice, so the writer can be tested, and pictures be tried, without
// anything else.
#include <array>
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <map>
#include <string>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/types/span.h"
#include "core/io/vtu_writer.h"

namespace {

using ndmap::Point3;
using Lattice = std::array<int64_t, 3>;

constexpr Lattice kGrid = {12, 12, 4};
constexpr double kSide = 0.25;  // of an initial cube; the box is centred at the origin
constexpr double kMajor = 1.0;
constexpr double kMinor = 0.4;
constexpr int kBlocks = 4;

double DistanceToTorus(const Point3& p) { return std::hypot(std::hypot(p[0], p[1]) - kMajor, p[2]) - kMinor; }

struct Cube {
  Lattice low;
  int64_t size = 0;  // in lattice steps
  ndmap::VtuCell cell;
};

class Mesh {
 public:
  explicit Mesh(int depth) : depth_(depth), step_(kSide / static_cast<double>(int64_t{1} << depth)) {
    const int64_t size = int64_t{1} << depth;
    for (int64_t z = 0; z < kGrid[2]; ++z) {
      for (int64_t y = 0; y < kGrid[1]; ++y) {
        for (int64_t x = 0; x < kGrid[0]; ++x) {
          const int32_t block = (x < kGrid[0] / 2 ? 0 : 1) + (y < kGrid[1] / 2 ? 0 : 2);
          Refine({x * size, y * size, z * size}, size, 0, block);
        }
      }
    }
    for (const Cube& cube : cubes_) {
      for (int c = 0; c < 8; ++c) points_.try_emplace(Number(Corner(cube, c)), 0);
    }
  }

  const std::vector<Cube>& cubes() const { return cubes_; }
  size_t number_of_points() const { return points_.size(); }
  double volume(const Cube& cube) const { return std::pow(step_ * static_cast<double>(cube.size), 3); }

  ndmap::VtuPiece Piece(int32_t block, bool polyhedra) const {
    ndmap::VtuPiece piece;
    absl::flat_hash_map<int64_t, int64_t> index;
    const auto add = [&](const Lattice& at) {
      const auto [it, added] = index.try_emplace(Number(at), 0);
      if (added) it->second = piece.AddPoint(Position(at), it->first);
      return it->second;
    };
    for (const Cube& cube : cubes_) {
      if (cube.cell.block != block) continue;
      if (polyhedra) {
        AddPolyhedron(cube, add, piece);
      } else {
        std::array<int64_t, 8> corners;
        for (int c = 0; c < 8; ++c) corners[c] = add(Corner(cube, c));
        piece.AddHexahedron(corners, cube.cell);
      }
    }
    AddFields(piece);
    return piece;
  }

 private:
  // One of each type, of what the piece has anyway: the first coordinate and the place of points, the number
  // of cells and on which side of the middle it is.
  void AddFields(ndmap::VtuPiece& piece) const {
    ndmap::VtuField first{"first", ndmap::VtuField::Type::kDoubles, {}, {}, {}};
    ndmap::VtuField place{"place", ndmap::VtuField::Type::kVectors, {}, {}, {}};
    for (const Point3& point : piece.points) {
      first.doubles.push_back(point[0]);
      place.doubles.insert(place.doubles.end(), point.begin(), point.end());
    }
    piece.point_fields = {first, place};
    const auto middle = static_cast<int64_t>(cubes_.size() / 2);
    ndmap::VtuField side{"side", ndmap::VtuField::Type::kTexts, {}, {}, {}};
    for (int64_t id : piece.cell_ids) side.texts.push_back(id < middle ? "größere" : "");
    piece.cell_fields = {{"number", ndmap::VtuField::Type::kIntegers, {}, piece.cell_ids, {}}, side};
  }

  Point3 Position(const Lattice& at) const {
    Point3 p;
    for (int i = 0; i < 3; ++i) {
      p[i] = static_cast<double>(at[i]) * step_ - kSide * static_cast<double>(kGrid[i]) / 2;
    }
    return p;
  }

  int64_t Number(const Lattice& at) const {
    const int64_t size = int64_t{1} << depth_;
    return at[0] + (kGrid[0] * size + 1) * (at[1] + (kGrid[1] * size + 1) * at[2]);
  }

  // Corner c in VTK's order.
  static Lattice Corner(const Cube& cube, int c) {
    const int x = (c & 1) ^ ((c >> 1) & 1);
    return {cube.low[0] + x * cube.size, cube.low[1] + ((c >> 1) & 1) * cube.size,
            cube.low[2] + (c >> 2) * cube.size};
  }

  // Splits what the surface may cut down to the depth, keeps what is inside or cut.
  void Refine(const Lattice& low, int64_t size, uint8_t level, int32_t block) {
    Point3 centre = Position(low);
    const double half = step_ * static_cast<double>(size) / 2;
    for (double& x : centre) x += half;
    const double distance = DistanceToTorus(centre);
    const bool cut = std::abs(distance) <= half * std::sqrt(3.0);
    if (!cut || level == depth_) {
      if (!cut && distance > 0) return;
      cubes_.push_back({low, size, {block, level, static_cast<uint8_t>(cut ? 3 : 2), 0}});
      cubes_.back().cell.id = static_cast<int64_t>(cubes_.size()) - 1;
      return;
    }
    for (int c = 0; c < 8; ++c) {
      Refine({low[0] + (c & 1) * size / 2, low[1] + ((c >> 1) & 1) * size / 2, low[2] + (c >> 2) * size / 2},
             size / 2, level + 1, block);
    }
  }

  bool IsPoint(const Lattice& at) const { return points_.contains(Number(at)); }

  // Appends the points of the edge from a up to, not including, b: those that hang on it are there.
  template <typename Add>
  void AppendEdge(const Lattice& a, const Lattice& b, Add add, std::vector<int64_t>& face) const {
    const Lattice middle = {(a[0] + b[0]) / 2, (a[1] + b[1]) / 2, (a[2] + b[2]) / 2};
    if (middle != a && middle != b && (a[0] + b[0] + a[1] + b[1] + a[2] + b[2]) % 2 == 0 && IsPoint(middle)) {
      AppendEdge(a, middle, add, face);
      AppendEdge(middle, b, add, face);
    } else {
      face.push_back(add(a));
    }
  }

  // Appends the square of `size` at `low`, spanned by axes u and v (in this order seen from outside), as one
  // face or, where its centre is a point, as its four quarters.
  template <typename Add>
  void AppendFaces(const Lattice& low, int64_t size, int u, int v, Add add, std::vector<int64_t>& sizes,
                   std::vector<int64_t>& all) const {
    const auto at = [&](int64_t du, int64_t dv) {
      Lattice p = low;
      p[u] += du;
      p[v] += dv;
      return p;
    };
    const int64_t half = size / 2;
    if (size > 1 && IsPoint(at(half, half))) {
      for (int q = 0; q < 4; ++q)
        AppendFaces(at((q & 1) * half, (q >> 1) * half), half, u, v, add, sizes, all);
      return;
    }
    std::vector<int64_t> face;
    AppendEdge(at(0, 0), at(size, 0), add, face);
    AppendEdge(at(size, 0), at(size, size), add, face);
    AppendEdge(at(size, size), at(0, size), add, face);
    AppendEdge(at(0, size), at(0, 0), add, face);
    sizes.push_back(static_cast<int64_t>(face.size()));
    all.insert(all.end(), face.begin(), face.end());
  }

  template <typename Add>
  void AddPolyhedron(const Cube& cube, Add add, ndmap::VtuPiece& piece) const {
    std::vector<int64_t> sizes;
    std::vector<int64_t> points;
    for (int axis = 0; axis < 3; ++axis) {
      const int u = (axis + 1) % 3;
      const int v = (axis + 2) % 3;
      AppendFaces(cube.low, cube.size, v, u, add, sizes, points);
      Lattice high = cube.low;
      high[axis] += cube.size;
      AppendFaces(high, cube.size, u, v, add, sizes, points);
    }
    piece.AddPolyhedron(sizes, points, cube.cell);
  }

  int depth_;
  double step_;
  std::vector<Cube> cubes_;
  absl::flat_hash_map<int64_t, int64_t> points_;
};

std::string Histogram(const std::map<int, int64_t>& counts) {
  return absl::StrCat("{",
                      absl::StrJoin(counts, ", ",
                                    [](std::string* out, const auto& entry) {
                                      absl::StrAppend(out, "\"", entry.first, "\": ", entry.second);
                                    }),
                      "}");
}

int Run(const std::string& folder, int depth, bool polyhedra) {
  const Mesh mesh(depth);
  std::vector<std::string> names;
  for (int32_t block = 0; block <= kBlocks; ++block) {
    names.push_back(absl::StrCat("torus & blocks_", block, ".vtu"));
    const absl::Status status =
        ndmap::WriteVtuFile(mesh.Piece(block, polyhedra), absl::StrCat(folder, "/", names.back()));
    if (!status.ok()) {
      std::cerr << status << "\n";
      return 1;
    }
  }
  const absl::Status indexed =
      ndmap::WritePvtuFileLike(absl::StrCat(folder, "/", names[0]), names, folder + "/torus.pvtu");
  if (!indexed.ok()) {
    std::cerr << indexed << "\n";
    return 1;
  }
  std::map<int, int64_t> blocks, levels, states;
  double volume = 0;
  for (const Cube& cube : mesh.cubes()) {
    ++blocks[cube.cell.block];
    ++levels[cube.cell.level];
    ++states[cube.cell.state];
    volume += mesh.volume(cube);
  }
  std::cout << "{\"cells\": " << mesh.cubes().size() << ", \"distinct_points\": " << mesh.number_of_points()
            << ", \"volume\": " << absl::StrCat(volume) << ", \"pieces\": " << names.size()
            << ", \"by_block\": " << Histogram(blocks) << ", \"by_level\": " << Histogram(levels)
            << ", \"by_state\": " << Histogram(states) << "}\n";
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  int depth = 0;
  const absl::string_view cells = argc == 4 ? argv[3] : "";
  if (argc != 4 || !absl::SimpleAtoi(argv[2], &depth) || depth < 0 || depth > 6 ||
      (cells != "hexahedra" && cells != "polyhedra")) {
    std::cerr << "usage: write_torus FOLDER DEPTH(0-6) hexahedra|polyhedra\n";
    return 2;
  }
  return Run(argv[1], depth, cells == "polyhedra");
}

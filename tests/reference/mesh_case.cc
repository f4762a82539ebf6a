// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/reference/mesh_case.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <random>
#include <utility>

#include "absl/container/flat_hash_set.h"
#include "absl/strings/str_cat.h"

namespace ndmap::reference {
namespace {

class MeshDice {
 public:
  explicit MeshDice(uint64_t seed) : random_(seed * 7919 + 11) {}
  uint32_t Below(size_t n) { return static_cast<uint32_t>(random_() % n); }
  double Unit() { return static_cast<double>(random_() >> 11) * 0x1p-53; }

 private:
  std::mt19937_64 random_;
};

using Corners = std::vector<uint32_t>;
struct Cell {
  CellKind kind;
  Corners corners;
};

Corners Pick(const Corners& from, const std::vector<unsigned>& which) {
  Corners picked;
  for (unsigned i : which) picked.push_back(from[i]);
  return picked;
}

// Lists the corners of the same cell in another order.
void Turn(MeshDice& dice, Cell& cell) {
  static const std::map<CellKind, std::vector<std::vector<unsigned>>> kTurns = {
      {CellKind::kTetrahedron, {{1, 2, 0, 3}, {1, 0, 3, 2}}},
      {CellKind::kPyramid, {{1, 2, 3, 0, 4}}},
      {CellKind::kPrism, {{1, 2, 0, 4, 5, 3}, {3, 5, 4, 0, 2, 1}}},
      {CellKind::kHexahedron, {{1, 2, 3, 0, 5, 6, 7, 4}, {0, 4, 5, 1, 3, 7, 6, 2}}}};
  const auto& turns = kTurns.at(cell.kind);
  for (uint32_t n = dice.Below(6); n > 0; --n) {
    cell.corners = Pick(cell.corners, turns[dice.Below(turns.size())]);
  }
}

// The hexahedra of a grid become cells of all kinds.
class Splitter {
 public:
  Splitter(MeshDice& dice, std::vector<Point3>& points) : dice_(dice), points_(points) {}

  // Corners in the order of the mesh. Faces that were split for a neighbour stay as they are.
  void Add(const Corners& hex, std::vector<Cell>* cells) {
    // The first is one that can be refined.
    const uint32_t wish = faces_.empty() ? 0 : dice_.Below(5);
    if (wish < 2 && AllWhole(hex)) {
      cells->push_back({CellKind::kHexahedron, hex});
    } else if (wish != 4 && Prisms(hex, cells)) {
      return;
    } else {
      Star(hex, cells);
    }
  }

 private:
  // A face: whole, or split by a diagonal between two points.
  using Diagonal = std::pair<uint32_t, uint32_t>;
  static constexpr Diagonal kWhole = {0, 0};

  static std::vector<uint32_t> KeyOf(Corners face) {
    std::sort(face.begin(), face.end());
    return face;
  }
  static Corners FaceOf(const Corners& hex, unsigned f) {
    const auto& face = ShapeOf(CellKind::kHexahedron).face[f];
    return {hex[face[0]], hex[face[1]], hex[face[2]], hex[face[3]]};
  }
  bool MayBe(const Corners& face, const Diagonal& diagonal) const {
    const auto it = faces_.find(KeyOf(face));
    return it == faces_.end() || it->second == diagonal;
  }
  static Diagonal Between(uint32_t a, uint32_t b) { return {std::min(a, b), std::max(a, b)}; }

  bool AllWhole(const Corners& hex) {
    for (unsigned f = 0; f < 6; ++f) {
      if (!MayBe(FaceOf(hex, f), kWhole)) return false;
    }
    for (unsigned f = 0; f < 6; ++f) faces_[KeyOf(FaceOf(hex, f))] = kWhole;
    return true;
  }

  bool Prisms(const Corners& original, std::vector<Cell>* cells) {
    static const std::vector<std::vector<unsigned>> kAxes = {
        {0, 1, 2, 3, 4, 5, 6, 7}, {0, 4, 5, 1, 3, 7, 6, 2}, {0, 3, 7, 4, 1, 2, 6, 5}};
    const Corners hex = Pick(original, kAxes[dice_.Below(3)]);
    const unsigned d = dice_.Below(2);
    for (unsigned f = 2; f < 6; ++f) {
      if (!MayBe(FaceOf(hex, f), kWhole)) return false;
    }
    const Diagonal low = Between(hex[d], hex[d + 2]), high = Between(hex[d + 4], hex[d + 6]);
    if (!MayBe(FaceOf(hex, 0), low) || !MayBe(FaceOf(hex, 1), high)) return false;
    for (unsigned f = 2; f < 6; ++f) faces_[KeyOf(FaceOf(hex, f))] = kWhole;
    faces_[KeyOf(FaceOf(hex, 0))] = low;
    faces_[KeyOf(FaceOf(hex, 1))] = high;
    for (unsigned half : {d, (d + 2) % 4}) {
      const unsigned a = half, b = (half + 1) % 4, c = (half + 2) % 4;
      cells->push_back({CellKind::kPrism, Pick(hex, {a, b, c, a + 4, b + 4, c + 4})});
    }
    return true;
  }

  // A cone over every face.
  void Star(const Corners& hex, std::vector<Cell>* cells) {
    const auto apex = static_cast<uint32_t>(points_.size());
    Point3 centre{};
    for (uint32_t p : hex) {
      for (int c = 0; c < 3; ++c) centre[c] += points_[p][c] / 8;
    }
    points_.push_back(centre);
    for (unsigned f = 0; f < 6; ++f) {
      Corners face = FaceOf(hex, f);
      const uint32_t way = dice_.Below(3);
      const Diagonal wish = way == 0 ? kWhole : Between(face[way - 1], face[way + 1]);
      const Diagonal diagonal = faces_.try_emplace(KeyOf(face), wish).first->second;
      // Seen from the apex.
      std::reverse(face.begin(), face.end());
      if (diagonal == kWhole) {
        cells->push_back({CellKind::kPyramid, {face[0], face[1], face[2], face[3], apex}});
        continue;
      }
      if (Between(face[0], face[2]) != diagonal) std::rotate(face.begin(), face.begin() + 1, face.end());
      cells->push_back({CellKind::kTetrahedron, {face[0], face[1], face[2], apex}});
      cells->push_back({CellKind::kTetrahedron, {face[0], face[2], face[3], apex}});
    }
  }

  MeshDice& dice_;
  std::vector<Point3>& points_;
  std::map<std::vector<uint32_t>, Diagonal> faces_;
};

void MakeMixed(MeshDice& dice, MeshCase* c) {
  const std::array<uint32_t, 3> n = {1 + dice.Below(3), 1 + dice.Below(3), 1 + dice.Below(3)};
  c->shape = absl::StrCat("split grid ", n[0], "x", n[1], "x", n[2]);
  std::vector<Point3> points;
  for (uint32_t k = 0; k <= n[2]; ++k) {
    for (uint32_t j = 0; j <= n[1]; ++j) {
      for (uint32_t i = 0; i <= n[0]; ++i) {
        points.push_back({i + dice.Unit() / 8, j + dice.Unit() / 8, k + dice.Unit() / 8});
      }
    }
  }
  std::vector<std::array<uint32_t, 3>> places;
  for (uint32_t k = 0; k < n[2]; ++k) {
    for (uint32_t j = 0; j < n[1]; ++j) {
      for (uint32_t i = 0; i < n[0]; ++i) places.push_back({i, j, k});
    }
  }
  for (size_t i = places.size(); i > 1; --i) std::swap(places[i - 1], places[dice.Below(i)]);
  Splitter splitter(dice, points);
  std::vector<Cell> cells;
  for (const auto& [i, j, k] : places) {
    const auto at = [&, i = i, j = j, k = k](uint32_t x, uint32_t y, uint32_t z) {
      return i + x + (n[0] + 1) * (j + y + (n[1] + 1) * (k + z));
    };
    splitter.Add({at(0, 0, 0), at(1, 0, 0), at(1, 1, 0), at(0, 1, 0), at(0, 0, 1), at(1, 0, 1), at(1, 1, 1),
                  at(0, 1, 1)},
                 &cells);
  }
  for (size_t i = cells.size(); i > 1; --i) std::swap(cells[i - 1], cells[dice.Below(i)]);
  c->mesh.points = std::move(points);
  for (Cell& cell : cells) {
    Turn(dice, cell);
    c->mesh.kinds.push_back(cell.kind);
    c->mesh.corners.insert(c->mesh.corners.end(), cell.corners.begin(), cell.corners.end());
    c->mesh.begins.push_back(c->mesh.corners.size());
  }
}

void MakeTurnedWheel(MeshDice& dice, MeshCase* c) {
  const uint32_t around = 3 + dice.Below(4), layers = 1 + dice.Below(3);
  c->shape = absl::StrCat("wheel of ", layers, " times ", around);
  const VolumeMesh wheel = MakeWheel(around, layers);
  std::vector<uint64_t> order;
  for (uint64_t cell = 0; cell < wheel.cells(); ++cell) order.push_back(cell);
  for (size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[dice.Below(i)]);
  c->mesh.points = wheel.points;
  for (uint64_t number : order) {
    Cell cell{wheel.kinds[number], Corners(wheel.Corners(number).begin(), wheel.Corners(number).end())};
    Turn(dice, cell);
    c->mesh.kinds.push_back(cell.kind);
    c->mesh.corners.insert(c->mesh.corners.end(), cell.corners.begin(), cell.corners.end());
    c->mesh.begins.push_back(c->mesh.corners.size());
  }
}

void Cut(MeshDice& dice, MeshCase* c) {
  const auto cells = static_cast<uint32_t>(c->mesh.cells());
  c->blocks = 1 + dice.Below(std::min(MeshCase::kMaxBlocks, cells));
  for (uint32_t n = 0; n < cells; ++n) c->block_of.push_back(dice.Below(c->blocks));
  const uint32_t first = dice.Below(cells);
  for (uint32_t b = 0; b < c->blocks; ++b) c->block_of[(first + b) % cells] = b;
}

std::vector<CellId> Refine(MeshDice& dice, MeshCase* c) {
  std::vector<CellId> open, leaves;
  for (uint64_t n = 0; n < c->mesh.cells(); ++n) {
    (c->mesh.kinds[n] == CellKind::kHexahedron ? open : leaves).push_back(CellId::Initial(n));
  }
  const uint32_t wanted = 1 + dice.Below(dice.Below(3) == 0 ? 100 : 12);
  const bool deepen = dice.Below(2) == 0;
  while (!open.empty() && c->refined.size() < wanted &&
         open.size() + leaves.size() + 7 < MeshCase::kMaxLeaves) {
    const size_t recent = std::min<size_t>(8, open.size());
    const size_t at =
        deepen && !c->refined.empty() ? open.size() - 1 - dice.Below(recent) : dice.Below(open.size());
    const CellId id = open[at];
    open.erase(open.begin() + static_cast<std::ptrdiff_t>(at));
    c->refined.push_back(id);
    for (unsigned child = 0; child < 8; ++child) {
      (id.level() + 1 < MeshCase::kMaxLevel ? open : leaves).push_back(id.Child(child));
    }
  }
  leaves.insert(leaves.end(), open.begin(), open.end());
  std::sort(leaves.begin(), leaves.end());
  return leaves;
}

}  // namespace

VolumeMesh MakeWheel(uint32_t around, uint32_t layers) {
  VolumeMesh mesh;
  const uint32_t ring = 2 * around, layer = ring + 1;
  for (uint32_t k = 0; k <= layers; ++k) {
    mesh.points.push_back({0, 0, 1.0 * k});
    for (uint32_t i = 0; i < ring; ++i) {
      const double angle = 6.283185307179586 * i / ring + 0.1 * k;
      const double radius = i % 2 == 0 ? 1 : 1.3;
      mesh.points.push_back({radius * std::cos(angle), radius * std::sin(angle), k + 0.05 * (i % 3)});
    }
  }
  for (uint32_t k = 0; k < layers; ++k) {
    for (uint32_t i = 0; i < around; ++i) {
      for (uint32_t z : {k, k + 1}) {
        mesh.corners.push_back(z * layer);
        for (uint32_t r = 0; r < 3; ++r) mesh.corners.push_back(z * layer + 1 + (2 * i + r) % ring);
      }
      mesh.kinds.push_back(CellKind::kHexahedron);
      mesh.begins.push_back(mesh.corners.size());
    }
  }
  return mesh;
}

std::vector<CellId> MeshCase::Leaves() const {
  absl::flat_hash_set<CellId> set;
  for (uint64_t n = 0; n < mesh.cells(); ++n) set.insert(CellId::Initial(n));
  for (const CellId& id : refined) {
    set.erase(id);
    for (unsigned child = 0; child < 8; ++child) set.insert(id.Child(child));
  }
  std::vector<CellId> leaves(set.begin(), set.end());
  std::sort(leaves.begin(), leaves.end());
  return leaves;
}

std::string MeshCase::Describe() const {
  std::array<int, kCellKinds> kinds{};
  for (CellKind kind : mesh.kinds) ++kinds[static_cast<size_t>(kind)];
  return absl::StrCat("seed ", seed, ": ", shape, ", ", kinds[0], " tetrahedra, ", kinds[1], " pyramids, ",
                      kinds[2], " prisms, ", kinds[3], " hexahedra, ", blocks, " blocks, ", refined.size(),
                      " refined, ", removed.size(), " removed");
}

MeshCase MakeMeshCase(uint64_t seed) {
  MeshCase c;
  c.seed = seed;
  MeshDice dice(seed);
  if (seed % 4 == 0) {
    MakeTurnedWheel(dice, &c);
  } else {
    MakeMixed(dice, &c);
  }
  Cut(dice, &c);
  const std::vector<CellId> leaves = Refine(dice, &c);
  if (dice.Below(2) == 0) {
    const double share = dice.Unit() / 2;
    for (const CellId& id : leaves) {
      if (dice.Unit() < share) c.removed.push_back(id);
    }
  }
  return c;
}

}  // namespace ndmap::reference

// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/reference/surface_case.h"

#include <algorithm>
#include <array>
#include <map>
#include <random>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"

namespace ndmap::reference {
namespace {

using Face = std::vector<uint32_t>;

class SurfaceDice {
 public:
  explicit SurfaceDice(uint64_t seed) : random_(seed * 6151 + 5) {}
  uint32_t Below(size_t n) { return static_cast<uint32_t>(random_() % n); }
  double Unit() { return static_cast<double>(random_() >> 11) * 0x1p-53; }

 private:
  std::mt19937_64 random_;
};

// Quadrilaterals over a lattice of which one or both ways may close.
std::vector<Face> Lattice(uint32_t nx, uint32_t ny, bool around_x, bool around_y) {
  std::vector<Face> faces;
  const uint32_t columns = around_x ? nx : nx + 1, rows = around_y ? ny : ny + 1;
  const auto at = [&](uint32_t i, uint32_t j) { return i % columns + columns * (j % rows); };
  for (uint32_t j = 0; j < ny; ++j) {
    for (uint32_t i = 0; i < nx; ++i)
      faces.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)});
  }
  return faces;
}

std::vector<Face> Box() {
  return {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
}

void CutSome(SurfaceDice& dice, std::vector<Face>* faces) {
  for (size_t f = 0, n = faces->size(); f < n; ++f) {
    if (dice.Below(3) != 0) continue;
    const Face q = (*faces)[f];
    const uint32_t k = dice.Below(4);
    (*faces)[f] = {q[k], q[(k + 1) % 4], q[(k + 2) % 4]};
    faces->push_back({q[k], q[(k + 2) % 4], q[(k + 3) % 4]});
  }
}

// Joins two faces along one edge, if no point would come twice.
void JoinSome(SurfaceDice& dice, std::vector<Face>* faces) {
  for (uint32_t k = dice.Below(faces->size() + 1); k > 0; --k) {
    const size_t a = dice.Below(faces->size()), b = dice.Below(faces->size());
    if (a == b) continue;
    Face& one = (*faces)[a];
    Face other = (*faces)[b];
    std::rotate(one.begin(), one.begin() + dice.Below(one.size()), one.end());
    // One ends where it began: its last side runs from back to front.
    const auto at = std::find(other.begin(), other.end(), one.front());
    if (at == other.end()) continue;
    std::rotate(other.begin(), at, other.end());
    if (other[1] != one.back()) continue;
    Face joined = one;
    joined.insert(joined.end(), other.begin() + 2, other.end());
    if (std::set<uint32_t>(joined.begin(), joined.end()).size() != joined.size()) continue;
    one = joined;
    faces->erase(faces->begin() + static_cast<std::ptrdiff_t>(b));
  }
}

void TakeSomeOut(SurfaceDice& dice, std::vector<Face>* faces) {
  for (uint32_t k = dice.Below(faces->size()) / 2; k > 0; --k) {
    faces->erase(faces->begin() + dice.Below(faces->size()));
  }
}

// Only points that a face has, in the order in which they come.
void Fill(SurfaceDice& dice, std::vector<Face> faces, PolygonMesh* mesh) {
  for (size_t i = faces.size(); i > 1; --i) std::swap(faces[i - 1], faces[dice.Below(i)]);
  std::map<uint32_t, uint32_t> number;
  for (Face& face : faces) {
    std::rotate(face.begin(), face.begin() + dice.Below(face.size()), face.end());
    for (uint32_t& point : face) {
      const auto [it, added] = number.try_emplace(point, static_cast<uint32_t>(mesh->points.size()));
      if (added) mesh->points.push_back({dice.Unit(), dice.Unit(), dice.Unit()});
      point = it->second;
    }
    mesh->AddFace(face);
  }
}

void Cut(SurfaceDice& dice, SurfaceCase* c) {
  const auto faces = static_cast<uint32_t>(c->mesh.faces());
  c->blocks = 1 + dice.Below(std::min(SurfaceCase::kMaxBlocks, faces));
  for (uint32_t f = 0; f < faces; ++f) c->block_of.push_back(dice.Below(c->blocks));
  const uint32_t first = dice.Below(faces);
  for (uint32_t b = 0; b < c->blocks; ++b) c->block_of[(first + b) % faces] = b;
}

}  // namespace

std::string SurfaceCase::Describe() const {
  return absl::StrCat("seed ", seed, ": ", shape, ", ", mesh.faces(), " faces with ", mesh.corners.size(),
                      " corners, ", mesh.points.size(), " points, ", blocks, " blocks, ", removed.size(),
                      " removed");
}

SurfaceCase MakeSurfaceCase(uint64_t seed) {
  SurfaceCase c;
  c.seed = seed;
  SurfaceDice dice(seed);
  const uint32_t nx = 3 + dice.Below(6), ny = 3 + dice.Below(6);
  std::vector<Face> faces;
  switch (seed % 4) {
    case 0:
      c.shape = absl::StrCat("torus ", nx, "x", ny);
      faces = Lattice(nx, ny, true, true);
      break;
    case 1:
      c.shape = absl::StrCat("tube ", nx, "x", ny);
      faces = Lattice(nx, ny, true, false);
      break;
    case 2:
      c.shape = absl::StrCat("sheet ", nx, "x", ny);
      faces = Lattice(nx, ny, false, false);
      break;
    default:
      c.shape = "box";
      faces = Box();
  }
  if (dice.Below(4) != 0) CutSome(dice, &faces);
  if (dice.Below(4) != 0) JoinSome(dice, &faces);
  // Half of what is closed stays so.
  if (dice.Below(2) == 0) TakeSomeOut(dice, &faces);
  Fill(dice, std::move(faces), &c.mesh);
  Cut(dice, &c);
  if (dice.Below(2) == 0) {
    const double share = dice.Unit() / 2;
    for (uint64_t f = 0; f < c.mesh.faces(); ++f) {
      if (dice.Unit() < share) c.removed.push_back(CellId::Polygon(f));
    }
  }
  return c;
}

std::unique_ptr<SurfaceLcc> MakeSurfaceMap(const PolygonMesh& mesh) {
  auto map = std::make_unique<SurfaceLcc>();
  std::map<std::pair<uint32_t, uint32_t>, SurfaceLcc::Dart_handle> sides;
  for (uint64_t f = 0; f < mesh.faces(); ++f) {
    const auto corners = mesh.Corners(f);
    auto d = map->make_combinatorial_polygon(static_cast<unsigned>(corners.size()));
    map->set_attribute<2>(d, map->create_attribute<2>(CellId::Polygon(f)));
    for (size_t i = 0; i < corners.size(); ++i) {
      const Point3& p = mesh.points[corners[i]];
      map->set_vertex_attribute(d, map->create_vertex_attribute(SurfaceLcc::Point(p[0], p[1], p[2])));
      sides[{corners[i], corners[(i + 1) % corners.size()]}] = d;
      d = map->beta(d, 1);
    }
  }
  for (const auto& [ends, d] : sides) {
    const auto beyond = sides.find({ends.second, ends.first});
    if (beyond != sides.end() && map->is_free<2>(d)) map->sew<2>(d, beyond->second);
  }
  return map;
}

void RemoveFace(SurfaceLcc& map, const CellId& face) {
  for (auto it = map.darts().begin(); it != map.darts().end(); ++it) {
    if (map.info<2>(it) != face) continue;
    map.remove_cell<2>(it);
    return;
  }
}

}  // namespace ndmap::reference

// SPDX-License-Identifier: GPL-3.0-or-later
#include <numeric>
#include <utility>

#include "absl/container/flat_hash_map.h"
#include "absl/strings/str_cat.h"
#include "core/mesh/mesh_check.h"

namespace ndmap::internal {
namespace {

std::vector<bool> Used(const VolumeMesh& mesh) {
  std::vector<bool> used(mesh.points.size(), false);
  for (uint32_t corner : mesh.corners) used[corner] = true;
  return used;
}

// Of each used point the first with the same coordinates.
struct Equals {
  std::vector<uint32_t> first;
  uint64_t repeated = 0;
  std::pair<uint32_t, uint32_t> example;
};

Equals FindEquals(const VolumeMesh& mesh, const std::vector<bool>& used) {
  Equals equals;
  equals.first.resize(mesh.points.size());
  std::iota(equals.first.begin(), equals.first.end(), 0);
  absl::flat_hash_map<Point3, uint32_t> seen;
  seen.reserve(mesh.points.size());
  for (uint32_t p = 0; p < mesh.points.size(); ++p) {
    if (!used[p]) continue;
    Point3 place = mesh.points[p];
    for (double& x : place) x += 0.0;  // -0 is 0.
    const auto [it, added] = seen.try_emplace(place, p);
    if (added) continue;
    equals.first[p] = it->second;
    if (equals.repeated++ == 0) equals.example = {it->second, p};
  }
  return equals;
}

void DropUnused(VolumeMesh* mesh) {
  const std::vector<bool> used = Used(*mesh);
  auto& numbers = mesh->source.points;
  if (numbers.empty()) {
    numbers.resize(mesh->points.size());
    std::iota(numbers.begin(), numbers.end(), mesh->source.first_point);
  }
  std::vector<uint32_t> place(mesh->points.size());
  uint32_t next = 0;
  for (uint32_t p = 0; p < mesh->points.size(); ++p) {
    if (!used[p]) continue;
    mesh->points[next] = mesh->points[p];
    numbers[next] = numbers[p];
    place[p] = next++;
  }
  mesh->points.resize(next);
  numbers.resize(next);
  for (uint32_t& corner : mesh->corners) corner = place[corner];
}

}  // namespace

void TidyPoints(const GlueOptions& options, GluedMesh* glued) {
  VolumeMesh& mesh = glued->mesh;
  const std::vector<bool> used = Used(mesh);
  uint64_t unused = 0;
  for (bool u : used) unused += !u;
  if (unused > 0)
    glued->notes.push_back(absl::StrCat("left out ", Count(unused, "point", "points"), " that no cell uses"));

  const Equals equals = FindEquals(mesh, used);
  if (equals.repeated > 0) {
    const std::string many = Count(equals.repeated, "point", "points");
    if (options.merge_equal_points) {
      for (uint32_t& corner : mesh.corners) corner = equals.first[corner];
      glued->notes.push_back(absl::StrCat("merged ", many, " with another of equal coordinates"));
    } else {
      glued->warnings.push_back(
          absl::StrCat(many, equals.repeated == 1 ? " lies" : " lie", " where another does, as ",
                       PointName(mesh, equals.example.second), " and ", PointName(mesh, equals.example.first),
                       HowCounted(mesh), ": cells are not glued across them unless equal points are merged"));
    }
  }
  if (unused > 0 || (equals.repeated > 0 && options.merge_equal_points)) DropUnused(&mesh);
}

}  // namespace ndmap::internal

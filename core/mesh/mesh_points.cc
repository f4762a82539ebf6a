// SPDX-License-Identifier: GPL-3.0-or-later
#include <numeric>
#include <utility>

#include "absl/container/flat_hash_map.h"
#include "absl/strings/str_cat.h"
#include "core/mesh/mesh_check.h"

namespace ndmap::internal {
namespace {

std::vector<bool> Used(const PointTable& table) {
  std::vector<bool> used(table.points->size(), false);
  for (uint32_t corner : *table.corners) used[corner] = true;
  return used;
}

// Of each used point the first with the same coordinates.
struct Equals {
  std::vector<uint32_t> first;
  uint64_t repeated = 0;
  std::pair<uint32_t, uint32_t> example;
};

Equals FindEquals(const std::vector<Point3>& points, const std::vector<bool>& used) {
  Equals equals;
  equals.first.resize(points.size());
  std::iota(equals.first.begin(), equals.first.end(), 0);
  absl::flat_hash_map<Point3, uint32_t> seen;
  seen.reserve(points.size());
  for (uint32_t p = 0; p < points.size(); ++p) {
    if (!used[p]) continue;
    Point3 place = points[p];
    for (double& x : place) x += 0.0;  // -0 is 0.
    const auto [it, added] = seen.try_emplace(place, p);
    if (added) continue;
    equals.first[p] = it->second;
    if (equals.repeated++ == 0) equals.example = {it->second, p};
  }
  return equals;
}

void DropUnused(const PointTable& table) {
  const std::vector<bool> used = Used(table);
  std::vector<Point3>& points = *table.points;
  auto& numbers = table.source->points;
  if (numbers.empty()) {
    numbers.resize(points.size());
    std::iota(numbers.begin(), numbers.end(), table.source->first_point);
  }
  std::vector<uint32_t> place(points.size());
  uint32_t next = 0;
  for (uint32_t p = 0; p < points.size(); ++p) {
    if (!used[p]) continue;
    points[next] = points[p];
    numbers[next] = numbers[p];
    place[p] = next++;
  }
  points.resize(next);
  numbers.resize(next);
  for (uint32_t& corner : *table.corners) corner = place[corner];
}

}  // namespace

void TidyPoints(const PointTable& table, bool merge_equal, std::vector<std::string>* notes,
                std::vector<std::string>* warnings) {
  const std::vector<bool> used = Used(table);
  uint64_t unused = 0;
  for (bool u : used) unused += !u;
  if (unused > 0) {
    notes->push_back(
        absl::StrCat("left out ", Count(unused, "point", "points"), " that no ", table.of, " uses"));
  }
  const Equals equals = FindEquals(*table.points, used);
  if (equals.repeated > 0) {
    const std::string many = Count(equals.repeated, "point", "points");
    if (merge_equal) {
      for (uint32_t& corner : *table.corners) corner = equals.first[corner];
      notes->push_back(absl::StrCat("merged ", many, " with another of equal coordinates"));
    } else {
      const MeshSource& source = *table.source;
      warnings->push_back(absl::StrCat(
          many, equals.repeated == 1 ? " lies" : " lie", " where another does, as point ",
          source.Point(equals.example.second), " and point ", source.Point(equals.example.first),
          HowCounted(source), ": ", table.of, "s are not glued across them unless equal points are merged"));
    }
  }
  if (unused > 0 || (equals.repeated > 0 && merge_equal)) DropUnused(table);
}

}  // namespace ndmap::internal

// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/io/surface_soup.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <utility>

#include "absl/container/flat_hash_map.h"
#include "absl/strings/str_cat.h"
#include "core/geometry/parity.h"
#include "core/io/crowded_edge.h"
#include "core/io/text_scanner.h"

namespace ndmap::internal {
namespace {

absl::Status CheckSoup(const PolygonSoup& soup) {
  if (soup.points.size() > 0xfffffffe) return Invalid("has more points than 32 bits can count");
  for (size_t p = 0; p < soup.points.size(); ++p) {
    for (double x : soup.points[p]) {
      if (!std::isfinite(x))
        return Invalid(absl::StrCat("point ", p, " has a coordinate that is not finite"));
    }
  }
  if (soup.polygons.empty()) return Invalid("has no faces");
  for (size_t f = 0; f < soup.polygons.size(); ++f) {
    for (uint32_t corner : soup.polygons[f]) {
      if (corner < soup.points.size()) continue;
      return Invalid(absl::StrCat("face ", f, " has index ", corner, " out of range; there are ",
                                  soup.points.size(), " points, counted from 0"));
    }
  }
  return absl::OkStatus();
}

// The first of each set of equal points stands for all, as `stands_for` tells; how many are no longer used
// for that.
size_t MergePoints(PolygonSoup* soup, std::vector<uint32_t>& stands_for, std::vector<std::string>* notes) {
  absl::flat_hash_map<Point3, uint32_t> first;
  first.reserve(soup->points.size());
  stands_for.resize(soup->points.size());
  size_t merged = 0;
  for (uint32_t p = 0; p < soup->points.size(); ++p) {
    for (double& x : soup->points[p]) x += 0.0;  // -0 is 0.
    const auto [it, added] = first.try_emplace(soup->points[p], p);
    stands_for[p] = it->second;
    merged += !added;
  }
  if (merged == 0) return 0;
  for (auto& polygon : soup->polygons) {
    for (uint32_t& corner : polygon) corner = stands_for[corner];
  }
  notes->push_back(absl::StrCat("merged ", merged, " duplicate points"));
  return merged;
}

// Takes out corners that repeat the one before, and faces of which fewer than three remain.
absl::Status DropDegenerate(PolygonSoup* soup, std::vector<std::string>* notes) {
  size_t kept = 0;
  for (size_t f = 0; f < soup->polygons.size(); ++f) {
    std::vector<uint32_t> polygon = std::move(soup->polygons[f]);
    polygon.erase(std::unique(polygon.begin(), polygon.end()), polygon.end());
    while (polygon.size() > 1 && polygon.front() == polygon.back()) polygon.pop_back();
    if (polygon.size() < 3) continue;
    std::vector<uint32_t> sorted = polygon;
    std::sort(sorted.begin(), sorted.end());
    const auto twice = std::adjacent_find(sorted.begin(), sorted.end());
    if (twice != sorted.end()) return Invalid(absl::StrCat("face ", f, " comes to point ", *twice, " twice"));
    soup->polygons[kept++] = std::move(polygon);
  }
  const size_t dropped = soup->polygons.size() - kept;
  soup->polygons.resize(kept);
  if (dropped > 0) notes->push_back(absl::StrCat("dropped ", dropped, " degenerate faces"));
  if (kept == 0) return Invalid("has no faces that are not degenerate");
  return absl::OkStatus();
}

// `merged` of them have been told of already.
void DropUnusedPoints(size_t merged, TriangleSurface* s, std::vector<std::string>* notes) {
  constexpr uint32_t kUnused = 0xffffffff;
  std::vector<uint32_t> number(s->points.size(), kUnused);
  for (const auto& t : s->triangles) {
    for (uint32_t corner : t) number[corner] = 0;
  }
  uint32_t next = 0;
  for (uint32_t p = 0; p < number.size(); ++p) {
    if (number[p] == kUnused) continue;
    s->points[next] = s->points[p];
    number[p] = next++;
  }
  if (next == s->points.size()) return;
  const size_t dropped = s->points.size() - next;
  if (dropped > merged) notes->push_back(absl::StrCat("dropped ", dropped - merged, " points without faces"));
  s->points.resize(next);
  for (auto& t : s->triangles) {
    for (uint32_t& corner : t) corner = number[corner];
  }
}

struct HalfEdge {
  uint64_t ends;  // The smaller point number in the upper half.
  uint32_t triangle;
  uint8_t corner;
};

uint32_t Root(std::vector<uint32_t>* parent, uint32_t i) {
  while ((*parent)[i] != i) i = (*parent)[i] = (*parent)[(*parent)[i]];
  return i;
}

// Why a surface is not closed: from its half-edges, sorted by ends.
absl::Status NotClosed(const std::vector<HalfEdge>& sorted, size_t points) {
  size_t single = 0, several = 0;
  uint64_t example = 0;
  std::vector<uint32_t> parent(points);
  std::iota(parent.begin(), parent.end(), 0);
  std::vector<char> on_border(points, 0);
  for (size_t i = 0, end; i < sorted.size(); i = end) {
    for (end = i; end < sorted.size() && sorted[end].ends == sorted[i].ends;) ++end;
    if (end - i == 2) continue;
    if (single + several == 0) example = sorted[i].ends;
    ++(end - i == 1 ? single : several);
    if (end - i != 1) continue;
    const uint32_t a = sorted[i].ends >> 32, b = sorted[i].ends & 0xffffffff;
    on_border[a] = on_border[b] = 1;
    parent[Root(&parent, a)] = Root(&parent, b);
  }
  size_t cycles = 0;
  for (uint32_t p = 0; p < points; ++p) cycles += on_border[p] && Root(&parent, p) == p;
  if (single == 0) {
    return Invalid(absl::StrCat("not a surface: ", several, several == 1 ? " edge has" : " edges have",
                                " more than two faces"));
  }
  std::string what = absl::StrCat("not closed: ", single + several, " edges without exactly two faces (",
                                  single, " with one, in ", cycles, " border cycle", cycles == 1 ? "" : "s");
  if (several > 0) absl::StrAppend(&what, "; ", several, " with more than two");
  return Invalid(
      absl::StrCat(what, "), for example between points ", example >> 32, " and ", example & 0xffffffff));
}

bool RunsAlike(const std::array<uint32_t, 3>& t, int corner, const std::array<uint32_t, 3>& other) {
  for (int c = 0; c < 3; ++c) {
    if (other[c] == t[corner]) return other[(c + 1) % 3] == t[(corner + 1) % 3];
  }
  return false;
}

// Six times the signed volume that each component encloses, about the first point to lose fewer digits.
std::vector<double> SignedVolumes(const TriangleSurface& s, const std::vector<uint32_t>& component,
                                  uint32_t count) {
  std::vector<double> volume(count, 0.0);
  const Point3& o = s.points[s.triangles[0][0]];
  for (size_t t = 0; t < s.triangles.size(); ++t) {
    Point3 v[3];
    for (int k = 0; k < 3; ++k) {
      for (int x = 0; x < 3; ++x) v[k][x] = s.points[s.triangles[t][k]][x] - o[x];
    }
    volume[component[t]] += v[0][0] * (v[1][1] * v[2][2] - v[1][2] * v[2][1]) -
                            v[0][1] * (v[1][0] * v[2][2] - v[1][2] * v[2][0]) +
                            v[0][2] * (v[1][0] * v[2][1] - v[1][1] * v[2][0]);
  }
  return volume;
}

// Turns whole components so that normals point out of the volume that parity encloses: a component that lies
// within an odd number of others has that volume outside of it.
void OrientOutward(const std::vector<uint32_t>& component, uint32_t count, TriangleSurface* s) {
  const std::vector<double> volume = SignedVolumes(*s, component, count);
  std::vector<char> turn(count, 0), asked(count, 0);
  const ParityIndex index(std::make_shared<TriangleSurface>(*s));
  for (size_t t = 0; t < s->triangles.size(); ++t) {
    const uint32_t own = component[t];
    if (asked[own]) continue;
    asked[own] = 1;
    const bool nested = count > 1 && index.Inside(s->points[s->triangles[t][0]],
                                                  [&](uint32_t other) { return component[other] != own; });
    turn[own] = nested ? volume[own] > 0 : volume[own] < 0;
  }
  for (size_t t = 0; t < s->triangles.size(); ++t) {
    if (turn[component[t]]) std::swap(s->triangles[t][1], s->triangles[t][2]);
  }
}

}  // namespace

absl::StatusOr<std::vector<uint32_t>> Neighbours(const TriangleSurface& s) {
  std::vector<HalfEdge> edges;
  edges.reserve(3 * s.triangles.size());
  for (uint32_t t = 0; t < s.triangles.size(); ++t) {
    for (uint8_t c = 0; c < 3; ++c) {
      const uint64_t a = s.triangles[t][c], b = s.triangles[t][(c + 1) % 3];
      edges.push_back({std::min(a, b) << 32 | std::max(a, b), t, c});
    }
  }
  std::sort(edges.begin(), edges.end(), [](const HalfEdge& a, const HalfEdge& b) { return a.ends < b.ends; });
  std::vector<uint32_t> neighbours(edges.size());
  for (size_t i = 0; i < edges.size(); i += 2) {
    if (i + 1 >= edges.size() || edges[i].ends != edges[i + 1].ends ||
        (i + 2 < edges.size() && edges[i + 2].ends == edges[i].ends)) {
      return NotClosed(edges, s.points.size());
    }
    neighbours[3 * size_t{edges[i].triangle} + edges[i].corner] = edges[i + 1].triangle;
    neighbours[3 * size_t{edges[i + 1].triangle} + edges[i + 1].corner] = edges[i].triangle;
  }
  return neighbours;
}

std::vector<uint32_t> Components(const std::vector<uint32_t>& neighbours, uint32_t* count) {
  constexpr uint32_t kNone = 0xffffffff;
  std::vector<uint32_t> component(neighbours.size() / 3, kNone), queue;
  *count = 0;
  for (uint32_t seed = 0; seed < component.size(); ++seed) {
    if (component[seed] != kNone) continue;
    component[seed] = *count;
    queue.assign(1, seed);
    for (size_t i = 0; i < queue.size(); ++i) {
      for (int c = 0; c < 3; ++c) {
        const uint32_t next = neighbours[3 * size_t{queue[i]} + c];
        if (component[next] != kNone) continue;
        component[next] = *count;
        queue.push_back(next);
      }
    }
    ++*count;
  }
  return component;
}

absl::StatusOr<size_t> Orient(const std::vector<uint32_t>& neighbours, TriangleSurface* s) {
  const std::vector<std::array<uint32_t, 3>> given = s->triangles;
  std::vector<char> turned(given.size(), 2);  // 2: not reached yet.
  std::vector<uint32_t> queue;
  for (uint32_t seed = 0; seed < given.size(); ++seed) {
    if (turned[seed] != 2) continue;
    turned[seed] = 0;
    queue.assign(1, seed);
    for (size_t i = 0; i < queue.size(); ++i) {
      const uint32_t t = queue[i];
      for (int c = 0; c < 3; ++c) {
        const uint32_t next = neighbours[3 * size_t{t} + c];
        const char turn = turned[t] ^ (RunsAlike(given[t], c, given[next]) ? 1 : 0);
        if (turned[next] == 2) {
          turned[next] = turn;
          queue.push_back(next);
        } else if (turned[next] != turn) {
          return Invalid(
              absl::StrCat("not orientable: its faces cannot be turned alike, for example along the edge "
                           "between points ",
                           given[t][c], " and ", given[t][(c + 1) % 3]));
        }
      }
    }
  }
  for (size_t t = 0; t < given.size(); ++t) {
    if (turned[t] == 1) std::swap(s->triangles[t][1], s->triangles[t][2]);
  }
  uint32_t count = 0;
  const std::vector<uint32_t> component = Components(neighbours, &count);
  OrientOutward(component, count, s);
  size_t changed = 0;
  for (size_t t = 0; t < given.size(); ++t) changed += given[t] != s->triangles[t];
  return changed;
}

absl::StatusOr<SurfaceFile> SurfaceFromSoup(PolygonSoup soup, const ReadLimits& limits) {
  SurfaceFile file;
  if (absl::Status s = CheckSoup(soup); !s.ok()) return s;
  const GivenFaces given(soup.polygons);
  std::vector<uint32_t> stands_for;
  const size_t merged = MergePoints(&soup, stands_for, &file.notes);
  if (absl::Status s = DropDegenerate(&soup, &file.notes); !s.ok()) return s;
  size_t cut = 0;
  auto triangles = Triangulate(soup, &cut);
  if (!triangles.ok()) return triangles.status();
  if (cut > 0) file.notes.push_back(absl::StrCat("cut ", cut, " polygons into triangles"));
  if (triangles->size() > 0xfffffffe / 3) return Invalid("has more triangles than 32 bits can count");
  file.surface.points = std::move(soup.points);
  file.surface.triangles = *std::move(triangles);
  // Before unused points go: the error names points as the file numbers them.
  const auto neighbours = Neighbours(file.surface);
  if (!neighbours.ok()) {
    const std::string crowded = given.Explain(stands_for, merged);
    return Invalid(absl::StrCat(neighbours.status().message(), crowded.empty() ? "" : "; ", crowded));
  }
  const auto turned = Orient(*neighbours, &file.surface);
  if (!turned.ok()) return turned.status();
  if (*turned > 0) file.notes.push_back(absl::StrCat("turned ", *turned, " faces to agree on the outside"));
  DropUnusedPoints(merged, &file.surface, &file.notes);
  if (limits.check_self_intersections) {
    constexpr size_t kMost = 10000;
    const size_t pairs = CountSelfIntersections(file.surface, kMost);
    if (pairs > 0) {
      file.warnings.push_back(absl::StrCat("intersects itself: ", pairs, pairs < kMost ? "" : " or more",
                                           " pairs of triangles; parity decides what is inside"));
    }
  }
  return file;
}

}  // namespace ndmap::internal

// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/io/crowded_edge.h"

#include <algorithm>
#include <utility>

#include "absl/container/flat_hash_map.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"

namespace ndmap::internal {
namespace {

constexpr size_t kMostNamed = 8;

// An edge of a face: the points that its ends count as, the smaller first, and those that the file gives.
struct GivenEdge {
  std::pair<uint32_t, uint32_t> ends;
  std::pair<uint32_t, uint32_t> given;
  size_t face;
};

std::string Names(const std::vector<size_t>& faces) {
  const std::vector<size_t> named(faces.begin(), faces.begin() + std::min(faces.size(), kMostNamed));
  if (named.size() < faces.size())
    return absl::StrCat(absl::StrJoin(named, ", "), " and ", faces.size() - named.size(), " more");
  return absl::StrCat(absl::StrJoin(named.begin(), named.end() - 1, ", "), " and ", named.back());
}

std::string Merged(const std::vector<GivenEdge>& edges, size_t merged) {
  for (const GivenEdge& edge : edges) {
    for (const auto& [is, was] :
         {std::pair(edge.ends.first, edge.given.first), std::pair(edge.ends.second, edge.given.second)}) {
      if (is == was) continue;
      return absl::StrCat("; it has them because equal points were merged, ", merged, " in all, here point ",
                          was, " with point ", is, ": parts may touch in a point, not along an edge");
    }
  }
  return "";
}

}  // namespace

GivenFaces::GivenFaces(const std::vector<std::vector<uint32_t>>& polygons) {
  for (const std::vector<uint32_t>& polygon : polygons) {
    corners_.insert(corners_.end(), polygon.begin(), polygon.end());
    ends_.push_back(corners_.size());
  }
}

std::string GivenFaces::Explain(const std::vector<uint32_t>& stands_for, size_t merged) const {
  std::vector<GivenEdge> edges;
  std::vector<uint32_t> polygon;
  for (size_t f = 0; f < ends_.size(); ++f) {
    // As corners that repeat the one before are dropped, and faces of fewer than three.
    polygon.clear();
    for (size_t i = f == 0 ? 0 : ends_[f - 1]; i < ends_[f]; ++i) {
      if (polygon.empty() || stands_for[corners_[i]] != stands_for[polygon.back()])
        polygon.push_back(corners_[i]);
    }
    while (polygon.size() > 1 && stands_for[polygon.front()] == stands_for[polygon.back()])
      polygon.pop_back();
    if (polygon.size() < 3) continue;
    for (size_t i = 0; i < polygon.size(); ++i) {
      std::pair<uint32_t, uint32_t> given(polygon[i], polygon[(i + 1) % polygon.size()]);
      std::pair<uint32_t, uint32_t> ends(stands_for[given.first], stands_for[given.second]);
      if (ends.first > ends.second) {
        std::swap(ends.first, ends.second);
        std::swap(given.first, given.second);
      }
      edges.push_back({ends, given, f});
    }
  }
  std::sort(edges.begin(), edges.end(), [](const GivenEdge& a, const GivenEdge& b) {
    return std::pair(a.ends, a.face) < std::pair(b.ends, b.face);
  });
  for (size_t i = 0, end; i < edges.size(); i = end) {
    for (end = i; end < edges.size() && edges[end].ends == edges[i].ends;) ++end;
    if (end - i <= 2) continue;
    const std::vector<GivenEdge> crowded(edges.begin() + static_cast<std::ptrdiff_t>(i),
                                         edges.begin() + static_cast<std::ptrdiff_t>(end));
    std::vector<size_t> faces;
    // By the points of the file: how many faces have each of the edges that became this one.
    absl::flat_hash_map<std::pair<uint32_t, uint32_t>, size_t> apart;
    for (const GivenEdge& edge : crowded) {
      faces.push_back(edge.face);
      ++apart[edge.given];
    }
    size_t most = 0;
    for (const auto& [given, count] : apart) most = std::max(most, count);
    return absl::StrCat("the edge between points ", edges[i].ends.first, " and ", edges[i].ends.second,
                        " has faces ", Names(faces), most <= 2 ? Merged(crowded, merged) : "");
  }
  return "";
}

}  // namespace ndmap::internal

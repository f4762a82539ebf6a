// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/geometry/surface.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"

namespace ndmap {

Box3 BoundingBox(const TriangleSurface& surface) {
  Box3 box;
  for (size_t i = 0; i < surface.points.size(); ++i) {
    for (int c = 0; c < 3; ++c) {
      const double x = surface.points[i][c];
      box.lo[c] = i == 0 ? x : std::min(box.lo[c], x);
      box.hi[c] = i == 0 ? x : std::max(box.hi[c], x);
    }
  }
  return box;
}

absl::Status ValidateClosedSurface(const TriangleSurface& surface) {
  if (surface.triangles.empty()) return absl::InvalidArgumentError("surface has no triangles");
  for (size_t i = 0; i < surface.points.size(); ++i) {
    for (double x : surface.points[i]) {
      if (!std::isfinite(x)) {
        return absl::InvalidArgumentError(
            absl::StrCat("surface point ", i, " has a coordinate that is not finite"));
      }
    }
  }
  // Each directed edge once, and each with its opposite: sorted as (low, high, direction).
  std::vector<std::pair<uint64_t, bool>> edges;
  edges.reserve(3 * surface.triangles.size());
  for (size_t t = 0; t < surface.triangles.size(); ++t) {
    for (int c = 0; c < 3; ++c) {
      const uint64_t a = surface.triangles[t][c];
      const uint64_t b = surface.triangles[t][(c + 1) % 3];
      if (a >= surface.points.size()) {
        return absl::InvalidArgumentError(
            absl::StrCat("surface triangle ", t, " names point ", a, " of ", surface.points.size()));
      }
      if (a == b)
        return absl::InvalidArgumentError(absl::StrCat("surface triangle ", t, " repeats point ", a));
      edges.emplace_back(std::min(a, b) << 32 | std::max(a, b), a < b);
    }
  }
  std::sort(edges.begin(), edges.end());
  for (size_t i = 0; i < edges.size(); i += 2) {
    const bool paired = i + 1 < edges.size() && edges[i].first == edges[i + 1].first &&
                        edges[i].second != edges[i + 1].second &&
                        (i + 2 >= edges.size() || edges[i + 2].first != edges[i].first);
    if (!paired) {
      return absl::InvalidArgumentError(absl::StrCat("surface edge between points ", edges[i].first >> 32,
                                                     " and ", edges[i].first & 0xffffffff,
                                                     " does not have exactly two opposite triangles"));
    }
  }
  return absl::OkStatus();
}

}  // namespace ndmap

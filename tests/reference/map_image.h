// SPDX-License-Identifier: GPL-3.0-or-later
// A linear cell complex of dimension 2 or 3 copied into plain arrays, whatever its storage, and the
// comparison of two such copies. Use compare.h.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"

namespace ndmap::reference {

struct MapImage {
  static constexpr uint32_t kFree = 0xffffffff;
  // Row d of each belongs to dart d.
  std::vector<std::array<uint32_t, 3>>
      beta;                      // β1, β2, β3; kFree where free (in a map of dimension 2, all β3)
  std::vector<uint32_t> vertex;  // the vertex attribute at its origin
  std::vector<std::array<uint64_t, 2>> name;  // of its n-cell; empty when names are not compared
  // Row v belongs to vertex attribute v.
  std::vector<std::array<uint64_t, 3>> point;  // the exact bits of its coordinates

  size_t darts() const { return beta.size(); }
};

// OK when a bijection of the darts keeps β1, β2, β3 and their absence, the bits of every point, which darts
// share a vertex attribute, and (when both have names) the names of the volumes. Otherwise
// FAILED_PRECONDITION says what differs first, with points. O(darts) plus the size of a connected component
// for each wrong guess among darts that cannot be told apart within a few steps.
absl::Status CompareImages(const MapImage& a, const MapImage& b);

}  // namespace ndmap::reference

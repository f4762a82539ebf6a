// SPDX-License-Identifier: GPL-3.0-or-later
// What a user is told of an edge that more than two faces have.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace ndmap::internal {

// The faces as the file has them, before anything is merged or dropped: a copy that costs 4 bytes a corner
// and 8 bytes a face.
class GivenFaces {
 public:
  explicit GivenFaces(const std::vector<std::vector<uint32_t>>& polygons);

  // The first edge, by its points, that more than two faces have when `stands_for` tells by point which one
  // of its equals it counts as: "the edge between points 0 and 1 has faces 0, 2 and 6", and that this is
  // because `merged` points were, if it is. Empty when there is none. O(corners log corners).
  std::string Explain(const std::vector<uint32_t>& stands_for, size_t merged) const;

 private:
  std::vector<uint32_t> corners_;
  // Where each face's corners end.
  std::vector<size_t> ends_;
};

}  // namespace ndmap::internal

// SPDX-License-Identifier: GPL-3.0-or-later
// Which hexahedra to refine: the question that refinement asks once of every hexahedron above the depth.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <optional>

#include "absl/functional/function_ref.h"
#include "absl/status/statusor.h"
#include "core/algorithm/block_algorithm.h"
#include "core/algorithm/parameters.h"
#include "core/geometry/surface.h"
#include "core/map/ids.h"

namespace ndmap {

class RefineOracle {
 public:
  virtual ~RefineOracle() = default;
  // Corners by corner number. The answer depends on the arguments alone, so that every block, on any server,
  // in any order, answers alike.
  virtual bool Refine(const CellId& id, const std::array<Point3, 8>& corners) = 0;
  // Whether a "no" means that the hexahedron does not meet the surface.
  virtual bool tells_cut() const { return false; }
  // Of an oracle that tells_cut(): the answers for eight hexahedra close together, given by the boxes of
  // their corners.
  virtual std::array<bool, 8> CutEach(const std::array<Box3, 8>&) { return {}; }
  // Whether it was given this cell by its id: then one that cannot be refined is an error.
  virtual bool Lists(const CellId&) const { return false; }
  // How many of the cells that it was given by their ids are wanted; none if it was not given ids.
  virtual std::optional<size_t> CountListed(absl::FunctionRef<bool(const CellId&)> /*wanted*/) const {
    return std::nullopt;
  }
};

// The oracles, by parameter "oracle":
//   surface     the closed axis-aligned box of the corners meets the surface (default); exact
//   everything  every hexahedron
//   box         the box of the corners meets the closed box "lo" ... "hi" ("x,y,z" each)
//   sphere      the box of the corners meets the ball with "centre" ("x,y,z") and "radius"
//   size        the longest edge is longer than "size"
//   list        the ids in "cells", in text form ("h12/0.3.7"), separated by spaces
// INVALID_ARGUMENT names what is wrong. `region` tells the bounds of the block's hexahedra:
// only triangles near them are indexed.
absl::StatusOr<std::unique_ptr<RefineOracle>> MakeOracle(const Parameters& parameters,
                                                         const Environment& environment,
                                                         absl::FunctionRef<Box3()> region);

// "x,y,z" as three finite numbers.
absl::StatusOr<Point3> ParsePoint(absl::string_view text);
std::string FormatPoint(const Point3& p);

}  // namespace ndmap

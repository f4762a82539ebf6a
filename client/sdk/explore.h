// SPDX-License-Identifier: Apache-2.0
// Questions for MapHandle::Explore, made in one line:
//
//   absl::StatusOr<ndmap::v1::ExploreResponse> around =
//       map.Explore(ndmap::AdjacentCells(ndmap::CellAnchor("h12/0.3.7"), 3, 2));
//
// An anchor says where to begin, the question what to ask about that place. The functions check nothing: the
// service refuses what makes no sense, with a sentence. docs/ids.md tells the ids, navigate.proto all the
// rest.
#pragma once

#include <array>
#include <cstdint>

#include "absl/strings/string_view.h"
#include "ndmap/v1/navigate.pb.h"

namespace ndmap {

// The cell with this id, "h12/0.3.7" or "v12:5"; NOT_FOUND if there is none now.
v1::Anchor CellAnchor(absl::string_view id);
v1::Anchor CellAnchor(const v1::CellId& id);
// A dart of a block. With a version (not 0) it is refused once the block has changed.
v1::Anchor DartAnchor(uint32_t block, uint32_t dart, uint64_t version = 0);
v1::Anchor DartAnchor(const v1::DartRef& dart);
// All hexahedra that contain the point, several on a boundary between them.
v1::Anchor PointAnchor(const std::array<double, 3>& point);
// All hexahedra that the closed box meets, lo <= hi.
v1::Anchor BoxAnchor(const std::array<double, 3>& lo, const std::array<double, 3>& hi);
// The vertex nearest to the point.
v1::Anchor NearestVertexAnchor(const std::array<double, 3>& point);
// Every dart of a block.
v1::Anchor BlockAnchor(uint32_t block);

// All of them answer with ids; set_give(v1::GIVE_CELL_DETAILS) makes that details.

// The cells that the anchor is, of this dimension: hexahedra (3) for points and boxes, the cell's own for
// ids.
v1::ExploreRequest CellsAt(const v1::Anchor& anchor, uint32_t dimension);
// The darts of the whole i-cell in which the anchor's dart lies, wherever they are.
v1::ExploreRequest Orbit(const v1::Anchor& anchor, uint32_t i);
// The cells of `dimension` that share a dart with the anchor, a cell of `own_dimension`: the vertices of a
// hexahedron, the hexahedra around an edge.
v1::ExploreRequest IncidentCells(const v1::Anchor& anchor, uint32_t own_dimension, uint32_t dimension);
// The other cells of `dimension` that share a cell of dimension `through` with the anchor, a cell of
// `dimension`.
v1::ExploreRequest AdjacentCells(const v1::Anchor& anchor, uint32_t dimension, uint32_t through);
// Those that are reached in at most k such steps, without the anchor. The service allows k up to kMaxRing.
inline constexpr uint32_t kMaxRing = 32;
v1::ExploreRequest Ring(const v1::Anchor& anchor, uint32_t dimension, uint32_t k, uint32_t through);

}  // namespace ndmap

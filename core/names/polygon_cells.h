// SPDX-License-Identifier: GPL-3.0-or-later
// What a block knows of the surface of polygons that it was made from: what lies beyond the sides of its
// faces, and the ids of their edges and vertices. Made from the block's piece alone; does not change, so any
// number of threads may ask.
//
// Ids (docs/ids.md): a face is the polygon with its number. An edge or a vertex is named by the lowest-
// numbered face that it touches, and its rank there: corner i of the face, or the side that begins at it.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/types/span.h"
#include "core/map/ids.h"
#include "core/mesh/polygon_piece.h"
#include "core/names/initial_cells.h"

namespace ndmap {

class PolygonCells final : public InitialCells {
 public:
  // INVALID_ARGUMENT if the piece is not valid (ValidatePiece), or an edge of the block's faces is run in the
  // same direction by two faces, as it must be where it has more than two. Expected O(piece): about 16 bytes
  // a corner beside the piece, three times that while it is made.
  static absl::StatusOr<std::shared_ptr<const PolygonCells>> Make(PolygonPiece piece, BlockId self,
                                                                  uint32_t block_count);

  BlockId self() const { return self_; }
  const PolygonPiece& piece() const { return piece_; }
  uint64_t own_faces() const { return own_faces_; }
  bool IsOwn(uint32_t face) const { return piece_.IsOwn(face, self_); }
  uint32_t CornerCount(uint32_t face) const { return static_cast<uint32_t>(surface().Corners(face).size()); }
  const Point3& PointAt(uint32_t face, uint32_t corner) const {
    return surface().points[surface().Corners(face)[corner]];
  }
  // Where the face with this number is in the piece; kNoCell if it is not. O(log faces).
  uint32_t FaceOf(uint64_t number) const;
  // What lies beyond a side of one of the block's own faces.
  const SideLink& Beyond(uint32_t face, uint32_t side) const { return links_[surface().begins[face] + side]; }

  // The id of a corner or a side of an own face. O(1).
  CellId VertexName(uint32_t face, uint32_t corner) const;
  CellId EdgeName(uint32_t face, uint32_t side) const;
  // A number that the vertex has alone, whatever the cut: of the corner that names it among all corners of
  // the surface. O(1).
  uint64_t VertexNumber(uint32_t face, uint32_t corner) const;

  // The id under which answers name the vertex or edge that this id names, and the corners or sides of the
  // block's own faces that are it. Nothing known of it here: an id that is not valid.
  struct Place {
    CellId id;
    std::vector<SideLink> at;
  };
  Place Find(const CellId& id) const;

  // Polygons have no lattice.
  LatticeBox ToOwner(const LatticeBox& box) const override { return box; }
  std::vector<LatticeBox> Around(const LatticeBox&) const override { return {}; }
  const PolygonCells* polygons() const override { return this; }

 private:
  PolygonCells(PolygonPiece piece, BlockId self) : piece_(std::move(piece)), self_(self) {}
  const PolygonMesh& surface() const { return piece_.mesh; }
  absl::Status Link();
  void EnterCorners();

  const PolygonPiece piece_;
  const BlockId self_;
  uint64_t own_faces_ = 0;
  // By corner of the piece, of own faces alone.
  std::vector<SideLink> links_;
  // By point: the corner of the lowest face that has it; and the corners of own faces that are at point p,
  // own_at_[first_at_[p]] to own_at_[first_at_[p + 1]].
  std::vector<SideLink> owner_;
  std::vector<uint64_t> first_at_;
  std::vector<SideLink> own_at_;
};

}  // namespace ndmap

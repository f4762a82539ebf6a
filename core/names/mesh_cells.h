// SPDX-License-Identifier: GPL-3.0-or-later
// What a block knows of the mesh that it was made from: which initial cells lie at the vertices, edges and
// faces of its own, and how the frames of those hexahedra lie to each other. Made from the block's piece
// alone; does not change, so any number of threads may ask.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/types/span.h"
#include "core/map/ids.h"
#include "core/mesh/cell_darts.h"
#include "core/mesh/mesh_piece.h"
#include "core/names/initial_cells.h"

namespace ndmap {

// A part of a vertex, edge or face of an initial cell of any kind. Edges run from their first corner (0) to
// their second (kSide); in a face with four corners the first axis runs along its first dart, the second
// from the same corner along its last one, backwards.
struct PartBox {
  // CellDarts::parts().
  uint8_t part = 0;
  std::array<uint32_t, 2> low{}, extent{};

  friend bool operator==(const PartBox&, const PartBox&) = default;
};

class MeshCells final : public InitialCells {
 public:
  // INVALID_ARGUMENT if the piece is not valid (ValidatePiece), a face of the block's cells belongs to three
  // cells, or to two that list it in the same direction. Expected O(piece): about 150 bytes a hexahedron
  // beside the piece, three times that while it is made.
  static absl::StatusOr<std::shared_ptr<const MeshCells>> Make(MeshPiece piece, BlockId self,
                                                               uint32_t block_count);

  BlockId self() const { return self_; }
  const MeshPiece& piece() const { return piece_; }
  uint64_t own_cells() const { return own_cells_; }
  CellKind kind(uint32_t cell) const { return piece_.mesh.kinds[cell]; }
  const CellDarts& Shape(uint32_t cell) const { return DartsOf(kind(cell)); }
  bool IsOwn(uint32_t cell) const { return piece_.IsOwn(cell, self_); }
  // The point at a local corner.
  uint32_t Point(uint32_t cell, unsigned corner) const {
    return piece_.mesh.Corners(cell)[Shape(cell).listed[corner]];
  }
  // Where the cell with this number is in the piece; kNoCell if it is not. O(log cells).
  uint32_t CellOf(uint64_t number) const;

  // The cell beyond a face of one of the block's own cells; kNoCell at the boundary.
  struct Side {
    uint32_t cell = kNoCell;
    uint8_t face = 0;
  };
  Side Beyond(uint32_t cell, unsigned face) const;
  // The dart of the cell beyond that beta 3 of this dart of an own cell is; the face is not boundary.
  unsigned DartBeyond(uint32_t cell, unsigned dart, const Side& beyond) const;

  // Boxes of hexahedra that are not in the piece stay as they are. O(log cells).
  LatticeBox ToOwner(const LatticeBox& box) const override;
  // In the frames of the block's own hexahedra; nothing if the hexahedron is not in the piece.
  std::vector<LatticeBox> Around(const LatticeBox& box) const override;
  const MeshCells* mesh() const override { return this; }

  // The id of a part of an own cell's boundary. O(levels).
  CellId Name(uint32_t cell, const PartBox& box) const;
  // The id under which answers name the vertex, edge or face that this id names, and those of the block's own
  // initial cells that touch it. Nothing known of it here: an id that is not valid.
  struct Place {
    CellId id;
    std::vector<uint32_t> cells;
  };
  Place Find(const CellId& id) const;

 private:
  static constexpr uint32_t kNoPlace = 0xffffffff;
  // A vertex, edge or face of the mesh that one of the block's own cells has.
  struct Shared {
    // The lowest hexahedron that has it, or without one the lowest cell; and which of its parts it is.
    uint32_t owner = kNoCell;
    uint8_t part = 0;
  };
  // Points of a part, by which two cells tell each other how it lies: its first corner, and the next one
  // along each of its axes.
  using Marks = std::array<uint32_t, 3>;
  // Which part of its hexahedron a box is in, with its place in that part; inside: none.
  struct Located {
    bool inside = false;
    PartBox box;
    Marks marks{};
  };

  MeshCells(MeshPiece piece, BlockId self) : piece_(std::move(piece)), self_(self) {}

  void MakePlaces();
  // The parts with `first` <= part < `end` of each cell, which key() names.
  template <class Key>
  void EnterParts(unsigned dimension, Key key);
  absl::Status EnterSides();
  absl::Status CheckSide(uint32_t cell, unsigned face) const;

  uint32_t PlaceOf(uint32_t cell, unsigned part) const { return place_of_[first_part_[cell] + part]; }
  absl::Span<const uint32_t> OwnAt(uint32_t place) const {
    return absl::MakeConstSpan(own_at_).subspan(first_at_[place], first_at_[place + 1] - first_at_[place]);
  }
  Located Locate(uint32_t hexahedron, const LatticeBox& box) const;
  Marks MarksOf(uint32_t cell, unsigned part) const;
  // The box in the frame of a hexahedron that has the part, too.
  LatticeBox InFrame(uint32_t hexahedron, const PartBox& box, const Marks& marks) const;

  const MeshPiece piece_;
  const BlockId self_;
  uint64_t own_cells_ = 0;
  std::vector<uint64_t> first_part_;
  std::vector<uint32_t> place_of_;
  std::vector<Shared> places_;
  std::vector<uint64_t> first_at_;
  std::vector<uint32_t> own_at_;
  // By place, those of faces alone: the cells on its two sides.
  uint32_t first_face_ = 0;
  std::vector<std::array<Side, 2>> sides_;
};

}  // namespace ndmap

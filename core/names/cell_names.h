// SPDX-License-Identifier: GPL-3.0-or-later
// The ids of the vertices, edges and faces of one n-cell of a block, of any kind, for n = 2 and 3.
#pragma once

#include <cstddef>
#include <type_traits>
#include <vector>

#include "core/map/block.h"
#include "core/names/hexahedron_lattice.h"
#include "core/names/mesh_cells.h"
#include "core/names/name_of.h"
#include "core/names/polygon_cells.h"
#include "core/names/polyhedron_lattice.h"

namespace ndmap {

// In a map of dimension 3.
template <class BlockT>
class VolumeNames {
 public:
  using Lcc = typename BlockT::Lcc;
  using Dart = typename BlockT::Dart;
  using Cell = typename BlockT::Types::Cell;
  // Of a dart at a vertex that only hangs on the cell.
  static constexpr unsigned kNoCorner = 255;

  VolumeNames(Lcc& map, const InitialCells& initial)
      : map_(map), initial_(initial), hexahedron_(map), polyhedron_(map) {}

  // Looks at a cell and returns how many darts it has. O(its darts).
  size_t Look(Cell cell) {
    const auto& info = map_.template info_of_attribute<3>(cell);
    id_ = info.id;
    shape_ = &DartsOf(info.kind);
    of_hexahedron_ = nullptr;
    of_polyhedron_ = nullptr;
    if (info.kind == CellKind::kHexahedron) {
      of_hexahedron_ = &hexahedron_.Of(cell);
      whole_ = BoxOf(id_);
      return of_hexahedron_->size();
    }
    const MeshCells* mesh = initial_.mesh();
    cell_ = mesh == nullptr ? kNoCell : mesh->CellOf(id_.initial());
    if (cell_ == kNoCell) return 0;
    of_polyhedron_ = &polyhedron_.Of(cell);
    return of_polyhedron_->size();
  }

  // Of the cell that was looked at last; face after face of the map, each in the order of its darts.
  Dart dart(size_t i) const {
    return of_hexahedron_ != nullptr ? (*of_hexahedron_)[i].dart : (*of_polyhedron_)[i].dart;
  }
  // The id of the dart's vertex, edge, face or n-cell. O(levels).
  CellId Name(size_t i, unsigned dimension) const {
    if (dimension == 3) return id_;
    if (of_hexahedron_ != nullptr) {
      const auto& placed = (*of_hexahedron_)[i];
      return NameOf(initial_, dimension == 0 ? placed.vertex : dimension == 1 ? placed.edge : placed.face);
    }
    const auto& placed = (*of_polyhedron_)[i];
    return initial_.mesh()->Name(cell_, dimension == 0   ? placed.vertex
                                        : dimension == 1 ? placed.edge
                                                         : placed.face);
  }
  // The local corner of the n-cell where the dart starts (core/mesh/cell_darts.h), or kNoCorner.
  unsigned Corner(size_t i) const {
    if (of_hexahedron_ == nullptr) {
      const unsigned part = (*of_polyhedron_)[i].vertex.part;
      return part < shape_->corners ? part : kNoCorner;
    }
    unsigned corner = 0;
    for (int c = 0; c < 3; ++c) {
      const uint32_t offset = (*of_hexahedron_)[i].vertex.low.at[c] - whole_.low.at[c];
      if (offset != 0 && offset != whole_.extent[c]) return kNoCorner;
      corner |= offset == 0 ? 0u : 1u << c;
    }
    return corner;
  }

 private:
  Lcc& map_;
  const InitialCells& initial_;
  HexahedronLattice<BlockT> hexahedron_;
  PolyhedronLattice<BlockT> polyhedron_;
  CellId id_;
  const CellDarts* shape_ = nullptr;
  LatticeBox whole_;
  uint32_t cell_ = kNoCell;
  const std::vector<typename HexahedronLattice<BlockT>::Placed>* of_hexahedron_ = nullptr;
  const std::vector<typename PolyhedronLattice<BlockT>::Placed>* of_polyhedron_ = nullptr;
};

// In a map of dimension 2: nothing changes its faces, so that the corners of the map are those of the
// surface.
template <class BlockT>
class PolygonNames {
 public:
  using Lcc = typename BlockT::Lcc;
  using Dart = typename BlockT::Dart;
  using Cell = typename BlockT::Types::Cell;

  PolygonNames(Lcc& map, const InitialCells& initial) : map_(map), polygons_(initial.polygons()) {}

  // As of VolumeNames.
  size_t Look(Cell cell) {
    const auto& info = map_.template info_of_attribute<2>(cell);
    id_ = info.id;
    face_ = polygons_ == nullptr ? kNoCell : polygons_->FaceOf(id_.initial());
    darts_.clear();
    if (face_ == kNoCell) return 0;
    Dart d = info.reference;
    do {
      darts_.push_back(d);
      d = map_.template beta<1>(d);
    } while (d != info.reference);
    return darts_.size();
  }

  // Around the face, from its corner 0.
  Dart dart(size_t i) const { return darts_[i]; }
  // O(1).
  CellId Name(size_t i, unsigned dimension) const {
    if (dimension >= 2) return id_;
    const auto corner = static_cast<uint32_t>(i);
    return dimension == 0 ? polygons_->VertexName(face_, corner) : polygons_->EdgeName(face_, corner);
  }
  unsigned Corner(size_t i) const { return static_cast<unsigned>(i); }

 private:
  Lcc& map_;
  const PolygonCells* const polygons_;
  CellId id_;
  uint32_t face_ = kNoCell;
  std::vector<Dart> darts_;
};

template <class BlockT>
using CellNames = std::conditional_t<BlockT::n == 2, PolygonNames<BlockT>, VolumeNames<BlockT>>;

}  // namespace ndmap

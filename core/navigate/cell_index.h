// SPDX-License-Identifier: GPL-3.0-or-later
// Finds the n-cells of one block at one of its versions by id, by place in the lattice and by place in space.
// For n = 2 and 3. Made in steps, so that whoever hosts the block can do other things between; then it does
// not change.
#pragma once

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "core/geometry/surface.h"
#include "core/map/block.h"
#include "core/names/initial_cells.h"
#include "core/names/name_of.h"

namespace ndmap {

class CellIndex {
 public:
  struct Entry {
    // The id, of a hexahedron lengthened by zeros to the finest level: ordered along the octrees of the
    // initial hexahedra.
    CellId key;
    DartIndex reference;
    uint8_t level = 0;
  };

  ~CellIndex();
  uint64_t version() const { return version_; }
  size_t size() const { return entries_.size(); }

  // The hexahedron with this id; nullptr if there is none. O(log cells).
  const Entry* Find(const CellId& id) const;
  // The hexahedron that contains the smallest lattice cell whose low corner is `place`; nullptr if none does.
  // O(log cells).
  const Entry* At(const LatticePlace& place) const;
  // All cells whose box meets the closed box. O(log cells + answer).
  std::vector<const Entry*> Meeting(const Box3& box) const;
  // Up to `most` cells by growing distance of their boxes from the point, with the squared distance.
  // O(most log cells).
  std::vector<std::pair<double, const Entry*>> Nearest(const Point3& point, size_t most) const;
  // Whether the point is so far from the cells, or all is so large or so small, that squared distances of
  // boxes do not tell which is nearer.
  bool IsFar(const Point3& point) const;
  // Those that a vertex nearest to a point may be of: any point, also one far away. O(cells).
  std::vector<const Entry*> PerhapsNearest(const Point3& point) const;

 private:
  friend class CellIndexBuilder;
  struct Tree;
  CellIndex();

  uint64_t version_ = 0;
  std::vector<Entry> entries_;
  std::unique_ptr<Tree> tree_;
};

class CellIndexBuilder {
 public:
  CellIndexBuilder();
  ~CellIndexBuilder();
  // Reads up to `budget` cells; true when all are read. ABORTED if the block changed since the first
  // step.
  template <class BlockT>
  absl::StatusOr<bool> Step(BlockT& block, size_t budget);
  // After Step() was true; needs the block no more, so it belongs on a thread of its own. O(cells log cells).
  std::shared_ptr<const CellIndex> Build();

 private:
  std::vector<DartIndex> todo_;
  bool begun_ = false;
  std::vector<std::pair<CellIndex::Entry, Box3>> read_;
  uint64_t version_ = 0;
};

// A dart of a cell of any dimension, by the cell's id; none if the block has no dart of it. O(log cells +
// darts of the hexahedra around).
template <class BlockT>
DartIndex FindCell(BlockT& block, const CellIndex& index, const InitialCells& initial, const CellId& id);

}  // namespace ndmap

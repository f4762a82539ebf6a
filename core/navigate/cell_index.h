// SPDX-License-Identifier: GPL-3.0-or-later
// Finds the n-cells of one block at one of its versions by id, by place in the lattice and by place in space.
// For n = 2 and 3. Made in steps, so that whoever hosts the block can do other things between; then it does
// not change.
#pragma once

#include <cstdint>
#include <memory>
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
  // Visits hexahedra by growing distance of their boxes from the point, until `visit` returns false. The
  // distance is squared.
  template <class Visit>
  void ByDistance(const Point3& point, Visit visit) const;

 private:
  friend class CellIndexBuilder;
  struct Tree;
  CellIndex();
  // The `most` nearest.
  std::vector<std::pair<double, const Entry*>> Nearest(const Point3& point, size_t most) const;

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

// The vertex nearest to a point.
struct NearestVertex {
  // Squared; infinite in an empty block.
  double distance = std::numeric_limits<double>::infinity();
  CellId id;
  DartIndex dart;
};
template <class BlockT>
NearestVertex FindNearestVertex(BlockT& block, const CellIndex& index, const InitialCells& initial,
                                const Point3& point);

template <class Visit>
void CellIndex::ByDistance(const Point3& point, Visit visit) const {
  size_t done = 0;
  for (size_t most = 16; done < entries_.size(); most *= 4) {
    const auto nearest = Nearest(point, most);
    for (; done < nearest.size(); ++done) {
      if (!visit(nearest[done].first, *nearest[done].second)) return;
    }
  }
}

}  // namespace ndmap

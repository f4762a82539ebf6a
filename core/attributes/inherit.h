// SPDX-License-Identifier: GPL-3.0-or-later
// What a new cell gets: values that follow from those of the cells that it was made of, which follow from its
// id alone (docs/attributes.md). So every block that has the cell finds the same without asking another.
#pragma once

#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/container/inlined_vector.h"
#include "core/attributes/table.h"
#include "core/names/initial_cells.h"

namespace ndmap {

// The cells of the same dimension that a cell was made of, one level up. For an n-cell its parent, for an
// edge or face the one that it is a part of, for a vertex the corners of the cell at whose centre it stands:
// 2, 4 or 8, the first axis fastest, in the frame of its owner. None for what was there initially, for edges
// and faces in the inside of a face or hexahedron, and for ids of other kinds. O(levels).
using Origins = absl::InlinedVector<CellId, 8>;
Origins OriginsOf(const CellId& id, const InitialCells& initial);

// Fills the new rows of one table.
class Inheritor {
 public:
  // Both outlive it. `initial` may be null where only n-cells are asked for.
  Inheritor(AttributeTable& table, const InitialCells* initial) : table_(table), initial_(initial) {}

  // All columns of a row that was just added. O(levels) for most; what is computed on the way is kept.
  void Fill(uint32_t row);
  void Clear() { between_.clear(); }

 private:
  ValueWords ValueOf(const CellId& id, size_t column);
  ValueWords Computed(const Origins& origins, size_t column);

  AttributeTable& table_;
  const InitialCells* const initial_;
  // Values of cells that are not there (any more, or yet), by column.
  std::vector<absl::flat_hash_map<CellId, ValueWords>> between_;
};

}  // namespace ndmap

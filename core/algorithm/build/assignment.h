// SPDX-License-Identifier: GPL-3.0-or-later
// Which block has which initial hexahedron. A function of the hexahedron's number that every process
// evaluates alike: runs of consecutive numbers, so that nobody needs a list of all hexahedra.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/geometry/grid_shape.h"
#include "core/geometry/surface.h"
#include "core/map/ids.h"

namespace ndmap {

class Assignment {
 public:
  Assignment() = default;
  // From the block of every cell in number order.
  static Assignment FromTable(const std::vector<uint32_t>& block_of_cell);

  uint64_t cell_count() const { return ends_.empty() ? 0 : ends_.back(); }
  uint32_t block_count() const { return block_count_; }
  // 0 <= cell < cell_count(). O(log runs).
  BlockId BlockOf(uint64_t cell) const;
  // Runs of cells with one block: [begin, end) of run r.
  size_t run_count() const { return ends_.size(); }
  uint64_t run_begin(size_t r) const { return r == 0 ? 0 : ends_[r - 1]; }
  uint64_t run_end(size_t r) const { return ends_[r]; }
  BlockId run_block(size_t r) const { return BlockId{blocks_[r]}; }

  // "12x0,30x1,...": run lengths and blocks.
  std::string Encode() const;
  // INVALID_ARGUMENT if the text is not of that form or does not cover exactly `cell_count` cells.
  static absl::StatusOr<Assignment> Decode(absl::string_view text, uint64_t cell_count);

 private:
  std::vector<uint64_t> ends_;
  std::vector<uint32_t> blocks_;
  uint32_t block_count_ = 0;
};

// How much refinement to depth `depth` is expected in each cell of the grid, in cells made: 1 + the surface's
// area in it, in faces of the finest level. Areas are shared out by sampling triangles. O(cells + triangles +
// samples).
std::vector<double> ExpectedWork(const GridShape& grid, const TriangleSurface* surface, int depth);

// The most initial hexahedra for the partition lpt: it has no long runs, and a longer list of blocks does not
// fit in the parameters of a phase.
inline constexpr uint64_t kMaxLptCells = 500'000;

// INVALID_ARGUMENT if the partition cannot cut a grid of so many hexahedra.
absl::Status CheckPartition(absl::string_view partition, uint64_t cells);

// The partitions, by name: hilbert, morton (pieces of the curve of equal expected work), slabs (layers across
// the longest axis, of equal work), metis (METIS k-way on the grid's dual graph), lpt (heaviest cell first to
// the least loaded block; balanced, with the longest borders). INVALID_ARGUMENT for other names, for 0
// blocks, for more blocks than cells, for what CheckPartition() refuses. `surface` may be null: all cells
// weigh the same.
absl::StatusOr<Assignment> MakeAssignment(const GridShape& grid, uint32_t blocks, absl::string_view partition,
                                          const TriangleSurface* surface, int depth);

}  // namespace ndmap

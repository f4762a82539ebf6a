// SPDX-License-Identifier: GPL-3.0-or-later
// What grids and meshes are cut into blocks with: curves that fill space, and METIS.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"

namespace ndmap {

// A place on a lattice of 2^bits points a side, bits <= 21.
using LatticeKey = std::array<uint32_t, 3>;

// Where the place is on the Morton curve (x the slowest), or on the Hilbert curve. O(bits).
uint64_t Interleave(const LatticeKey& x, int bits);
uint64_t HilbertKey(LatticeKey x, int bits);

// Cuts a sequence of cells into `blocks` pieces of nearly equal work, none empty: the block of each cell.
// `order` lists all cells, 1 <= blocks <= their number. O(cells).
std::vector<uint32_t> CutSequence(const std::vector<uint64_t>& order, const std::vector<double>& work,
                                  uint32_t blocks);

// The block of each vertex of a graph, by METIS, none empty: neighbours of vertex i are neighbours[starts[i]]
// to neighbours[starts[i + 1] - 1]. Weights may be null. 1 <= blocks <= vertices. The same on every call.
absl::StatusOr<std::vector<uint32_t>> PartitionGraph(std::vector<int32_t>& starts,
                                                     std::vector<int32_t>& neighbours,
                                                     std::vector<int32_t>* vertex_weights,
                                                     std::vector<int32_t>* edge_weights, uint32_t blocks);

}  // namespace ndmap

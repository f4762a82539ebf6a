// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/algorithm/build/partition.h"

#include <metis.h>

#include <numeric>
#include <type_traits>

#include "absl/strings/str_cat.h"

namespace ndmap {
namespace {

static_assert(std::is_same_v<idx_t, int32_t>, "METIS counts with 32 bits");

// METIS may leave a part empty; every block gets a cell.
void FillEmptyBlocks(std::vector<uint32_t>& block_of_cell, uint32_t blocks) {
  std::vector<uint64_t> sizes(blocks, 0);
  for (uint32_t b : block_of_cell) ++sizes[b];
  size_t from = 0;
  for (uint32_t b = 0; b < blocks; ++b) {
    for (; sizes[b] == 0; ++from) {
      if (sizes[block_of_cell[from]] < 2) continue;
      --sizes[block_of_cell[from]];
      block_of_cell[from] = b;
      ++sizes[b];
    }
  }
}

}  // namespace

uint64_t Interleave(const LatticeKey& x, int bits) {
  uint64_t key = 0;
  for (int b = bits - 1; b >= 0; --b) {
    for (int c = 0; c < 3; ++c) key = key << 1 | (x[c] >> b & 1);
  }
  return key;
}

// J. Skilling, Programming the Hilbert curve, AIP Conf. Proc. 707 (2004): coordinates to transposed index.
uint64_t HilbertKey(LatticeKey x, int bits) {
  const uint32_t top = uint32_t{1} << (bits - 1);
  for (uint32_t q = top; q > 1; q >>= 1) {
    const uint32_t p = q - 1;
    for (int i = 0; i < 3; ++i) {
      if (x[i] & q) {
        x[0] ^= p;
      } else {
        const uint32_t t = (x[0] ^ x[i]) & p;
        x[0] ^= t;
        x[i] ^= t;
      }
    }
  }
  for (int i = 1; i < 3; ++i) x[i] ^= x[i - 1];
  uint32_t t = 0;
  for (uint32_t q = top; q > 1; q >>= 1) {
    if (x[2] & q) t ^= q - 1;
  }
  for (uint32_t& v : x) v ^= t;
  return Interleave(x, bits);
}

// Cuts a sequence of cells into `blocks` pieces of nearly equal work, none empty.
std::vector<uint32_t> CutSequence(const std::vector<uint64_t>& order, const std::vector<double>& work,
                                  uint32_t blocks) {
  const double total = std::accumulate(work.begin(), work.end(), 0.0);
  std::vector<uint32_t> block_of_cell(order.size());
  double done = 0;
  uint32_t block = 0;
  uint64_t in_block = 0;
  for (size_t i = 0; i < order.size(); ++i) {
    const double w = work[order[i]];
    const size_t left = order.size() - i;
    const bool full = in_block > 0 && done + w / 2 > total * (block + 1) / blocks;
    if (block + 1 < blocks && in_block > 0 && (full || left <= blocks - 1 - block)) {
      ++block;
      in_block = 0;
    }
    block_of_cell[order[i]] = block;
    ++in_block;
    done += w;
  }
  return block_of_cell;
}

absl::StatusOr<std::vector<uint32_t>> PartitionGraph(std::vector<int32_t>& starts,
                                                     std::vector<int32_t>& neighbours,
                                                     std::vector<int32_t>* vertex_weights,
                                                     std::vector<int32_t>* edge_weights, uint32_t blocks) {
  std::vector<uint32_t> block_of(starts.size() - 1, 0);
  if (blocks == 1) return block_of;
  std::vector<idx_t> part(block_of.size(), 0);
  idx_t n = static_cast<idx_t>(part.size()), constraints = 1, parts = static_cast<idx_t>(blocks), cut = 0;
  idx_t options[METIS_NOPTIONS];
  METIS_SetDefaultOptions(options);
  options[METIS_OPTION_SEED] = 1;
  if (METIS_PartGraphKway(&n, &constraints, starts.data(), neighbours.data(),
                          vertex_weights == nullptr ? nullptr : vertex_weights->data(), nullptr,
                          edge_weights == nullptr ? nullptr : edge_weights->data(), &parts, nullptr, nullptr,
                          options, &cut, part.data()) != METIS_OK) {
    return absl::InternalError(absl::StrCat("METIS could not cut ", n, " cells into ", blocks, " blocks"));
  }
  block_of.assign(part.begin(), part.end());
  FillEmptyBlocks(block_of, blocks);
  return block_of;
}

}  // namespace ndmap

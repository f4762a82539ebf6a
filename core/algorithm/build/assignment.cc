// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/algorithm/build/assignment.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <queue>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "core/algorithm/build/partition.h"

namespace ndmap {
namespace {

using Cell = std::array<uint32_t, 3>;

Cell CellAt(const GridShape& grid, uint64_t number) {
  return {static_cast<uint32_t>(number % grid.cells[0]),
          static_cast<uint32_t>(number / grid.cells[0] % grid.cells[1]),
          static_cast<uint32_t>(number / grid.cells[0] / grid.cells[1])};
}

int CurveBits(const GridShape& grid) {
  const uint32_t most = std::max({grid.cells[0], grid.cells[1], grid.cells[2]});
  int bits = 1;
  while (bits < 21 && (uint32_t{1} << bits) < most) ++bits;
  return bits;
}

template <class Key>
std::vector<uint32_t> CutAlong(const GridShape& grid, const std::vector<double>& work, uint32_t blocks,
                               Key key) {
  std::vector<std::pair<uint64_t, uint64_t>> keyed(work.size());
  for (uint64_t i = 0; i < work.size(); ++i) keyed[i] = {key(CellAt(grid, i)), i};
  std::sort(keyed.begin(), keyed.end());
  std::vector<uint64_t> order(keyed.size());
  for (size_t i = 0; i < keyed.size(); ++i) order[i] = keyed[i].second;
  return CutSequence(order, work, blocks);
}

std::vector<uint32_t> HeaviestFirst(const std::vector<double>& work, uint32_t blocks) {
  std::vector<uint64_t> order(work.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](uint64_t a, uint64_t b) { return work[a] > work[b]; });
  using Load = std::pair<double, uint32_t>;
  std::priority_queue<Load, std::vector<Load>, std::greater<Load>> loads;
  for (uint32_t b = 0; b < blocks; ++b) loads.push({0.0, b});
  std::vector<uint32_t> block_of_cell(work.size());
  for (uint64_t cell : order) {
    const auto [load, block] = loads.top();
    loads.pop();
    block_of_cell[cell] = block;
    loads.push({load + work[cell], block});
  }
  return block_of_cell;
}

absl::StatusOr<std::vector<uint32_t>> ByMetis(const GridShape& grid, const std::vector<double>& work,
                                              uint32_t blocks) {
  const auto count = static_cast<int32_t>(work.size());
  const double most = *std::max_element(work.begin(), work.end());
  std::vector<int32_t> starts{0}, neighbours, vertex_weights(work.size()), edge_weights;
  const std::array<int64_t, 3> stride = {1, grid.cells[0], int64_t{grid.cells[0]} * grid.cells[1]};
  // Two neighbours exchange about as much as the surface crosses between them.
  auto weight = [&](uint64_t i, double scale) { return static_cast<int32_t>(1 + scale * work[i] / most); };
  for (int32_t i = 0; i < count; ++i) {
    const Cell cell = CellAt(grid, i);
    vertex_weights[i] = weight(i, 1e5);
    for (int c = 0; c < 3; ++c) {
      for (int step : {-1, 1}) {
        const int64_t x = int64_t{cell[c]} + step;
        if (x < 0 || x >= grid.cells[c]) continue;
        const auto j = static_cast<int32_t>(i + step * stride[c]);
        neighbours.push_back(j);
        edge_weights.push_back(std::min(weight(i, 1e3), weight(j, 1e3)));
      }
    }
    starts.push_back(static_cast<int32_t>(neighbours.size()));
  }
  return PartitionGraph(starts, neighbours, &vertex_weights, &edge_weights, blocks);
}

}  // namespace

Assignment Assignment::FromTable(const std::vector<uint32_t>& block_of_cell) {
  Assignment a;
  for (size_t i = 0; i < block_of_cell.size(); ++i) {
    if (a.blocks_.empty() || a.blocks_.back() != block_of_cell[i]) {
      a.blocks_.push_back(block_of_cell[i]);
      a.ends_.push_back(i);
    }
    a.ends_.back() = i + 1;
    a.block_count_ = std::max(a.block_count_, block_of_cell[i] + 1);
  }
  return a;
}

BlockId Assignment::BlockOf(uint64_t cell) const {
  const auto it = std::upper_bound(ends_.begin(), ends_.end(), cell);
  return BlockId{blocks_[static_cast<size_t>(it - ends_.begin())]};
}

std::string Assignment::Encode() const {
  std::string text;
  for (size_t r = 0; r < run_count(); ++r) {
    absl::StrAppend(&text, r == 0 ? "" : ",", run_end(r) - run_begin(r), "x", blocks_[r]);
  }
  return text;
}

absl::StatusOr<Assignment> Assignment::Decode(absl::string_view text, uint64_t cell_count) {
  Assignment a;
  uint64_t end = 0;
  for (absl::string_view run : absl::StrSplit(text, ',')) {
    const std::vector<absl::string_view> parts = absl::StrSplit(run, 'x');
    uint64_t length = 0;
    uint32_t block = 0;
    if (parts.size() != 2 || !absl::SimpleAtoi(parts[0], &length) || !absl::SimpleAtoi(parts[1], &block) ||
        length == 0 || length > cell_count - end || block == BlockId::kNone) {
      return absl::InvalidArgumentError(
          absl::StrCat("assignment run '", run, "', expected LENGTHxBLOCK within ", cell_count, " cells"));
    }
    end += length;
    a.ends_.push_back(end);
    a.blocks_.push_back(block);
    a.block_count_ = std::max(a.block_count_, block + 1);
  }
  if (end != cell_count) {
    return absl::InvalidArgumentError(absl::StrCat("assignment covers ", end, " of ", cell_count, " cells"));
  }
  return a;
}

std::vector<double> ExpectedWork(const GridShape& grid, const TriangleSurface* surface, int depth) {
  std::vector<double> work(grid.CellCount(), 1.0);
  if (surface == nullptr) return work;
  Point3 side;
  for (int c = 0; c < 3; ++c) side[c] = (grid.hi[c] - grid.lo[c]) / grid.cells[c];
  const double smallest = std::min({side[0], side[1], side[2]});
  const double finest = smallest / std::ldexp(1.0, depth);
  // Cells made per unit of area: about a dozen a face of the finest level, those above included.
  const double density = 12.0 / (finest * finest);
  for (const auto& triangle : surface->triangles) {
    const Point3& a = surface->points[triangle[0]];
    Point3 u, v;
    for (int c = 0; c < 3; ++c) {
      u[c] = surface->points[triangle[1]][c] - a[c];
      v[c] = surface->points[triangle[2]][c] - a[c];
    }
    const Point3 normal = {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
    const double area = std::sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]) / 2;
    const double longest =
        std::sqrt(std::max(u[0] * u[0] + u[1] * u[1] + u[2] * u[2], v[0] * v[0] + v[1] * v[1] + v[2] * v[2]));
    const int samples = std::clamp(static_cast<int>(std::ceil(2 * longest / smallest)), 1, 64);
    for (int i = 0; i < samples; ++i) {
      for (int j = 0; j < samples; ++j) {
        double s = (i + 0.5) / samples, t = (j + 0.5) / samples;
        if (s + t > 1) s = 1 - s, t = 1 - t;
        uint64_t number = 0;
        for (int c = 2; c >= 0; --c) {
          const double x = (a[c] + s * u[c] + t * v[c] - grid.lo[c]) / side[c];
          const auto k = static_cast<uint64_t>(std::clamp(x, 0.0, static_cast<double>(grid.cells[c] - 1)));
          number = number * grid.cells[c] + k;
        }
        work[number] += density * area / (samples * samples);
      }
    }
  }
  return work;
}

absl::Status CheckPartition(absl::string_view partition, uint64_t cells) {
  if (partition != "lpt" || cells <= kMaxLptCells) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("partition lpt lists every hexahedron, and ", cells,
                                                 " are more than the ", kMaxLptCells,
                                                 " that it may list: take hilbert"));
}

absl::StatusOr<Assignment> MakeAssignment(const GridShape& grid, uint32_t blocks, absl::string_view partition,
                                          const TriangleSurface* surface, int depth) {
  if (blocks == 0 || blocks > grid.CellCount()) {
    return absl::InvalidArgumentError(absl::StrCat(blocks, " blocks, expected 1 to ", grid.CellCount(),
                                                   ", the number of initial hexahedra"));
  }
  if (absl::Status status = CheckPartition(partition, grid.CellCount()); !status.ok()) return status;
  const std::vector<double> work = ExpectedWork(grid, surface, depth);
  const int bits = CurveBits(grid);
  std::vector<uint32_t> table;
  if (partition == "hilbert") {
    table = CutAlong(grid, work, blocks, [bits](const Cell& c) { return HilbertKey(c, bits); });
  } else if (partition == "morton") {
    table = CutAlong(grid, work, blocks, [bits](const Cell& c) {
      return Interleave({c[2], c[1], c[0]}, bits);
    });
  } else if (partition == "slabs") {
    int axis = 0;
    for (int c = 1; c < 3; ++c) {
      if (grid.cells[c] > grid.cells[axis]) axis = c;
    }
    table = CutAlong(grid, work, blocks, [&grid, axis](const Cell& c) {
      const uint64_t layer = c[axis];
      return (layer * grid.cells[(axis + 1) % 3] + c[(axis + 1) % 3]) * grid.cells[(axis + 2) % 3] +
             c[(axis + 2) % 3];
    });
  } else if (partition == "lpt") {
    table = HeaviestFirst(work, blocks);
  } else if (partition == "metis") {
    absl::StatusOr<std::vector<uint32_t>> parts = ByMetis(grid, work, blocks);
    if (!parts.ok()) return parts.status();
    table = *std::move(parts);
  } else {
    return absl::InvalidArgumentError(
        absl::StrCat("partition '", partition, "', expected hilbert, morton, slabs, metis or lpt"));
  }
  return Assignment::FromTable(table);
}

}  // namespace ndmap

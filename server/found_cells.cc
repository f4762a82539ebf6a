// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/found_cells.h"

#include <algorithm>
#include <utility>

namespace ndmap::server {
namespace {

absl::Status DamagedList() { return absl::InternalError("a block server sent a damaged list of cells"); }

// A source and how far it was read.
struct Reading {
  std::unique_ptr<FoundSource> source;
  std::vector<FoundCell> part;
  size_t next = 0;
  bool over = false;

  const FoundCell& cell() const { return part[next]; }
  absl::Status Advance() {
    if (++next < part.size()) return absl::OkStatus();
    return Refill();
  }
  absl::Status Refill() {
    absl::StatusOr<std::vector<FoundCell>> more = source->Next();
    if (!more.ok()) return more.status();
    part = *std::move(more);
    next = 0;
    over = part.empty();
    return absl::OkStatus();
  }
};

}  // namespace

std::vector<FoundCell> MergeFound(std::vector<FoundCell> a, std::vector<FoundCell> b) {
  if (a.empty()) return b;
  std::vector<FoundCell> merged;
  merged.reserve(a.size() + b.size());
  size_t i = 0, j = 0;
  while (i < a.size() || j < b.size()) {
    const bool both = i < a.size() && j < b.size() && a[i].id == b[j].id;
    const bool first =
        j == b.size() || (i < a.size() && (both ? a[i].block < b[j].block : a[i].id < b[j].id));
    merged.push_back(first ? a[i] : b[j]);
    i += first || both ? 1 : 0;
    j += !first || both ? 1 : 0;
  }
  return merged;
}

void ToWire(const std::vector<FoundCell>& cells, size_t begin, size_t end, bool points,
            v1::FoundCells& wire) {
  for (size_t k = begin; k < end; ++k) {
    wire.add_cell_hi(cells[k].id.hi());
    wire.add_cell_lo(cells[k].id.lo());
    wire.add_blocks(cells[k].block);
    if (points) wire.mutable_points()->Add(cells[k].point.begin(), cells[k].point.end());
  }
}

absl::StatusOr<std::vector<FoundCell>> FromWire(const v1::FoundCells& wire, bool points, CellId last) {
  const int n = wire.cell_hi_size();
  if (wire.cell_lo_size() != n || wire.blocks_size() != n || wire.points_size() != (points ? 3 * n : 0)) {
    return DamagedList();
  }
  std::vector<FoundCell> cells;
  cells.reserve(static_cast<size_t>(n));
  for (int k = 0; k < n; ++k) {
    FoundCell cell{CellId::FromWords(wire.cell_hi(k), wire.cell_lo(k)), DartIndex{}, wire.blocks(k)};
    if (!cell.id.IsWellFormed() || !(last < cell.id)) return DamagedList();
    for (int c = 0; points && c < 3; ++c) cell.point[static_cast<size_t>(c)] = wire.points(3 * k + c);
    last = cell.id;
    cells.push_back(cell);
  }
  return cells;
}

absl::Status MergeSources(std::vector<std::unique_ptr<FoundSource>> sources, size_t most,
                          const std::function<absl::Status(const std::vector<FoundCell>&)>& take) {
  std::vector<Reading> readings;
  for (auto& source : sources) {
    Reading& reading = readings.emplace_back();
    reading.source = std::move(source);
    if (absl::Status s = reading.Refill(); !s.ok()) return s;
  }
  std::vector<FoundCell> merged;
  while (true) {
    const FoundCell* lowest = nullptr;
    for (const Reading& r : readings) {
      if (r.over || (lowest != nullptr && lowest->id < r.cell().id)) continue;
      if (lowest == nullptr || r.cell().id < lowest->id || r.cell().block < lowest->block) lowest = &r.cell();
    }
    if (lowest == nullptr || merged.size() == most) {
      if (!merged.empty()) {
        if (absl::Status s = take(merged); !s.ok()) return s;
      }
      if (lowest == nullptr) return absl::OkStatus();
      merged.clear();
    }
    merged.push_back(*lowest);
    const CellId id = lowest->id;
    for (Reading& r : readings) {
      if (r.over || r.cell().id != id) continue;
      if (absl::Status s = r.Advance(); !s.ok()) return s;
    }
  }
}

}  // namespace ndmap::server

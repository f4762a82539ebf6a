// SPDX-License-Identifier: GPL-3.0-or-later
// Adds up the values of one block, a step of about a millisecond at a time.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/status/statusor.h"
#include "core/attributes/aggregate.h"
#include "core/map/partial_scan.h"
#include "core/names/cell_names.h"
#include "core/names/initial_cells.h"
#include "server/attribute_rows.h"
#include "server/block_scan.h"

namespace ndmap::server {

class BlockAggregator {
 public:
  // `columns`: of the question's name, if it has one, and of its category, if it has one. All outlive it.
  // `initial` may be null where no block is looked at. Adds to `sum`.
  BlockAggregator(const v1::AggregateRequest& question, const AttributeRows::Columns& columns,
                  std::shared_ptr<const InitialCells> initial, Aggregates& sum);

  // True when the block is done. ABORTED as RowView::Make(); RESOURCE_EXHAUSTED: too many groups.
  // Cells without rows that other blocks may have, too, are left out: TakeOuter() gives them then.
  absl::StatusOr<bool> Step(Block3& block, const AttributeStore& store);
  std::vector<FoundCell> TakeOuter() { return scan_ ? scan_->TakeOuter() : std::vector<FoundCell>(); }
  // Such cells of any blocks, each once.
  absl::Status AddFound(const std::vector<FoundCell>& cells);

 private:
  using Cells = Block3::Lcc::Attribute_range<3>::type;

  bool WithinLevels(int level) const;
  GroupAggregate& GroupOfRow(const RowView& view, uint32_t row);
  GroupAggregate& GroupOfPlace(uint32_t block, int level);
  GroupAggregate& Group(uint64_t key, const std::string& name);
  // True when there are no more.
  absl::StatusOr<bool> StepRows(Block3& block, const AttributeStore& store);
  absl::StatusOr<bool> StepScan(Block3& block);
  // True when all were looked at.
  absl::StatusOr<bool> StepCells(Block3& block, const AttributeStore& store);
  // The next rows of the view, at most so many.
  absl::Status AddRows(const RowView& view, size_t most);
  void AddRow(const RowView& view, uint32_t row);
  // Values at the corners of an n-cell.
  absl::Status AddCell(Block3& block, const RowView* rows, Block3::Types::Cell cell);
  // Values times a volume, unless one of them is not finite.
  static void AddIntegral(const std::array<double, 3>& values, unsigned width, double volume,
                          GroupAggregate& group);
  double Number(const ValueWords& value, unsigned component) const;

  const v1::AggregateRequest& question_;
  const std::vector<AskedColumn>& columns_;
  const bool by_scan_;
  const std::shared_ptr<const InitialCells> initial_;
  Aggregates& sum_;
  const HistogramShape shape_;
  // Of the question's name; 0 when it has none or a category's.
  const unsigned width_;
  // By level, block or code: where the names of groups need not be looked up.
  absl::flat_hash_map<uint64_t, GroupAggregate*> groups_;
  size_t row_ = 0;
  bool rows_done_ = false;
  std::optional<BlockScan> scan_;
  std::vector<FoundCell> inner_;
  uint64_t version_ = 0;
  std::optional<PartialScan<Cells>> cells_;
  std::optional<CellNames<Block3>> names_;
};

}  // namespace ndmap::server

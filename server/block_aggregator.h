// SPDX-License-Identifier: GPL-3.0-or-later
// Adds up the values of one block, a step of about a millisecond at a time.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/status/statusor.h"
#include "core/attributes/aggregate.h"
#include "core/map/partial_scan.h"
#include "core/names/initial_cells.h"
#include "server/attribute_columns.h"

namespace ndmap::server {

class BlockAggregator {
 public:
  // `columns`: of the question's name, if it has one, and of its category, if it has one. All outlive it.
  // `initial` may be null unless an integral over vertices is asked. Adds to `sum`.
  BlockAggregator(const v1::AggregateRequest& question, const std::vector<AskedColumn>& columns,
                  const InitialCells* initial, Aggregates& sum);

  // True when the block is done. ABORTED as RowView::Make(); RESOURCE_EXHAUSTED: too many groups.
  absl::StatusOr<bool> Step(Block3& block, const AttributeStore& store);

 private:
  using Cells = Block3::Lcc::Attribute_range<3>::type;

  bool WithinLevels(int level) const;
  GroupAggregate& GroupOfRow(const RowView& view, uint32_t row);
  GroupAggregate& GroupOfPlace(Block3& block, int level);
  GroupAggregate& Group(uint64_t key, const std::string& name);
  absl::Status AddRows(const RowView& view);
  void AddRow(const RowView& view, uint32_t row);
  absl::Status AddHexahedron(const RowView& view, Block3::Types::Cell cell);
  // Values times a volume, unless one of them is not finite.
  static void AddIntegral(const std::array<double, 3>& values, unsigned width, double volume,
                          GroupAggregate& group);
  double Number(const ValueWords& value, unsigned component) const;

  const v1::AggregateRequest& question_;
  const std::vector<AskedColumn>& columns_;
  const InitialCells* const initial_;
  Aggregates& sum_;
  const HistogramShape shape_;
  // Of the question's name; 0 when it has none or a category's.
  const unsigned width_;
  // By level, block or code: where the names of groups need not be looked up.
  absl::flat_hash_map<uint64_t, GroupAggregate*> groups_;
  size_t row_ = 0;
  bool rows_done_ = false;
  uint64_t version_ = 0;
  std::optional<PartialScan<Cells>> cells_;
};

}  // namespace ndmap::server

// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/block_aggregator.h"

#include <bit>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "core/algorithm/refine/frame.h"
#include "core/names/name_of.h"
#include "server/aggregate_wire.h"

namespace ndmap::server {
namespace {

// Exact sums take some hundred nanoseconds a value.
constexpr size_t kValuesAStep = 2048;
constexpr size_t kAggregatedHexahedraAStep = 256;

}  // namespace

BlockAggregator::BlockAggregator(const v1::AggregateRequest& question,
                                 const std::vector<AskedColumn>& columns, const InitialCells* initial,
                                 Aggregates& sum)
    : question_(question),
      columns_(columns),
      initial_(initial),
      sum_(sum),
      shape_{question.bins(), question.histogram_lo(), question.histogram_hi()},
      width_(question.name().empty() ? 0 : columns.front().width()) {}

absl::StatusOr<bool> BlockAggregator::Step(Block3& block, const AttributeStore& store) {
  absl::StatusOr<RowView> view =
      RowView::Make(block, store, question_.dimension(), columns_, question_.integral());
  if (!view.ok()) return view.status();
  if (!rows_done_) {
    if (absl::Status s = AddRows(*view); !s.ok()) return s;
    return rows_done_ && !(question_.integral() && question_.dimension() == 0);
  }
  if (!cells_) {
    cells_.emplace(block.map().attributes<3>());
    version_ = block.version();
  }
  // The rows may be of this version again, but the scan is not.
  if (block.version() != version_) {
    return absl::AbortedError(absl::StrCat("block ", block.id().value, " changed during the question"));
  }
  size_t left = kAggregatedHexahedraAStep;
  absl::Status status;
  const bool over = cells_->Next(&left, [&](Block3::Types::Cell cell) {
    if (status.ok()) status = AddHexahedron(*view, cell);
  });
  if (status.ok()) status = CheckSize(sum_, shape_.bins);
  if (!status.ok()) return status;
  return over;
}

bool BlockAggregator::WithinLevels(int level) const {
  const auto l = static_cast<uint32_t>(level);
  return !question_.by_level() || (question_.lowest_level() <= l && l <= question_.highest_level());
}

GroupAggregate& BlockAggregator::Group(uint64_t key, const std::string& name) {
  const auto [it, made] = groups_.try_emplace(key, nullptr);
  if (made) {
    it->second = &sum_[name];
    it->second->components.resize(width_);
  }
  return *it->second;
}

GroupAggregate& BlockAggregator::GroupOfPlace(Block3& block, int level) {
  const bool by_level = question_.group_by() == v1::GROUP_BY_LEVEL;
  const uint64_t key = by_level                                     ? static_cast<uint64_t>(level)
                       : question_.group_by() == v1::GROUP_BY_BLOCK ? block.id().value
                                                                    : 0;
  if (const auto it = groups_.find(key); it != groups_.end()) return *it->second;
  const bool named = by_level || question_.group_by() == v1::GROUP_BY_BLOCK;
  return Group(key, named ? absl::StrCat(key) : "");
}

GroupAggregate& BlockAggregator::GroupOfRow(const RowView& view, uint32_t row) {
  if (question_.group_by() != v1::GROUP_BY_CATEGORY) {
    return GroupOfPlace(view.block(), view.table().id(row).level());
  }
  const size_t column = columns_.size() - 1;
  const uint64_t code = view.CodeOf(column, row);
  if (const auto it = groups_.find(code); it != groups_.end()) return *it->second;
  return Group(code, std::string(view.TextOf(column, code)));
}

absl::Status BlockAggregator::AddRows(const RowView& view) {
  const AttributeTable& table = view.table();
  const size_t a_step = std::min(kValuesAStep / (1 + width_), RowsAStep(columns_));
  for (size_t k = 0; k < a_step && row_ < table.size(); ++k, ++row_) {
    const auto row = static_cast<uint32_t>(row_);
    if (table.Is(row, AttributeTable::kElsewhere) || !WithinLevels(table.id(row).level())) continue;
    AddRow(view, row);
    // A histogram is made in each new group.
    if (sum_.size() > kMaxGroups || shape_.bins > 0) {
      if (absl::Status s = CheckSize(sum_, shape_.bins); !s.ok()) return s;
    }
  }
  rows_done_ = row_ >= table.size();
  return absl::OkStatus();
}

void BlockAggregator::AddRow(const RowView& view, uint32_t row) {
  GroupAggregate& group = GroupOfRow(view, row);
  ++group.count;
  if (width_ == 0) return;
  const ValueWords value = view.Get(0, row);
  std::array<double, 3> numbers{};
  for (unsigned c = 0; c < width_; ++c) {
    numbers[c] = Number(value, c);
    if (columns_[0].type == ValueType::kInt64) {
      group.components[c].AddInteger(static_cast<int64_t>(value[c]), shape_);
    } else {
      group.components[c].Add(numbers[c], shape_);
    }
  }
  if (!question_.integral() || question_.dimension() != 3) return;
  AddIntegral(numbers, width_, VolumeOf(view.block(), view.table().dart(row)), group);
}

double BlockAggregator::Number(const ValueWords& value, unsigned c) const {
  return columns_[0].type == ValueType::kInt64 ? static_cast<double>(static_cast<int64_t>(value[c]))
                                               : std::bit_cast<double>(value[c]);
}

void BlockAggregator::AddIntegral(const std::array<double, 3>& values, unsigned width, double volume,
                                  GroupAggregate& group) {
  for (unsigned c = 0; c < width; ++c) {
    if (!std::isfinite(values[c] * volume)) return;
  }
  for (unsigned c = 0; c < width; ++c) group.components[c].AddIntegral(values[c], volume);
  group.volume.Add(volume);
}

absl::Status BlockAggregator::AddHexahedron(const RowView& view, Block3::Types::Cell cell) {
  auto& map = view.block().map();
  const CellId& id = map.info_of_attribute<3>(cell).id;
  if (!WithinLevels(id.level())) return absl::OkStatus();
  std::array<double, 3> mean{};
  for (unsigned corner = 0; corner < 8; ++corner) {
    const unsigned part = (corner & 1) + 3 * (corner >> 1 & 1) + 9 * (corner >> 2);
    const CellId vertex = NameOf(*initial_, BoxOf(CellId::Part(id, part)));
    const uint32_t row = view.table().Find(vertex);
    if (row == AttributeTable::kNoRow) {
      return absl::InternalError(absl::StrCat("block ", view.block().id().value, " has no row of vertex ",
                                              vertex.ToString(), " of its hexahedron ", id.ToString()));
    }
    const ValueWords value = view.Get(0, row);
    for (unsigned c = 0; c < width_; ++c) mean[c] += Number(value, c) / 8;
  }
  const double volume = HexahedronVolume(Frame<Block3>::Of(map, cell).Corners(map));
  AddIntegral(mean, width_, volume, GroupOfPlace(view.block(), id.level()));
  return absl::OkStatus();
}

}  // namespace ndmap::server

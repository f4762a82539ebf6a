// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/block_aggregator.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/attributes/cell_measure.h"
#include "server/aggregate_wire.h"

namespace ndmap::server {
namespace {

// Exact sums take some hundred nanoseconds a value.
constexpr size_t kValuesAStep = 2048;
constexpr size_t kIntegratedCellsAStep = 128;

}  // namespace

BlockAggregator::BlockAggregator(const v1::AggregateRequest& question, const AttributeRows::Columns& columns,
                                 std::shared_ptr<const InitialCells> initial, Aggregates& sum)
    : question_(question),
      columns_(columns.columns),
      by_scan_(columns.by_scan),
      initial_(std::move(initial)),
      sum_(sum),
      shape_{question.bins(), question.histogram_lo(), question.histogram_hi()},
      width_(question.name().empty() ? 0 : columns.columns.front().width()) {
  if (by_scan_ && initial_ != nullptr) scan_.emplace(question.dimension(), columns.points(), initial_);
}

absl::StatusOr<bool> BlockAggregator::Step(Block3& block, const AttributeStore& store) {
  if (rows_done_) return StepCells(block, store);
  absl::StatusOr<bool> done = by_scan_ ? StepScan(block) : StepRows(block, store);
  if (!done.ok()) return done;
  rows_done_ = *done;
  return rows_done_ && !(question_.integral() && question_.dimension() == 0);
}

absl::StatusOr<bool> BlockAggregator::StepRows(Block3& block, const AttributeStore& store) {
  absl::StatusOr<RowView> view =
      RowView::Make(block, store, question_.dimension(), columns_, question_.integral());
  if (!view.ok()) return view.status();
  if (absl::Status s = AddRows(*view, std::min(kValuesAStep / (1 + width_), RowsAStep(columns_))); !s.ok()) {
    return s;
  }
  return row_ >= view->size();
}

absl::StatusOr<bool> BlockAggregator::StepScan(Block3& block) {
  inner_.clear();
  absl::StatusOr<bool> over = scan_->Step(block, inner_);
  if (!over.ok()) return over;
  row_ = 0;
  const RowView view = RowView::Of(&block, question_.dimension(), columns_, inner_);
  if (absl::Status s = AddRows(view, inner_.size()); !s.ok()) return s;
  return over;
}

absl::Status BlockAggregator::AddFound(const std::vector<FoundCell>& cells) {
  row_ = 0;
  return AddRows(RowView::Of(nullptr, question_.dimension(), columns_, cells), cells.size());
}

absl::StatusOr<bool> BlockAggregator::StepCells(Block3& block, const AttributeStore& store) {
  std::optional<RowView> rows;
  if (!by_scan_) {
    absl::StatusOr<RowView> view = RowView::Make(block, store, question_.dimension(), columns_, true);
    if (!view.ok()) return view.status();
    rows = *std::move(view);
  }
  if (!cells_) {
    cells_.emplace(block.map().attributes<3>());
    names_.emplace(block.map(), *initial_);
    version_ = by_scan_ ? scan_->version() : block.version();
  }
  // The rows may be of this version again, but the scan is not.
  if (block.version() != version_) {
    return absl::AbortedError(absl::StrCat("block ", block.id().value, " changed during the question"));
  }
  size_t left = kIntegratedCellsAStep;
  absl::Status status;
  const bool over = cells_->Next(&left, [&](Block3::Types::Cell cell) {
    if (status.ok()) status = AddCell(block, rows ? &*rows : nullptr, cell);
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

GroupAggregate& BlockAggregator::GroupOfPlace(uint32_t block, int level) {
  const bool by_level = question_.group_by() == v1::GROUP_BY_LEVEL;
  const uint64_t key = by_level                                     ? static_cast<uint64_t>(level)
                       : question_.group_by() == v1::GROUP_BY_BLOCK ? block
                                                                    : 0;
  if (const auto it = groups_.find(key); it != groups_.end()) return *it->second;
  const bool named = by_level || question_.group_by() == v1::GROUP_BY_BLOCK;
  return Group(key, named ? absl::StrCat(key) : "");
}

GroupAggregate& BlockAggregator::GroupOfRow(const RowView& view, uint32_t row) {
  if (question_.group_by() != v1::GROUP_BY_CATEGORY) {
    return GroupOfPlace(view.block_of(row), view.id(row).level());
  }
  const size_t column = columns_.size() - 1;
  const uint64_t code = view.CodeOf(column, row);
  if (const auto it = groups_.find(code); it != groups_.end()) return *it->second;
  return Group(code, std::string(view.TextOf(column, code)));
}

absl::Status BlockAggregator::AddRows(const RowView& view, size_t most) {
  for (size_t k = 0; k < most && row_ < view.size(); ++k, ++row_) {
    const auto row = static_cast<uint32_t>(row_);
    if (view.CountsElsewhere(row) || !WithinLevels(view.id(row).level())) continue;
    AddRow(view, row);
    // A histogram is made in each new group.
    if (sum_.size() > kMaxGroups || shape_.bins > 0) {
      if (absl::Status s = CheckSize(sum_, shape_.bins); !s.ok()) return s;
    }
  }
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
  auto& map = view.block().map();
  const double volume = CellMeasure<Block3>(map).VolumeOf(map.attribute<3>(DartAt(map, view.dart(row))));
  AddIntegral(numbers, width_, volume, group);
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

absl::Status BlockAggregator::AddCell(Block3& block, const RowView* rows, Block3::Types::Cell cell) {
  auto& map = block.map();
  const auto& info = map.info_of_attribute<3>(cell);
  if (!WithinLevels(info.id.level())) return absl::OkStatus();
  std::vector<FoundCell> corners(DartsOf(info.kind).corners);
  const size_t darts = names_->Look(cell);
  for (size_t i = 0; i < darts; ++i) {
    const unsigned corner = names_->Corner(i);
    if (corner >= corners.size() || corners[corner].dart.valid()) continue;
    corners[corner] = {names_->Name(i, 0), IndexOf(map, names_->dart(i)), block.id().value};
  }
  const RowView found = RowView::Of(&block, 0, columns_, corners);
  const RowView& view = rows == nullptr ? found : *rows;
  std::array<double, 3> mean{};
  for (uint32_t corner = 0; corner < corners.size(); ++corner) {
    const CellId& vertex = corners[corner].id;
    const uint32_t row = rows == nullptr ? corner : view.Find(vertex);
    if (row == AttributeTable::kNoRow) {
      return absl::InternalError(absl::StrCat("block ", block.id().value, " has no row of vertex ",
                                              vertex.ToString(), " of its cell ", info.id.ToString()));
    }
    const ValueWords value = view.Get(0, row);
    for (unsigned c = 0; c < width_; ++c) {
      mean[c] += Number(value, c) / static_cast<double>(corners.size());
    }
  }
  AddIntegral(mean, width_, CellMeasure<Block3>(map).VolumeOf(cell),
              GroupOfPlace(block.id().value, info.id.level()));
  return absl::OkStatus();
}

}  // namespace ndmap::server

// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/attributes/inherit.h"

#include <bit>

#include "core/names/name_of.h"

namespace ndmap {
namespace {

// Steps of at most this many values are remembered; they are cheap to find again.
constexpr size_t kMostBetween = 1 << 16;

double AsDouble(uint64_t word) { return std::bit_cast<double>(word); }
uint64_t AsWord(double value) { return std::bit_cast<uint64_t>(value); }

// sum / 2^shift to the nearest integer, halves to the even one.
int64_t RoundedShift(__int128 sum, unsigned shift) {
  if (shift == 0) return static_cast<int64_t>(sum);
  const __int128 floor = sum >> shift;
  const __int128 rest = sum - (floor << shift);
  const __int128 half = __int128{1} << (shift - 1);
  const bool up = rest > half || (rest == half && (floor & 1) != 0);
  return static_cast<int64_t>(floor + (up ? 1 : 0));
}

// 2^k values, k = 1 ... 3.
ValueWords Mean(const Column& column, const absl::InlinedVector<ValueWords, 8>& values) {
  ValueWords mean{};
  const unsigned shift = static_cast<unsigned>(std::countr_zero(values.size()));
  if (column.definition().type == ValueType::kInt64) {
    __int128 sum = 0;
    for (const ValueWords& v : values) sum += static_cast<int64_t>(v[0]);
    mean[0] = static_cast<uint64_t>(RoundedShift(sum, shift));
    return mean;
  }
  for (unsigned c = 0; c < column.width(); ++c) {
    // Scaled first: a mean of large values is no infinity.
    double sum = 0;
    const double scale = 1.0 / static_cast<double>(values.size());
    for (const ValueWords& v : values) sum += AsDouble(v[c]) * scale;
    mean[c] = AsWord(sum);
  }
  return mean;
}

}  // namespace

Origins OriginsOf(const CellId& id, const InitialCells& initial) {
  if (id.is_cell()) return id.level() > 0 ? Origins{id.Parent()} : Origins{};
  if (!id.is_part()) return {};
  LatticeBox box = BoxOf(id);
  auto& at = box.low.at;
  const uint32_t length = box.extent[0] | box.extent[1] | box.extent[2];
  if (length != 0) {
    if (length == LatticePlace::kSide) return {};
    for (int c = 0; c < 3; ++c) {
      if (box.extent[c] == 0 && (at[c] & length) != 0) return {};
      if (box.extent[c] == 0) continue;
      at[c] &= ~length;
      box.extent[c] = 2 * length;
    }
    return {NameOf(initial, box)};
  }
  uint32_t step = at[0] | at[1] | at[2] | LatticePlace::kSide;
  step &= ~step + 1;
  if (step == LatticePlace::kSide) return {};
  Origins origins;
  for (unsigned corner = 0; corner < 8; ++corner) {
    LatticeBox beside = box;
    bool valid = true;
    for (int c = 0; c < 3; ++c) {
      const bool high = (corner >> c & 1) != 0;
      if ((at[c] & step) == 0) {
        valid = valid && !high;
      } else {
        beside.low.at[c] = high ? at[c] + step : at[c] - step;
      }
    }
    if (valid) origins.push_back(NameOf(initial, beside));
  }
  return origins;
}

void Inheritor::Fill(uint32_t row) {
  const CellId id = table_.id(row);
  if (between_.size() != table_.columns().size()) between_.resize(table_.columns().size());
  if (id.is_part() && initial_ == nullptr) return;
  const Origins origins =
      id.is_cell() ? (id.level() > 0 ? Origins{id.Parent()} : Origins{}) : OriginsOf(id, *initial_);
  for (size_t k = 0; k < table_.columns().size(); ++k) {
    table_.columns()[k]->Set(row, Computed(origins, k));
  }
}

ValueWords Inheritor::ValueOf(const CellId& id, size_t k) {
  const Column& column = *table_.columns()[k];
  const uint32_t row = table_.Find(id);
  if (row != AttributeTable::kNoRow) return column.Get(row);
  if (const auto it = between_[k].find(id); it != between_[k].end()) return it->second;
  const Origins origins =
      id.is_cell() ? (id.level() > 0 ? Origins{id.Parent()} : Origins{}) : OriginsOf(id, *initial_);
  const ValueWords value = Computed(origins, k);
  if (between_[k].size() > kMostBetween) between_[k].clear();
  between_[k][id] = value;
  return value;
}

ValueWords Inheritor::Computed(const Origins& origins, size_t k) {
  const Column& column = *table_.columns()[k];
  if (origins.empty()) return column.fill();
  switch (column.definition().split) {
    case SplitRule::kZero:
      return {};
    case SplitRule::kCopy:
      return ValueOf(origins.front(), k);
    case SplitRule::kMidpoint:
      return Mean(column, {ValueOf(origins.front(), k), ValueOf(origins.back(), k)});
    case SplitRule::kMean: {
      absl::InlinedVector<ValueWords, 8> values;
      for (const CellId& origin : origins) values.push_back(ValueOf(origin, k));
      return Mean(column, values);
    }
    case SplitRule::kDivide: {
      ValueWords value = ValueOf(origins.front(), k);
      const double part = 1.0 / (1u << column.definition().dimension);
      for (unsigned c = 0; c < column.width(); ++c) value[c] = AsWord(AsDouble(value[c]) * part);
      return value;
    }
  }
  return column.fill();
}

}  // namespace ndmap

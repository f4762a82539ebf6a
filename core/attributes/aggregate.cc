// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/attributes/aggregate.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "core/algorithm/refine/hexahedron.h"
#include "core/geometry/vector.h"

namespace ndmap {
namespace {

void AddCounts(const std::vector<uint64_t>& part, std::vector<uint64_t>& sum) {
  if (sum.size() < part.size()) sum.resize(part.size());
  for (size_t i = 0; i < part.size(); ++i) sum[i] += part[i];
}

}  // namespace

absl::Status HistogramShape::Validate() const {
  if (bins == 0) return absl::OkStatus();
  if (bins > kMaxBins) {
    return absl::InvalidArgumentError(absl::StrCat(bins, " bins, expected at most ", kMaxBins));
  }
  if (!std::isfinite(lo) || !std::isfinite(hi) || !(lo < hi) || !std::isfinite(hi - lo)) {
    return absl::InvalidArgumentError(
        absl::StrCat("a histogram from ", lo, " to ", hi, ", expected two numbers, the first one lower"));
  }
  return absl::OkStatus();
}

int64_t HistogramShape::BinOf(double value) const {
  if (value < lo) return -1;
  if (value > hi) return bins;
  const double place = (value - lo) / (hi - lo) * bins;
  return std::min<int64_t>(static_cast<int64_t>(place), int64_t{bins} - 1);
}

ComponentAggregate::ComponentAggregate()
    : min(std::numeric_limits<double>::infinity()), max(-std::numeric_limits<double>::infinity()) {}

void ComponentAggregate::Add(double value, const HistogramShape& shape) {
  if (!std::isfinite(value)) {
    ++not_finite;
    return;
  }
  sum.Add(value);
  Note(value, shape);
}

void ComponentAggregate::Note(double value, const HistogramShape& shape) {
  ++values;
  // -0 and 0 are equal: which of them was first must not show.
  value += 0.0;
  min = std::min(min, value);
  max = std::max(max, value);
  if (shape.bins == 0) return;
  if (histogram.empty()) histogram.resize(shape.bins);
  const int64_t bin = shape.BinOf(value);
  ++(bin < 0 ? below : bin == shape.bins ? above : histogram[static_cast<size_t>(bin)]);
}

void ComponentAggregate::AddInteger(int64_t value, const HistogramShape& shape) {
  // The sum is of the integers themselves, everything else of the doubles nearest to them.
  sum.Add(value);
  Note(static_cast<double>(value), shape);
}

void ComponentAggregate::AddIntegral(double value, double volume) {
  const double product = value * volume;
  if (std::isfinite(product)) integral.Add(product);
}

void ComponentAggregate::Merge(const ComponentAggregate& other) {
  not_finite += other.not_finite;
  values += other.values;
  sum.Add(other.sum);
  min = std::min(min, other.min);
  max = std::max(max, other.max);
  integral.Add(other.integral);
  AddCounts(other.histogram, histogram);
  below += other.below;
  above += other.above;
}

void GroupAggregate::Merge(const GroupAggregate& other) {
  count += other.count;
  if (components.size() < other.components.size()) components.resize(other.components.size());
  for (size_t c = 0; c < other.components.size(); ++c) components[c].Merge(other.components[c]);
  volume.Add(other.volume);
}

bool GroupLess::operator()(const std::string& a, const std::string& b) const {
  uint64_t m = 0, n = 0;
  const bool number_a = absl::SimpleAtoi(a, &m), number_b = absl::SimpleAtoi(b, &n);
  if (number_a && number_b && m != n) return m < n;
  if (number_a != number_b) return number_a;
  return a < b;
}

absl::Status MergeInto(const Aggregates& part, Aggregates& sum) {
  for (const auto& [name, group] : part) {
    GroupAggregate& into = sum[name];
    const bool fits = into.count == 0 || into.components.size() == group.components.size();
    if (!fits) {
      return absl::InvalidArgumentError(absl::StrCat("group \"", name, "\": ", group.components.size(),
                                                     " components, expected ", into.components.size()));
    }
    into.Merge(group);
  }
  return absl::OkStatus();
}

double HexahedronVolume(const std::array<Point3, 8>& corners) {
  std::array<Point3, 8> x;
  for (unsigned c = 0; c < 8; ++c) x[c] = Minus(corners[c], corners[0]);
  // Under a bilinear face lies the mean of what lies under its two triangulations. Corners of faces go
  // clockwise seen from outside.
  double sum = 0;
  for (const auto& face : hexahedron::kFaceCorners) {
    const Point3 &a = x[face[0]], &b = x[face[1]], &c = x[face[2]], &d = x[face[3]];
    sum += Determinant(a, c, b) + Determinant(a, d, c) + Determinant(a, d, b) + Determinant(b, d, c);
  }
  return sum / 12;
}

}  // namespace ndmap

// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/aggregate_wire.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"

namespace ndmap::server {
namespace {

absl::Status Damaged() { return absl::InternalError("a block server sent a damaged aggregate"); }

absl::Status CheckIntegral(const v1::AggregateRequest& question, const AskedColumn* column) {
  if (question.dimension() != 0 && question.dimension() != 3) {
    return absl::InvalidArgumentError(absl::StrCat("an integral of values on cells of dimension ",
                                                   question.dimension(), ", expected 0 (vertices) or 3"));
  }
  if (column == nullptr || column->type == ValueType::kCategory) {
    return absl::InvalidArgumentError("an integral needs an attribute of numbers");
  }
  if (question.group_by() != v1::GROUP_BY_CATEGORY) return absl::OkStatus();
  return absl::InvalidArgumentError("an integral by category, expected all together, by level or by block");
}

bool Fits(const v1::PartialAggregate& part, size_t components, uint32_t bins) {
  const auto has = [](int size, size_t expected) { return static_cast<size_t>(size) == expected; };
  return has(part.not_finite_size(), components) && has(part.sum_size(), components) &&
         has(part.min_size(), components) && has(part.max_size(), components) &&
         has(part.integral_size(), components) && has(part.below_size(), components) &&
         has(part.above_size(), components) && has(part.histogram_size(), components * bins);
}

void AddHistogram(const std::vector<uint64_t>& histogram, uint32_t bins,
                  google::protobuf::RepeatedField<uint64_t>* out) {
  for (uint32_t b = 0; b < bins; ++b) out->Add(histogram.empty() ? 0 : histogram[b]);
}

}  // namespace

absl::Status CheckQuestion(const v1::AggregateRequest& question, const AskedColumn* column) {
  if (!v1::GroupBy_IsValid(question.group_by())) {
    return absl::InvalidArgumentError(absl::StrCat("group_by ", static_cast<int>(question.group_by()),
                                                   ", expected 1 (nothing) to 4 (category)"));
  }
  if ((question.group_by() == v1::GROUP_BY_CATEGORY) != !question.category().empty()) {
    return absl::InvalidArgumentError("the name of a category attribute goes with group_by category");
  }
  const HistogramShape shape{question.bins(), question.histogram_lo(), question.histogram_hi()};
  if (absl::Status s = shape.Validate(); !s.ok()) return s;
  if (shape.bins > 0 && (column == nullptr || column->type == ValueType::kCategory)) {
    return absl::InvalidArgumentError("a histogram needs an attribute of numbers");
  }
  if (question.by_level() && question.lowest_level() > question.highest_level()) {
    return absl::InvalidArgumentError(absl::StrCat("levels ", question.lowest_level(), " to ",
                                                   question.highest_level(),
                                                   ", expected the lower one first"));
  }
  return question.integral() ? CheckIntegral(question, column) : absl::OkStatus();
}

absl::Status CheckSize(const Aggregates& aggregates, uint32_t bins) {
  if (aggregates.size() > kMaxGroups) {
    return absl::ResourceExhaustedError(absl::StrCat("more than ", kMaxGroups, " groups in one aggregate"));
  }
  const size_t components = aggregates.empty() ? 0 : aggregates.begin()->second.components.size();
  const size_t all = aggregates.size() * components * bins;
  if (all <= kMaxBinsInAll) return absl::OkStatus();
  return absl::ResourceExhaustedError(absl::StrCat(bins, " bins in each of ", aggregates.size(),
                                                   " groups, more than ", kMaxBinsInAll,
                                                   " in all: ask for fewer bins or groups"));
}

void ToWire(const Aggregates& aggregates, v1::AggregateBlocksResponse& wire) {
  for (const auto& [name, group] : aggregates) {
    v1::PartialAggregate& part = *wire.add_groups();
    part.set_group(name);
    part.set_count(group.count);
    part.set_volume(group.volume.Encode());
    size_t bins = 0;
    for (const ComponentAggregate& c : group.components) bins = std::max(bins, c.histogram.size());
    for (const ComponentAggregate& c : group.components) {
      part.add_not_finite(c.not_finite);
      part.add_sum(c.sum.Encode());
      part.add_min(c.min);
      part.add_max(c.max);
      part.add_integral(c.integral.Encode());
      AddHistogram(c.histogram, static_cast<uint32_t>(bins), part.mutable_histogram());
      part.add_below(c.below);
      part.add_above(c.above);
    }
  }
}

absl::StatusOr<Aggregates> FromWire(const v1::AggregateBlocksResponse& wire, size_t components,
                                    uint32_t bins) {
  Aggregates aggregates;
  for (const v1::PartialAggregate& part : wire.groups()) {
    const uint32_t sent_bins = part.histogram_size() == 0 ? 0 : bins;
    absl::StatusOr<ExactSum> volume = ExactSum::Decode(part.volume());
    if (!Fits(part, components, sent_bins) || !volume.ok()) return Damaged();
    GroupAggregate& group = aggregates[part.group()];
    group.count = part.count();
    group.volume = *std::move(volume);
    group.components.assign(components, {});
    for (size_t k = 0; k < components; ++k) {
      const int i = static_cast<int>(k);
      ComponentAggregate& c = group.components[k];
      absl::StatusOr<ExactSum> sum = ExactSum::Decode(part.sum(i));
      absl::StatusOr<ExactSum> integral = ExactSum::Decode(part.integral(i));
      if (!sum.ok() || !integral.ok() || part.not_finite(i) > part.count()) return Damaged();
      c.not_finite = part.not_finite(i);
      c.values = part.count() - part.not_finite(i);
      c.sum = *std::move(sum);
      c.integral = *std::move(integral);
      c.min = part.min(i);
      c.max = part.max(i);
      c.below = part.below(i);
      c.above = part.above(i);
      const auto begin = part.histogram().begin() + static_cast<std::ptrdiff_t>(k * sent_bins);
      c.histogram.assign(begin, begin + sent_bins);
    }
  }
  return aggregates;
}

void ToWire(const Aggregates& aggregates, const v1::AggregateRequest& question, const AskedColumn* column,
            v1::AggregateResponse& wire) {
  for (const auto& [name, group] : aggregates) {
    v1::Aggregate& out = *wire.add_groups();
    out.set_group(name);
    out.set_count(group.count);
    const bool any = std::any_of(group.components.begin(), group.components.end(),
                                 [](const ComponentAggregate& c) { return c.values > 0; });
    for (const ComponentAggregate& c : group.components) {
      out.add_not_finite(c.not_finite);
      AddHistogram(c.histogram, question.bins(), out.mutable_histogram());
      if (question.bins() > 0) {
        out.add_below(c.below);
        out.add_above(c.above);
      }
      if (question.integral()) out.add_integral(c.integral.Rounded());
      if (!any) continue;
      out.add_sum(c.sum.Rounded());
      out.add_min(c.min);
      out.add_max(c.max);
      if (column == nullptr || column->type != ValueType::kInt64) continue;
      if (const std::optional<int64_t> sum = c.sum.Integer()) out.set_integer_sum(*sum);
    }
    if (question.integral()) out.set_volume(group.volume.Rounded());
  }
}

}  // namespace ndmap::server

// SPDX-License-Identifier: GPL-3.0-or-later
// Aggregates of values: partial ones of blocks add up to the map's, in any order and division with the same
// bits.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "absl/types/span.h"
#include "core/attributes/exact_sum.h"
#include "core/geometry/surface.h"

namespace ndmap {

// Bins of equal width over [lo, hi]; none when `bins` is 0.
struct HistogramShape {
  static constexpr uint32_t kMaxBins = 65536;
  uint32_t bins = 0;
  double lo = 0;
  double hi = 0;

  // INVALID_ARGUMENT: too many bins, bounds that are not finite or not lo < hi.
  absl::Status Validate() const;
  // The bin of a value: bins of them; -1 below, `bins` above. The last bin has hi, too.
  int64_t BinOf(double value) const;
};

// What is known of one component of the values of a group.
struct ComponentAggregate {
  // Values that are infinite or no number; they are in nothing else.
  uint64_t not_finite = 0;
  // Finite values.
  uint64_t values = 0;
  ExactSum sum;
  // Of no values: +infinity and -infinity.
  double min;
  double max;
  // Values times volumes.
  ExactSum integral;
  std::vector<uint64_t> histogram;
  uint64_t below = 0;
  uint64_t above = 0;

  ComponentAggregate();
  void Add(double value, const HistogramShape& shape);
  void AddInteger(int64_t value, const HistogramShape& shape);
  void AddIntegral(double value, double volume);
  void Merge(const ComponentAggregate& other);

 private:
  // All but the sum.
  void Note(double value, const HistogramShape& shape);
};

struct GroupAggregate {
  uint64_t count = 0;
  std::vector<ComponentAggregate> components;
  ExactSum volume;

  void Merge(const GroupAggregate& other);
};

// By group. A name is "" or a number or a category; numbers stand in their own order.
struct GroupLess {
  bool operator()(const std::string& a, const std::string& b) const;
};
using Aggregates = std::map<std::string, GroupAggregate, GroupLess>;

// Into `sum`. INVALID_ARGUMENT when groups differ in components or bins.
absl::Status MergeInto(const Aggregates& part, Aggregates& sum);

// The volume of the trilinear hexahedron with these corners (x + 2y + 4z), with sign; its faces are bilinear,
// so that the children of a hexahedron add up to it.
double HexahedronVolume(const std::array<Point3, 8>& corners);

}  // namespace ndmap

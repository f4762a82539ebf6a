// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/geometry/compare_distance.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

#include <cmath>
#include <limits>

namespace ndmap {

int CompareDistance(const Point3& point, const Point3& a, const Point3& b) {
  if (a == b) return 0;
  // |a - p|^2 - |b - p|^2 = (a - b) (a + b - 2 p): far from the point nothing cancels that should not, and
  // coordinates that are equal count for nothing. What overflows or is too close to call is left to CGAL.
  long double difference = 0, magnitude = 0;
  for (size_t c = 0; c < 3; ++c) {
    const long double x = a[c], y = b[c], q = point[c];
    if (x == y) continue;
    difference += (x - y) * (x + y - 2 * q);
    magnitude += std::abs(x - y) * (std::abs(x) + std::abs(y) + 2 * std::abs(q));
  }
  const long double error = 16 * std::numeric_limits<long double>::epsilon() * magnitude;
  if (difference > error) return 1;
  if (difference < -error) return -1;
  using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
  const auto exact = [](const Point3& x) { return Kernel::Point_3(x[0], x[1], x[2]); };
  return static_cast<int>(CGAL::compare_distance(exact(point), exact(a), exact(b)));
}

}  // namespace ndmap

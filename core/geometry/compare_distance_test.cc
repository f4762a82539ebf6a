// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/geometry/compare_distance.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace ndmap {
namespace {

TEST(CompareDistanceTest, IsExactWhereSquaresOverflowVanishOrAreRounded) {
  const Point3 a = {0, 0, 0}, b = {1, 0, 0};
  for (double far : {1e16, 1e17, 1e153, 1e200, 1.7e308}) {
    EXPECT_GT(CompareDistance({far, 0, 0}, a, b), 0) << far;
    EXPECT_LT(CompareDistance({-far, 0, 0}, a, b), 0) << far;
    EXPECT_EQ(CompareDistance({0, far, 0}, {1, 0, 0}, {-1, 0, 0}), 0) << far;
    // The nearer one of two that are equally far along the axis.
    EXPECT_LT(CompareDistance({far, 0, 0}, {1, 0, 0}, {1, 1e-9, 0}), 0) << far;
  }
  const double least = std::numeric_limits<double>::denorm_min();
  EXPECT_LT(CompareDistance({0, 0, 0}, {least, 0, 0}, {2 * least, 0, 0}), 0);
  EXPECT_GT(CompareDistance({0, 0, 0}, {1e-200, 1e-200, 0}, {1e-200, 0, 0}), 0);
  // One unit in the last place, where the squares are the same number.
  const double next = std::nextafter(1.0, 2.0);
  EXPECT_LT(CompareDistance({1e8, 1, 1}, {next, 0, 0}, {1, 0, 0}), 0);
  EXPECT_GT(CompareDistance({1.7e308, 0, 0}, {-1.7e308, 0, 0}, {1.7e308, 0, 0}), 0);
}

TEST(CompareDistanceTest, AgreesWithSquaresOfWholeNumbers) {
  std::mt19937 random(7);
  std::uniform_int_distribution<int> whole(-1000, 1000);
  for (int i = 0; i < 10000; ++i) {
    const auto point = [&] { return Point3{1.0 * whole(random), 1.0 * whole(random), 1.0 * whole(random)}; };
    const Point3 p = point(), a = point(), b = point();
    double squared[2] = {0, 0};
    for (size_t c = 0; c < 3; ++c) {
      squared[0] += (a[c] - p[c]) * (a[c] - p[c]);
      squared[1] += (b[c] - p[c]) * (b[c] - p[c]);
    }
    const int expected = squared[0] < squared[1] ? -1 : squared[0] > squared[1] ? 1 : 0;
    EXPECT_EQ(CompareDistance(p, a, b), expected);
    EXPECT_EQ(CompareDistance(p, b, a), -expected);
    EXPECT_EQ(CompareDistance(p, a, a), 0);
  }
}

}  // namespace
}  // namespace ndmap

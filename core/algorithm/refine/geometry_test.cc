// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/algorithm/refine/geometry.h"

#include <algorithm>
#include <array>
#include <random>

#include "gtest/gtest.h"

namespace ndmap {
namespace {

TEST(VolumeCentre, IsTheMiddleOfABoxToTheBit) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> coordinate(-1, 1);
  for (int box = 0; box < 10000; ++box) {
    std::array<Point3, 2> side;
    for (Point3& p : side) p = {coordinate(random), coordinate(random) * 1e-3, coordinate(random) * 1e9};
    std::array<Point3, 8> corners;
    for (unsigned i = 0; i < 8; ++i) corners[i] = {side[i & 1][0], side[i >> 1 & 1][1], side[i >> 2][2]};
    ASSERT_EQ(VolumeCentre(corners), Midpoint(side[0], side[1])) << box;
  }
}

// Of the 48 ways to number the corners of a hexahedron x + 2y + 4z: axes in any order, each in either
// direction.
TEST(VolumeCentre, IsTheSameFromEveryCorner) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> coordinate(-1, 1);
  for (int i = 0; i < 1000; ++i) {
    std::array<Point3, 8> corners;
    for (Point3& p : corners) p = {coordinate(random), coordinate(random), coordinate(random)};
    const Point3 centre = VolumeCentre(corners);
    std::array<unsigned, 3> axes = {0, 1, 2};
    do {
      for (unsigned flip = 0; flip < 8; ++flip) {
        std::array<Point3, 8> turned;
        for (unsigned c = 0; c < 8; ++c) {
          unsigned to = 0;
          for (unsigned a = 0; a < 3; ++a) to |= (c >> a & 1) << axes[a];
          turned[to ^ flip] = corners[c];
        }
        ASSERT_EQ(VolumeCentre(turned), centre);
      }
    } while (std::next_permutation(axes.begin(), axes.end()));
  }
}

}  // namespace
}  // namespace ndmap

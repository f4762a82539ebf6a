// SPDX-License-Identifier: GPL-3.0-or-later
// Does a triangle meet a box? In doubles alone, with an answer only where rounding cannot have changed it.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "core/geometry/surface.h"

namespace ndmap {

enum class Meeting : uint8_t { kApart, kMeet, kUnsure };

// A triangle made ready to be compared with boxes near it. Two convex sets are apart if and only if they are
// so along one of these axes: the box's, the triangle's normal, and the products of an axis of the box and a
// side of the triangle (Gottschalk et al., 1996). Along the box's axes coordinates are compared, which is
// exact; along the others numbers are computed, and compared with a bound of their error.
//
// The bounds: u = 2^-53, S at least every coordinate's absolute value, E at least that of every coordinate of
// a side. Centre and half size of a box are off by uS at most, a corner relative to the centre by 3uS, a side
// by uE. So the sum of two products of a side's coordinate with one of a corner (at most 2S) or half size is
// off by less than 32 u E S, and for the normal, whose coordinates are at most 2 E^2 and off by less than
// 9 u E^2, that of three products by less than 256 u E^2 S. Four times as much is used here. Products that
// fall below the smallest normal number lose less than it; those in the normal are multiplied by S after
// that, but E is above 1e-75 and S below 1e75, so that the bound is far above what they lose.
class TriangleFilter {
 public:
  TriangleFilter(const Point3& a, const Point3& b, const Point3& c) : corners_{a, b, c} {
    for (int x = 0; x < 3; ++x) {
      lo_[x] = std::min({a[x], b[x], c[x]});
      hi_[x] = std::max({a[x], b[x], c[x]});
      largest_ = std::max({largest_, std::abs(lo_[x]), std::abs(hi_[x])});
      sides_[0][x] = b[x] - a[x];
      sides_[1][x] = c[x] - b[x];
      sides_[2][x] = a[x] - c[x];
    }
    double side = 0;
    for (int x = 0; x < 3; ++x) {
      const int y = (x + 1) % 3, z = (x + 2) % 3;
      normal_[x] = sides_[0][y] * sides_[1][z] - sides_[0][z] * sides_[1][y];
      side = std::max({side, std::abs(sides_[0][x]), std::abs(sides_[1][x]), std::abs(sides_[2][x])});
    }
    side_ = side;
  }

  // Whether the box of the triangle meets the box: exact.
  bool NearTo(const Box3& box) const {
    return lo_[0] <= box.hi[0] && hi_[0] >= box.lo[0] && lo_[1] <= box.hi[1] && hi_[1] >= box.lo[1] &&
           lo_[2] <= box.hi[2] && hi_[2] >= box.lo[2];
  }

  // Of a triangle with an area and a box that NearTo() accepts and that is not flat in any direction.
  Meeting With(const Box3& box) const {
    // Where a corner is in the box, no more is asked.
    for (const Point3& p : corners_) {
      if (p[0] >= box.lo[0] && p[0] <= box.hi[0] && p[1] >= box.lo[1] && p[1] <= box.hi[1] &&
          p[2] >= box.lo[2] && p[2] <= box.hi[2]) {
        return Meeting::kMeet;
      }
    }
    Point3 centre, half;
    double largest = largest_;
    for (int x = 0; x < 3; ++x) {
      centre[x] = (box.lo[x] + box.hi[x]) / 2;
      half[x] = (box.hi[x] - box.lo[x]) / 2;
      largest = std::max({largest, std::abs(box.lo[x]), std::abs(box.hi[x])});
    }
    // No product overflows, and of those with the longest side none is so small that doubles lack digits.
    if (!(largest < 1e75 && side_ > 1e-75)) return Meeting::kUnsure;
    std::array<Point3, 3> p;
    for (int k = 0; k < 3; ++k) {
      for (int x = 0; x < 3; ++x) p[k][x] = corners_[k][x] - centre[x];
    }
    const double along = normal_[0] * p[0][0] + normal_[1] * p[0][1] + normal_[2] * p[0][2];
    const double reach =
        half[0] * std::abs(normal_[0]) + half[1] * std::abs(normal_[1]) + half[2] * std::abs(normal_[2]);
    bool sure = true;
    if (Separates(std::abs(along) - reach, kNormalError * side_ * side_ * largest, &sure)) {
      return Meeting::kApart;
    }
    const double error = kSideError * side_ * largest;
    for (int k = 0; k < 3; ++k) {
      // Two corners are on the side and give the same number; the third is the one before it.
      const Point3 &on = p[k], &off = p[(k + 2) % 3], &side = sides_[k];
      for (int y = 0; y < 3; ++y) {
        const int z = y == 2 ? 0 : y + 1;
        // A side along the third axis gives no axis.
        if (side[y] == 0 && side[z] == 0) continue;
        const double s = side[z] * on[y] - side[y] * on[z];
        const double t = side[z] * off[y] - side[y] * off[z];
        const double r = half[y] * std::abs(side[z]) + half[z] * std::abs(side[y]);
        if (Separates(std::max(std::min(s, t), -std::max(s, t)) - r, error, &sure)) return Meeting::kApart;
      }
    }
    return sure ? Meeting::kMeet : Meeting::kUnsure;
  }

 private:
  static constexpr double kSideError = 0x1p-46;
  static constexpr double kNormalError = 0x1p-43;

  // Whether a gap is surely above 0. What is not a number is unsure.
  static bool Separates(double gap, double error, bool* sure) {
    error += std::numeric_limits<double>::min();
    if (gap > error) return true;
    if (!(gap < -error)) *sure = false;
    return false;
  }

  std::array<Point3, 3> corners_;
  Point3 lo_, hi_, normal_;
  std::array<Point3, 3> sides_;
  double largest_ = 0;
  double side_ = 0;
};

}  // namespace ndmap

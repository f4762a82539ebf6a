// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/geometry/surface_index.h"

#include <CGAL/Exact_rational.h>

#include <cmath>
#include <random>
#include <thread>
#include <vector>

#include "core/geometry/triangle_filter.h"
#include "core/io/sample_surface.h"
#include "gtest/gtest.h"

namespace ndmap {
namespace {

using Exact = CGAL::Exact_rational;
using Polygon = std::vector<std::array<Exact, 3>>;

// Whether a triangle meets a box, by clipping it at the six planes with exact numbers: no predicate in common
// with what is tested. A polygon may become a segment or a point on the way.
bool MeetsByClipping(const TriangleSurface& s, size_t triangle, const Box3& box) {
  Polygon polygon;
  for (uint32_t corner : s.triangles[triangle]) {
    const Point3& p = s.points[corner];
    polygon.push_back({Exact(p[0]), Exact(p[1]), Exact(p[2])});
  }
  for (int c = 0; c < 3; ++c) {
    for (int side : {-1, 1}) {
      const Exact bound = side < 0 ? box.lo[c] : box.hi[c];
      const auto outside = [&](const std::array<Exact, 3>& p) {
        return side < 0 ? p[c] < bound : p[c] > bound;
      };
      Polygon kept;
      for (size_t i = 0; i < polygon.size(); ++i) {
        const auto &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
        if (!outside(a)) kept.push_back(a);
        if (outside(a) == outside(b)) continue;
        const Exact t = (bound - a[c]) / (b[c] - a[c]);
        std::array<Exact, 3> cut;
        for (int x = 0; x < 3; ++x) cut[x] = a[x] + t * (b[x] - a[x]);
        cut[c] = bound;
        kept.push_back(cut);
      }
      polygon = std::move(kept);
    }
  }
  return !polygon.empty();
}

bool AnyMeetsByClipping(const TriangleSurface& s, const Box3& box) {
  for (size_t t = 0; t < s.triangles.size(); ++t) {
    const auto& [a, b, c] = s.triangles[t];
    bool apart = false;
    for (int x = 0; x < 3; ++x) {
      const double p = s.points[a][x], q = s.points[b][x], r = s.points[c][x];
      apart |= std::max({p, q, r}) < box.lo[x] || std::min({p, q, r}) > box.hi[x];
    }
    if (!apart && MeetsByClipping(s, t, box)) return true;
  }
  return false;
}

// Random small integers: touching at corners, edges and faces, flat boxes and degenerate triangles all occur
// often.
TEST(SurfaceIndexTest, AgreesWithExactClippingOnSmallIntegers) {
  std::mt19937 random(7);
  std::uniform_int_distribution<int> coordinate(-4, 4), size(0, 3);
  int met = 0, degenerate = 0;
  constexpr int kTriangles = 150, kBoxes = 60;
  for (int t = 0; t < kTriangles; ++t) {
    auto s = std::make_shared<TriangleSurface>();
    for (int i = 0; i < 3; ++i) {
      s->points.push_back({1.0 * coordinate(random), 1.0 * coordinate(random), 1.0 * coordinate(random)});
    }
    if (t % 5 == 0) {  // The third corner on the line of the others, or on one of them.
      ++degenerate;
      for (int x = 0; x < 3; ++x)
        s->points[2][x] = s->points[0][x] + (t % 4 - 1) * (s->points[1][x] - s->points[0][x]);
    }
    s->triangles.push_back({0, 1, 2});
    const SurfaceIndex index(s);
    for (int b = 0; b < kBoxes; ++b) {
      Box3 box;
      for (int c = 0; c < 3; ++c) {
        box.lo[c] = coordinate(random) / 2.0;
        box.hi[c] = box.lo[c] + size(random) / 2.0;
      }
      const bool expected = MeetsByClipping(*s, 0, box);
      ASSERT_EQ(index.Meets(box), expected)
          << "triangle " << testing::PrintToString(s->points) << " box " << testing::PrintToString(box.lo)
          << testing::PrintToString(box.hi);
      met += expected;
    }
  }
  EXPECT_GT(met, kTriangles * kBoxes / 20);
  EXPECT_GT(degenerate, 20);
}

// Eight boxes at once are answered as each alone: boxes that lie together, as children do, and the same box
// twice.
TEST(SurfaceIndexTest, EightBoxesAreAnsweredAsEachAlone) {
  const auto s = std::make_shared<TriangleSurface>(*MakeSample("knot", {.triangles = 3000, .scale = 1}));
  const SurfaceIndex index(s);
  std::mt19937 random(11);
  std::uniform_real_distribution<double> coordinate(-1.5, 1.5);
  int met = 0, asked = 0;
  for (int i = 0; i < 3000; ++i) {
    const double size = std::exp2(-1 - i % 8);
    const Point3 at = {coordinate(random), coordinate(random), coordinate(random)};
    std::array<Box3, 8> boxes;
    for (unsigned c = 0; c < 8; ++c) {
      for (int x = 0; x < 3; ++x) {
        boxes[c].lo[x] = at[x] + (c >> x & 1) * size;
        boxes[c].hi[x] = boxes[c].lo[x] + size;
      }
    }
    if (i % 5 == 0) boxes[3] = boxes[4];
    const std::array<bool, 8> each = index.MeetEach(boxes);
    for (unsigned c = 0; c < 8; ++c) {
      ASSERT_EQ(each[c], index.Meets(boxes[c])) << "boxes " << i << ", " << c;
      if (i % 50 == 0) {
        ASSERT_EQ(each[c], AnyMeetsByClipping(*s, boxes[c])) << "boxes " << i << ", " << c;
      }
      met += each[c];
      ++asked;
    }
  }
  EXPECT_GT(met, asked / 20);
  EXPECT_LT(met, asked * 19 / 20);
}

// Triangles on a grid of whole numbers and the eight children of a box on it: they touch in corners, edges
// and faces all the time. "Touch" is meant literally: they meet, and no box a little smaller does.
TEST(SurfaceIndexTest, ChildrenThatOnlyTouchAreToldExactly) {
  std::mt19937 random(13);
  std::uniform_int_distribution<int> coordinate(-6, 6), corner(-6, 4);
  int touched = 0, met = 0, apart = 0;
  constexpr int kSurfaces = 600;
  for (int t = 0; t < kSurfaces; ++t) {
    // Powers of two keep what touches touching; also beside the origin, where fewer digits are left.
    const double scale = std::exp2(t % 5 * 10 - 20), offset = t % 3 == 0 ? 4096 * scale : 0;
    auto s = std::make_shared<TriangleSurface>();
    for (uint32_t i = 0; i < 12; ++i) {
      s->points.push_back({});
      for (double& x : s->points.back()) x = offset + scale * coordinate(random);
      if (i % 3 == 2) s->triangles.push_back({i - 2, i - 1, i});
    }
    const SurfaceIndex index(s);
    const double size = scale * (1 + t % 2);
    Point3 at;
    for (double& x : at) x = offset + scale * corner(random);
    std::array<Box3, 8> boxes, smaller;
    for (unsigned c = 0; c < 8; ++c) {
      for (int x = 0; x < 3; ++x) {
        boxes[c].lo[x] = at[x] + (c >> x & 1) * size;
        boxes[c].hi[x] = boxes[c].lo[x] + size;
        smaller[c].lo[x] = std::nextafter(boxes[c].lo[x], boxes[c].hi[x]);
        smaller[c].hi[x] = std::nextafter(boxes[c].hi[x], boxes[c].lo[x]);
      }
    }
    const std::array<bool, 8> each = index.MeetEach(boxes), each_smaller = index.MeetEach(smaller);
    for (unsigned c = 0; c < 8; ++c) {
      const bool expected = AnyMeetsByClipping(*s, boxes[c]);
      const bool expected_smaller = AnyMeetsByClipping(*s, smaller[c]);
      ASSERT_EQ(each[c], expected) << "surface " << t << ", box " << c;
      ASSERT_EQ(index.Meets(boxes[c]), expected) << "surface " << t << ", box " << c;
      ASSERT_EQ(each_smaller[c], expected_smaller) << "surface " << t << ", box " << c;
      touched += expected && !expected_smaller;
      met += expected_smaller;
      apart += !expected;
    }
  }
  EXPECT_GT(touched, 200);
  EXPECT_GT(met, 200);
  EXPECT_GT(apart, 200);
}

// Coordinates so small or so large that products of them leave the range of doubles, or are rounded to 0.
TEST(SurfaceIndexTest, ExactWhereProductsUnderflowOrOverflow) {
  std::mt19937 random(17);
  std::uniform_int_distribution<int> coordinate(-3, 3);
  int met = 0, apart = 0;
  for (int t = 0; t < 400; ++t) {
    // The box larger than the triangle by up to 2^600, and in many cases far from its plane for its size.
    const double scale = std::exp2(std::array<int, 5>{-560, -530, -250, 240, 400}[t % 5]);
    const double box_scale = scale * std::exp2(t % 4 * 200);
    TriangleSurface s;
    for (uint32_t i = 0; i < 3; ++i) {
      s.points.push_back({});
      for (double& x : s.points.back()) x = scale * (coordinate(random) + coordinate(random) / 1024.0);
    }
    s.triangles.push_back({0, 1, 2});
    Box3 box;
    for (int x = 0; x < 3; ++x) {
      // A corner at a point of the triangle's box, with whole numbers of the triangle's scale.
      const double near = scale * (coordinate(random) / 2.0),
                   far = box_scale * (1 + coordinate(random) / 8.0);
      const bool below = (random() & 1) != 0;
      box.lo[x] = below ? near - far : near;
      box.hi[x] = below ? near : near + far;
    }
    const bool expected = AnyMeetsByClipping(s, box);
    const SurfaceIndex index(std::make_shared<TriangleSurface>(s));
    ASSERT_EQ(index.Meets(box), expected) << t << " triangle " << testing::PrintToString(s.points) << " box "
                                          << testing::PrintToString(box.lo) << testing::PrintToString(box.hi);
    ++(expected ? met : apart);
  }
  EXPECT_GT(met, 50);
  EXPECT_GT(apart, 50);
}

// Boxes a corner of which was rounded to a triangle's plane or sides, or is some units in the last place
// beside them: the doubles alone never say what exact numbers do not, and say something of most boxes.
TEST(TriangleFilterTest, WhatIsSureIsTrueAlsoWhereBoxesNearlyTouch) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(0, 1);
  int sure = 0, unsure = 0, met = 0;
  constexpr int kTriangles = 400, kBoxes = 40;
  for (int t = 0; t < kTriangles; ++t) {
    // Also far from the origin, tiny, and along the axes.
    const double offset = t % 4 == 0 ? 1000 : t % 4 == 1 ? 1 : 0, scale = std::exp2(-(t % 7) * 3);
    TriangleSurface s;
    for (int i = 0; i < 3; ++i) {
      s.points.push_back(
          {offset + scale * unit(random), offset + scale * unit(random), offset + scale * unit(random)});
    }
    if (t % 3 == 0) s.points[1][t % 9 / 3] = s.points[0][t % 9 / 3];
    if (t % 9 == 1) s.points[2][0] = s.points[1][0] = s.points[0][0];
    s.triangles.push_back({0, 1, 2});
    const TriangleFilter filter(s.points[0], s.points[1], s.points[2]);
    for (int b = 0; b < kBoxes; ++b) {
      // A point of the triangle, or of a side.
      double u = unit(random), v = b % 3 == 0 ? 0 : unit(random);
      if (u + v > 1) u = 1 - u, v = 1 - v;
      Box3 box;
      for (int x = 0; x < 3; ++x) {
        const double p =
            s.points[0][x] + u * (s.points[1][x] - s.points[0][x]) + v * (s.points[2][x] - s.points[0][x]);
        double near = p;
        for (int ulps = b % 5; ulps > 0; --ulps) near = std::nextafter(near, b % 2 == 0 ? 1e9 : -1e9);
        const double far = scale * (0.01 + unit(random));
        const bool below = (random() & 1) != 0;
        box.lo[x] = below ? near - far : near;
        box.hi[x] = below ? near : near + far;
        if (!(box.lo[x] < box.hi[x])) box.hi[x] = std::nextafter(box.lo[x], 1e9);
      }
      const bool expected = MeetsByClipping(s, 0, box);
      met += expected;
      if (!filter.NearTo(box)) {
        ASSERT_FALSE(expected) << "triangle " << t << " box " << b;
        continue;
      }
      const Meeting meeting = filter.With(box);
      ++(meeting == Meeting::kUnsure ? unsure : sure);
      if (meeting == Meeting::kUnsure) continue;
      ASSERT_EQ(meeting == Meeting::kMeet, expected) << "triangle " << t << " box " << b;
    }
  }
  EXPECT_GT(sure, 1000);
  EXPECT_GT(unsure, 1000);
  EXPECT_GT(met, 1000);
}

// A box whose corner lies in a slanted plane, or misses it by one unit in the last place.
TEST(SurfaceIndexTest, TouchingIsExact) {
  auto s = std::make_shared<TriangleSurface>();
  s->points = {{3, 0, 0}, {0, 3, 0}, {0, 0, 3}};
  s->triangles = {{0, 1, 2}};
  const SurfaceIndex index(s);
  const double below = std::nextafter(1.0, 0.0);
  EXPECT_TRUE(index.Meets({{0, 0, 0}, {1, 1, 1}}));
  EXPECT_FALSE(index.Meets({{0, 0, 0}, {1, 1, below}}));
  EXPECT_TRUE(index.Meets({{1, 1, 1}, {1, 1, 1}}));
  EXPECT_FALSE(index.Meets({{below, 1, 1}, {below, 1, 1}}));
  EXPECT_TRUE(index.Meets({{3, 0, 0}, {4, 1, 1}}));
  EXPECT_FALSE(index.Meets({{std::nextafter(3.0, 4.0), 0, 0}, {4, 1, 1}}));
}

TEST(SurfaceIndexTest, ARegionGivesTheSameAnswersInIt) {
  const auto s = std::make_shared<TriangleSurface>(*MakeSample("knot", {.triangles = 4000, .scale = 1}));
  const Box3 region{{-0.5, -2, -0.25}, {0.75, 0, 0.5}};
  const SurfaceIndex all(s), part(s, region);
  EXPECT_EQ(all.size(), s->triangles.size());
  EXPECT_LT(part.size(), all.size() / 2);
  EXPECT_GT(part.size(), 0u);
  int met = 0;
  for (int i = 0; i < 20; ++i) {
    for (int j = 0; j < 20; ++j) {
      for (int k = 0; k < 20; ++k) {
        Box3 box;
        const std::array<int, 3> at = {i, j, k};
        for (int c = 0; c < 3; ++c) {
          box.lo[c] = region.lo[c] + (region.hi[c] - region.lo[c]) * at[c] / 20;
          box.hi[c] = region.lo[c] + (region.hi[c] - region.lo[c]) * (at[c] + 1) / 20;
        }
        if (i == 7 && j >= 10) {
          EXPECT_EQ(all.Meets(box), AnyMeetsByClipping(*s, box));
        }
        ASSERT_EQ(part.Meets(box), all.Meets(box));
        met += all.Meets(box);
      }
    }
  }
  EXPECT_GT(met, 100);
}

TEST(SurfaceIndexTest, NothingMeetsAnEmptyRegion) {
  const auto s = std::make_shared<TriangleSurface>(*MakeSample("sphere", {.triangles = 100, .scale = 1}));
  const SurfaceIndex none(s, Box3{{5, 5, 5}, {6, 6, 6}});
  EXPECT_EQ(none.size(), 0u);
  EXPECT_FALSE(none.Meets({{-9, -9, -9}, {9, 9, 9}}));
}

TEST(SurfaceIndexTest, ThreadsReadTogether) {
  const auto s = std::make_shared<TriangleSurface>(*MakeSample("sphere", {.triangles = 5000, .scale = 1}));
  const SurfaceIndex index(s);
  std::array<int, 4> met{};
  std::vector<std::thread> threads;
  for (int& count : met) {
    threads.emplace_back([&index, &count] {
      for (int i = 0; i < 2000; ++i) {
        const double x = -1 + i / 1000.0;
        count += index.Meets({{x, -0.1, -0.1}, {x + 0.01, 0.1, 0.1}});
      }
    });
  }
  for (std::thread& t : threads) t.join();
  EXPECT_GT(met[0], 10);
  for (int count : met) EXPECT_EQ(count, met[0]);
}

}  // namespace
}  // namespace ndmap

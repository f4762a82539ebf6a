// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/geometry/surface_index.h"

#include <CGAL/Exact_rational.h>

#include <random>
#include <thread>
#include <vector>

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

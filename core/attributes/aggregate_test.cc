// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/attributes/aggregate.h"

#include <gtest/gtest.h>

#include <limits>

namespace ndmap {
namespace {

TEST(Histogram, EveryValueIsInOneBin) {
  const HistogramShape shape{4, 0, 1};
  ASSERT_TRUE(shape.Validate().ok());
  EXPECT_EQ(shape.BinOf(-0.001), -1);
  EXPECT_EQ(shape.BinOf(0), 0);
  EXPECT_EQ(shape.BinOf(0.25), 1);
  EXPECT_EQ(shape.BinOf(std::nextafter(1.0, 0.0)), 3);
  EXPECT_EQ(shape.BinOf(1), 3);
  EXPECT_EQ(shape.BinOf(1.001), 4);
}

TEST(Histogram, RefusesBoundsThatAreNone) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE((HistogramShape{0, nan, nan}).Validate().ok());
  EXPECT_FALSE((HistogramShape{1, 1, 1}).Validate().ok());
  EXPECT_FALSE((HistogramShape{1, 0, nan}).Validate().ok());
  EXPECT_FALSE((HistogramShape{1, -1.7e308, 1.7e308}).Validate().ok());
  EXPECT_FALSE((HistogramShape{HistogramShape::kMaxBins + 1, 0, 1}).Validate().ok());
}

TEST(ComponentAggregate, LeavesOutWhatIsNoNumber) {
  ComponentAggregate a;
  const HistogramShape shape{2, 0, 10};
  for (double v : {1.0, std::numeric_limits<double>::infinity(), 9.0, std::nan(""), 11.0}) a.Add(v, shape);
  EXPECT_EQ(a.not_finite, 2u);
  EXPECT_EQ(a.values, 3u);
  EXPECT_EQ(a.sum.Rounded(), 21);
  EXPECT_EQ(a.min, 1);
  EXPECT_EQ(a.max, 11);
  EXPECT_EQ(a.histogram, (std::vector<uint64_t>{1, 1}));
  EXPECT_EQ(a.above, 1u);
}

TEST(Aggregates, PartsAddUp) {
  Aggregates parts[2], sum;
  const HistogramShape shape{2, 0, 4};
  for (int i = 0; i < 6; ++i) {
    GroupAggregate& group = parts[i % 2][i < 4 ? "10" : "9"];
    group.components.resize(1);
    ++group.count;
    group.components[0].AddInteger(i, shape);
  }
  ASSERT_TRUE(MergeInto(parts[0], sum).ok());
  ASSERT_TRUE(MergeInto(parts[1], sum).ok());
  ASSERT_EQ(sum.size(), 2u);
  // Numbers in their own order.
  EXPECT_EQ(sum.begin()->first, "9");
  EXPECT_EQ(sum["10"].count, 4u);
  EXPECT_EQ(sum["10"].components[0].sum.Integer(), 6);
  EXPECT_EQ(sum["10"].components[0].histogram, (std::vector<uint64_t>{2, 2}));
  EXPECT_EQ(sum["9"].components[0].sum.Integer(), 9);
  EXPECT_EQ(sum["9"].components[0].above, 1u);
  Aggregates wrong;
  wrong["9"].components.resize(3);
  EXPECT_FALSE(MergeInto(wrong, sum).ok());
}

TEST(HexahedronVolume, OfBoxesAndPrisms) {
  std::array<Point3, 8> corners;
  for (unsigned c = 0; c < 8; ++c) corners[c] = {2.0 * (c & 1), 3.0 * (c >> 1 & 1), 4.0 * (c >> 2)};
  EXPECT_EQ(HexahedronVolume(corners), 24);
  // One edge of the top moved in: a frustum of slanted faces, 2 x 3 below, 1 x 3 above.
  corners[5][0] = corners[7][0] = 1;
  EXPECT_DOUBLE_EQ(HexahedronVolume(corners), 18);
  std::swap(corners[0], corners[1]);
  std::swap(corners[2], corners[3]);
  std::swap(corners[4], corners[5]);
  std::swap(corners[6], corners[7]);
  EXPECT_DOUBLE_EQ(HexahedronVolume(corners), -18);
}

}  // namespace
}  // namespace ndmap

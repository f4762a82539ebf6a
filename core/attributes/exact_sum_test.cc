// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/attributes/exact_sum.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace ndmap {
namespace {

using Limits = std::numeric_limits<double>;

double Sum(std::initializer_list<double> values) {
  ExactSum sum;
  for (double v : values) sum.Add(v);
  return sum.Rounded();
}

TEST(ExactSum, OfOneValueIsTheValue) {
  std::mt19937_64 random(1);
  for (double v : {0.0, 1.0, -1.5, Limits::denorm_min(), -Limits::denorm_min(), Limits::min(), Limits::max(),
                   -Limits::max(), 0.1, 4e-320}) {
    EXPECT_EQ(Sum({v}), v);
  }
  for (int i = 0; i < 10000;) {
    const double v = std::bit_cast<double>(random());
    if (!std::isfinite(v)) continue;
    EXPECT_EQ(Sum({v}), v);
    ++i;
  }
}

TEST(ExactSum, LosesNothing) {
  EXPECT_EQ(Sum({1e300, 1, -1e300}), 1);
  EXPECT_EQ(Sum({Limits::max(), Limits::denorm_min(), -Limits::max()}), Limits::denorm_min());
  EXPECT_EQ(Sum({Limits::max(), Limits::max()}), Limits::infinity());
  EXPECT_EQ(Sum({-Limits::max(), -Limits::max(), Limits::max()}), -Limits::max());
}

TEST(ExactSum, RoundsToNearestHalvesToEven) {
  const double ulp = std::ldexp(1.0, -52);
  EXPECT_EQ(Sum({1, ulp / 2}), 1);
  EXPECT_EQ(Sum({1 + ulp, ulp / 2}), 1 + 2 * ulp);
  EXPECT_EQ(Sum({1, ulp / 2, Limits::denorm_min()}), 1 + ulp);
  EXPECT_EQ(Sum({-1, -ulp / 2, -Limits::denorm_min()}), -1 - ulp);
  // Two values: the hardware rounds their exact sum, too.
  std::mt19937_64 random(2);
  for (int i = 0; i < 10000; ++i) {
    const double a = std::ldexp(static_cast<double>(random()) - 9e18, static_cast<int>(random() % 90));
    const double b = std::ldexp(static_cast<double>(random()) - 9e18, static_cast<int>(random() % 90));
    EXPECT_EQ(Sum({a, b}), a + b);
  }
}

TEST(ExactSum, SameBitsForAnyOrderAndDivision) {
  std::mt19937_64 random(3);
  std::vector<double> values;
  for (int i = 0; i < 2000; ++i) {
    values.push_back(
        std::ldexp(static_cast<double>(random()) - 9e18, static_cast<int>(random() % 200) - 100));
  }
  ExactSum whole;
  for (double v : values) whole.Add(v);
  for (int round = 0; round < 5; ++round) {
    std::shuffle(values.begin(), values.end(), random);
    ExactSum parts[3];
    for (size_t i = 0; i < values.size(); ++i) parts[random() % 3].Add(values[i]);
    ExactSum sum;
    for (const ExactSum& part : parts) {
      auto decoded = ExactSum::Decode(part.Encode());
      ASSERT_TRUE(decoded.ok()) << decoded.status();
      sum.Add(*decoded);
    }
    EXPECT_EQ(std::bit_cast<uint64_t>(sum.Rounded()), std::bit_cast<uint64_t>(whole.Rounded()));
  }
}

TEST(ExactSum, Integers) {
  ExactSum sum;
  const int64_t most = std::numeric_limits<int64_t>::max();
  sum.Add(most);
  EXPECT_EQ(sum.Integer(), most);
  sum.Add(int64_t{1});
  EXPECT_EQ(sum.Integer(), std::nullopt);
  EXPECT_EQ(sum.Rounded(), 9223372036854775808.0);
  sum.Add(int64_t{-2});
  EXPECT_EQ(sum.Integer(), most - 1);
  sum.Add(0.5);
  EXPECT_EQ(sum.Integer(), std::nullopt);
  EXPECT_EQ(ExactSum().Integer(), 0);
}

TEST(ExactSum, RefusesWhatItDidNotEncode) {
  EXPECT_EQ(ExactSum::Decode("").status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(ExactSum::Decode("\2x").status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(ExactSum::Decode(std::string(100000, '\1')).status().code(), absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace ndmap

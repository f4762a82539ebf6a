// SPDX-License-Identifier: GPL-3.0-or-later
#include <string>
#include <tuple>

#include "absl/strings/str_cat.h"
#include "gtest/gtest.h"
#include "tests/property/navigate_case.h"

namespace ndmap {
namespace {

// 100 seeds for each n, in groups that run in parallel; tests/property/navigate_1000.sh runs more.
class NavigatePropertyTest : public testing::TestWithParam<std::tuple<unsigned, uint64_t>> {};

TEST_P(NavigatePropertyTest, EveryQuestionIsAnsweredAsOnTheWholeMap) {
  const auto [n, from] = GetParam();
  for (uint64_t seed = from; seed < from + 50; ++seed) {
    const absl::Status status = RunNavigateCase(n, StorageKind::kFlat, seed);
    EXPECT_TRUE(status.ok()) << status;
  }
}
INSTANTIATE_TEST_SUITE_P(Seeds, NavigatePropertyTest,
                         testing::Combine(testing::Values(2u, 3u, 4u), testing::Values(0u, 50u)),
                         [](const auto& info) {
                           return absl::StrCat("N", std::get<0>(info.param), "From", std::get<1>(info.param));
                         });

// Both storages, by some seeds.
TEST(NavigateStorageTest, CgalsOwnGivesTheSame) {
  for (unsigned n : {2u, 3u, 4u}) {
    for (uint64_t seed = 0; seed < 5; ++seed) {
      const absl::Status status = RunNavigateCase(n, StorageKind::kCgal, seed);
      EXPECT_TRUE(status.ok()) << status;
    }
  }
}

}  // namespace
}  // namespace ndmap

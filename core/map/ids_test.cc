// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/map/ids.h"

#include <vector>

#include "gtest/gtest.h"

namespace ndmap {
namespace {

TEST(CellIdTest, PathOfAnyDepthReadsBack) {
  for (uint64_t initial : {uint64_t{0}, uint64_t{12}, CellId::kMaxInitial}) {
    CellId id = CellId::Initial(initial);
    std::vector<unsigned> path;
    for (int level = 1; level <= CellId::kMaxLevel; ++level) {
      const CellId parent = id;
      path.push_back((level * 5 + 3) % 8);
      id = id.Child(path.back());
      ASSERT_EQ(id.level(), level);
      ASSERT_EQ(id.initial(), initial);
      ASSERT_EQ(id.Parent(), parent);
      for (int i = 1; i <= level; ++i)
        ASSERT_EQ(id.digit(i), path[i - 1]) << "level " << level << " digit " << i;
    }
  }
}

TEST(CellIdTest, TextForm) {
  EXPECT_EQ(CellId::Initial(12).ToString(), "h12");
  EXPECT_EQ(CellId::Initial(12).Child(0).Child(3).Child(7).ToString(), "h12/0.3.7");
}

TEST(CellIdTest, ParseReadsTextFormAndRefusesOthers) {
  for (const char* text : {"h0", "h12", "h12/0", "h12/0.3.7"}) {
    auto id = CellId::Parse(text);
    ASSERT_TRUE(id.ok()) << id.status();
    EXPECT_EQ(id->ToString(), text);
  }
  for (const char* text : {"", "12", "h", "h-1", "h1/", "h1/8", "h1/0.", "h1/07", "h99999999999"}) {
    EXPECT_FALSE(CellId::Parse(text).ok()) << text;
  }
}

TEST(DigestTest, CarriesAcrossWords) {
  Digest sum{0, ~uint64_t{0}};
  sum.Add({1, 1});
  EXPECT_EQ(sum, (Digest{2, 0}));
  EXPECT_EQ(sum.ToString(), "00000000000000020000000000000000");
}

}  // namespace
}  // namespace ndmap

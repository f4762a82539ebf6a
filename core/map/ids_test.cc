// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/map/ids.h"

#include <vector>

#include "absl/strings/str_cat.h"
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
  for (const char* text :
       {"v0:0", "v12/0.3.7:7", "e12:11", "e3/4:0", "f12/0:5", "v12#536870911", "e1#0", "f7#3", "h2#9"}) {
    auto id = CellId::Parse(text);
    ASSERT_TRUE(id.ok()) << id.status();
    EXPECT_EQ(id->ToString(), text);
    EXPECT_TRUE(id->IsWellFormed());
  }
  EXPECT_EQ(CellId::Parse("f12").value(), CellId::Polygon(12));
  for (const char* text : {"v1", "e1", "f", "f1/0", "v1:8", "e1:12", "f1:6", "f1:", "h1:3", "v1/0#2",
                           "v1#536870912", "v1#", "x1:2", "v :1", "v1: 1", "v+1:1"}) {
    EXPECT_FALSE(CellId::Parse(text).ok()) << text;
  }
  for (const char* text : {"", "12", "h", "h-1", "h1/", "h1/8", "h1/0.", "h1/07", "h99999999999"}) {
    EXPECT_FALSE(CellId::Parse(text).ok()) << text;
  }
}

TEST(CellIdTest, EveryKindOfIdIsDistinctAndReadsBack) {
  absl::flat_hash_set<CellId> all;
  size_t made = 0;
  CellId h = CellId::Initial(CellId::kMaxInitial);
  for (int level = 0;; ++level) {
    for (unsigned part = 0; part <= CellId::kWholePart; ++part) {
      const CellId id = CellId::Part(h, part);
      all.insert(id);
      ++made;
      ASSERT_TRUE(id.IsWellFormed());
      ASSERT_EQ(id.level(), level);
      ASSERT_EQ(id.initial(), CellId::kMaxInitial);
      ASSERT_EQ(id.is_cell(), part == CellId::kWholePart);
      ASSERT_EQ(id.is_part(), part != CellId::kWholePart);
      if (id.is_part()) {
        ASSERT_EQ(id.part(), part);
        ASSERT_EQ(id.hexahedron(), h);
      }
      const auto read = CellId::Parse(id.ToString());
      ASSERT_TRUE(read.ok()) << read.status();
      ASSERT_EQ(*read, id);
    }
    if (level == CellId::kMaxLevel) break;
    h = h.Child((level * 5 + 3) % 8);
  }
  for (unsigned dimension = 0; dimension <= 3; ++dimension) {
    for (uint32_t rank : {uint32_t{0}, uint32_t{31}, CellId::kMaxRank}) {
      const CellId id = CellId::Rank(CellId::kMaxInitial, dimension, rank);
      all.insert(id);
      ++made;
      ASSERT_TRUE(id.IsWellFormed() && id.is_rank());
      ASSERT_EQ(id.dimension(), dimension);
      ASSERT_EQ(id.rank(), rank);
    }
  }
  for (uint64_t number : {uint64_t{0}, uint64_t{12}, CellId::kMaxInitial}) {
    const CellId id = CellId::Polygon(number);
    all.insert(id);
    ++made;
    ASSERT_TRUE(id.IsWellFormed() && id.is_polygon() && id.is_cell() && !id.is_rank() && !id.is_part());
    ASSERT_EQ(id.dimension(), 2u);
    ASSERT_EQ(id.level(), 0);
    ASSERT_EQ(id.initial(), number);
    ASSERT_EQ(id.ToString(), absl::StrCat("f", number));
    ASSERT_EQ(CellId::Parse(id.ToString()).value(), id);
  }
  EXPECT_EQ(all.size(), made);
  EXPECT_FALSE(CellId().IsWellFormed());
  EXPECT_FALSE(CellId::FromWords(0, 3).IsWellFormed());
  EXPECT_FALSE(CellId::FromWords(0, 4).IsWellFormed());
}

TEST(DigestTest, CarriesAcrossWords) {
  Digest sum{0, ~uint64_t{0}};
  sum.Add({1, 1});
  EXPECT_EQ(sum, (Digest{2, 0}));
  EXPECT_EQ(sum.ToString(), "00000000000000020000000000000000");
}

}  // namespace
}  // namespace ndmap

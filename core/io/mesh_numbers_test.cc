// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/io/mesh_numbers.h"

#include <set>

#include "gtest/gtest.h"

namespace ndmap {
namespace {

CellId Id(const char* text) { return CellId::Parse(text).value(); }

TEST(MeshNumbersTest, CellsAndBack) {
  const MeshNumbers numbers(12);
  std::set<int64_t> seen;
  for (const char* text : {"h0", "h0/7", "h11", "h11/3.0.7.7", "h5/1", "h5/1.0"}) {
    const std::optional<int64_t> number = numbers.OfCell(Id(text));
    ASSERT_TRUE(number.has_value()) << text;
    EXPECT_EQ(numbers.Cell(*number, Id(text).level()), Id(text)) << text;
    seen.insert(*number);
  }
  // The first part of a hexahedron has its number; the level tells them apart.
  EXPECT_EQ(seen.size(), 5u);
  const int64_t fine = *numbers.OfCell(Id("h5/1.3"));
  EXPECT_FALSE(numbers.Cell(fine, 1).has_value());
  EXPECT_FALSE(numbers.Cell(fine, -1).has_value());
  EXPECT_FALSE(numbers.Cell(fine, numbers.finest_level() + 1).has_value());
  EXPECT_FALSE(numbers.Cell(-1, 0).has_value());
  EXPECT_FALSE(numbers.Cell(int64_t{12} << 3 * numbers.finest_level(), 0).has_value());
  EXPECT_FALSE(numbers.OfCell(Id("h12")).has_value());
  EXPECT_FALSE(numbers.OfCell(Id("v0:0")).has_value());
}

TEST(MeshNumbersTest, VerticesAndBack) {
  const MeshNumbers numbers(12);
  std::set<int64_t> seen;
  for (const char* text : {"v0:0", "v0:7", "v11:7", "v1/0:7", "v1/1:3", "v3#0", "v3#5", "v11#4"}) {
    const std::optional<int64_t> number = numbers.OfVertex(Id(text));
    ASSERT_TRUE(number.has_value()) << text;
    EXPECT_TRUE(seen.insert(*number).second) << text;
    EXPECT_EQ(numbers.Vertex(*number), Id(text)) << text;
  }
  for (const char* text : {"v12:0", "v12#0", "v3#8", "e3#1", "h3", "e0:1"}) {
    EXPECT_FALSE(numbers.OfVertex(Id(text)).has_value()) << text;
  }
  EXPECT_FALSE(numbers.Vertex(-1).has_value());
  EXPECT_FALSE(numbers.Vertex(*numbers.OfVertex(Id("v11#5")) + 3).has_value());
}

TEST(MeshNumbersTest, ReachAsFarAsTheyHaveRoom) {
  for (uint64_t cells : {uint64_t{1}, uint64_t{12}, uint64_t{1} << 20, CellId::kMaxInitial + 1}) {
    const MeshNumbers numbers(cells);
    EXPECT_GE(numbers.finest_level(), 9) << cells;
    CellId last = CellId::Initial(cells - 1);
    for (int level = 0; level < numbers.finest_level(); ++level) last = last.Child(7);
    EXPECT_GT(*numbers.OfCell(last), 0);
    EXPECT_GT(*numbers.OfVertex(CellId::Rank(cells - 1, 0, 7)), *numbers.OfVertex(CellId::Part(last, 13)));
    if (numbers.finest_level() == CellId::kMaxLevel) continue;
    EXPECT_FALSE(numbers.OfCell(last.Child(0)).has_value());
    // The middle of an edge of the finest hexahedra is no place.
    EXPECT_FALSE(numbers.OfVertex(CellId::Part(last.Child(0), 1)).has_value());
  }
}

}  // namespace
}  // namespace ndmap

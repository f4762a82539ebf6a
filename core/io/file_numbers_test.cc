// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/io/file_numbers.h"

#include <set>

#include "gtest/gtest.h"

namespace ndmap {
namespace {

GridShape Grid(uint32_t x, uint32_t y, uint32_t z) {
  GridShape grid;
  grid.cells = {x, y, z};
  grid.hi = {1.0 * x, 1.0 * y, 1.0 * z};
  return grid;
}

TEST(FileNumbersTest, HexahedraAndBack) {
  const FileNumbers numbers(Grid(3, 2, 2));
  std::set<int64_t> seen;
  for (const char* text : {"h0", "h0/7", "h11", "h11/3.0.7.7", "h5/1", "h5/1.0"}) {
    const CellId id = CellId::Parse(text).value();
    const int64_t number = numbers.OfHexahedron(id);
    EXPECT_EQ(numbers.Hexahedron(number, id.level()), id) << text;
    seen.insert(number);
  }
  // The first part of a hexahedron has its number; the level tells them apart.
  EXPECT_EQ(seen.size(), 5u);
  const int64_t fine = numbers.OfHexahedron(CellId::Parse("h5/1.3").value());
  EXPECT_FALSE(numbers.Hexahedron(fine, 1).has_value());
  EXPECT_FALSE(numbers.Hexahedron(fine, -1).has_value());
  EXPECT_FALSE(numbers.Hexahedron(fine, numbers.finest_level() + 1).has_value());
  EXPECT_FALSE(numbers.Hexahedron(-1, 0).has_value());
  EXPECT_FALSE(numbers.Hexahedron(int64_t{12} << 3 * numbers.finest_level(), 0).has_value());
}

TEST(FileNumbersTest, VerticesAndBack) {
  const FileNumbers numbers(Grid(3, 2, 2));
  const int64_t one = int64_t{1} << numbers.finest_level(), half = one / 2;
  const auto text = [&](const FileNumbers::Lattice& at) {
    const auto id = numbers.Vertex(numbers.OfPoint(at));
    return id ? id->ToString() : "none";
  };
  EXPECT_EQ(text({0, 0, 0}), "v0:0");
  EXPECT_EQ(text({one, one, one}), "v0:7");
  EXPECT_EQ(text({3 * one, 2 * one, 2 * one}), "v11:7");
  EXPECT_EQ(text({one + half, half, half}), "v1/0:7");
  EXPECT_EQ(text({2 * one, half, 0}), "v1/1:3");
  EXPECT_EQ(numbers.VertexAt({1, 0, 0}).level(), numbers.finest_level());
  EXPECT_FALSE(numbers.Vertex(-1).has_value());
  EXPECT_FALSE(numbers.Vertex(numbers.OfPoint({0, 0, 2 * one + 1})).has_value());
}

}  // namespace
}  // namespace ndmap

// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/reference/compare.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "tests/reference/plain_hexahedra.h"
#include "tests/reference/reference_map.h"

namespace ndmap::reference {
namespace {

using testing::HasSubstr;
using Hexahedra = PlainHexahedra<ReferenceLcc>;
using Dart = ReferenceLcc::Dart_handle;

// One hexahedron at x = 0 ... 1 moved by dx, or with all corners at one point.
Dart MakeCube(ReferenceLcc& lcc, double dx, bool point = false) {
  std::array<ReferenceLcc::Point, 8> corners;
  for (int c = 0; c < 8; ++c) {
    corners[c] =
        point ? ReferenceLcc::Point(dx, 0, 0) : ReferenceLcc::Point(dx + (c & 1), c >> 1 & 1, c >> 2);
  }
  return Hexahedra(lcc).Make(corners);
}

std::string Difference(const ReferenceLcc& a, const ReferenceLcc& b) {
  return std::string(CompareMaps(a, b).message());
}

TEST(CompareMaps, EqualWhateverTheOrderOfMaking) {
  ReferenceLcc a, b;
  for (const double x : {0.0, 5.0, 5.0, 9.0}) MakeCube(a, x);
  for (const double x : {9.0, 5.0, 0.0, 5.0}) MakeCube(b, x);
  EXPECT_EQ(CompareMaps(a, b), absl::OkStatus());
  EXPECT_EQ(CompareMaps(b, a), absl::OkStatus());
}

TEST(CompareMaps, TwoCellsOnTopOfEachOtherAreToldFromOne) {
  ReferenceLcc a, b;
  for (const double x : {0.0, 0.0}) MakeCube(a, x);
  MakeCube(b, 0);
  EXPECT_THAT(Difference(a, b), HasSubstr("48 darts"));
  EXPECT_THAT(Difference(b, a), HasSubstr("b has more"));
}

TEST(CompareMaps, OneBitOfOnePoint) {
  ReferenceLcc a, b;
  MakeCube(a, 0);
  const Dart d = MakeCube(b, 0);
  b.point(d) = ReferenceLcc::Point(0, 0, std::nextafter(0.0, 1.0));
  EXPECT_THAT(Difference(a, b), HasSubstr("(0, 0, 0)"));
  b.point(d) = ReferenceLcc::Point(0, 0, -0.0);
  EXPECT_FALSE(CompareMaps(a, b).ok());
  b.point(d) = ReferenceLcc::Point(0, 0, 0);
  EXPECT_TRUE(CompareMaps(a, b).ok());
}

TEST(CompareMaps, SewnOrOnlyTouching) {
  ReferenceLcc a, b;
  const Dart first = MakeCube(a, 0), second = MakeCube(a, 1);
  Hexahedra(a).SewAlong(first, second, 0);
  MakeCube(b, 0);
  MakeCube(b, 1);
  EXPECT_FALSE(CompareMaps(a, b).ok());
  EXPECT_FALSE(CompareMaps(b, a).ok());
}

// All darts look alike here, so only the walk from one candidate after another decides.
TEST(CompareMaps, CellsWithoutAnyGeometry) {
  const auto row = [](std::initializer_list<unsigned> axes) {
    auto lcc = std::make_unique<ReferenceLcc>();
    Dart last = MakeCube(*lcc, 0, true);
    for (const unsigned axis : axes) {
      const Dart next = MakeCube(*lcc, 0, true);
      Hexahedra(*lcc).SewAlong(last, next, axis);
      last = next;
    }
    return lcc;
  };
  EXPECT_EQ(CompareMaps(*row({0, 0}), *row({1, 1})), absl::OkStatus());
  EXPECT_EQ(CompareMaps(*row({0, 1}), *row({2, 0})), absl::OkStatus());
  EXPECT_FALSE(CompareMaps(*row({0, 1}), *row({0, 0})).ok());  // A bend is not a straight row.
}

TEST(CompareMaps, VertexAttributesThatAreNotShared) {
  ReferenceLcc a, b;
  for (ReferenceLcc* lcc : {&a, &b}) {
    const Dart first = MakeCube(*lcc, 0), second = MakeCube(*lcc, 1);
    Hexahedra(*lcc).SewAlong(first, second, 0);
  }
  b.set_automatic_attributes_management(false);
  const Dart d = b.darts().begin();
  const auto copy = b.create_vertex_attribute(b.point(d));
  b.set_dart_attribute<0>(d, copy);  // This one dart of the vertex only.
  EXPECT_THAT(Difference(a, b), HasSubstr("one vertex in one map and two in the other"));
  EXPECT_THAT(Difference(b, a), HasSubstr("one vertex in one map and two in the other"));
}

TEST(CompareMaps, NamesOfVolumes) {
  const auto corner = [](uint32_t i, uint32_t j, uint32_t k) {
    return Point3{double(i), double(j), double(k)};
  };
  const ReferenceMap a = ReferenceMap::Build(2, 1, 1, corner), b = ReferenceMap::Build(2, 1, 1, corner);
  const auto name = [&](ReferenceLcc::Dart_const_handle d) { return NameOf(a.lcc(), d); };
  const auto same = [&](ReferenceLcc::Dart_const_handle d) { return NameOf(b.lcc(), d); };
  const auto swapped = [&](ReferenceLcc::Dart_const_handle d) {
    return CellId::Initial(1 - NameOf(b.lcc(), d).initial());
  };
  EXPECT_EQ(CompareMaps(a.lcc(), b.lcc(), name, same), absl::OkStatus());
  EXPECT_FALSE(CompareMaps(a.lcc(), b.lcc(), name, swapped).ok());
}

TEST(CompareMaps, RefinedDifferently) {
  const auto corner = [](uint32_t i, uint32_t j, uint32_t k) {
    return Point3{double(i), double(j), double(k)};
  };
  ReferenceMap a = ReferenceMap::Build(2, 1, 1, corner), b = ReferenceMap::Build(2, 1, 1, corner);
  ASSERT_EQ(a.Refine(CellId::Initial(0)), absl::OkStatus());
  EXPECT_THAT(Difference(a.lcc(), b.lcc()), HasSubstr("b has the start point but no such edge"));
  EXPECT_THAT(Difference(b.lcc(), a.lcc()), HasSubstr("has no counterpart in b"));
  ASSERT_EQ(b.Refine(CellId::Initial(1)), absl::OkStatus());
  EXPECT_FALSE(CompareMaps(a.lcc(), b.lcc()).ok());
  ASSERT_EQ(a.Refine(CellId::Initial(1)), absl::OkStatus());
  ASSERT_EQ(b.Refine(CellId::Initial(0)), absl::OkStatus());
  EXPECT_EQ(CompareMaps(a.lcc(), b.lcc()), absl::OkStatus());
}

TEST(CompareMaps, EmptyMaps) {
  ReferenceLcc a, b, full;
  MakeCube(full, 0);
  EXPECT_EQ(CompareMaps(a, b), absl::OkStatus());
  EXPECT_FALSE(CompareMaps(a, full).ok());
  EXPECT_FALSE(CompareMaps(full, a).ok());
}

}  // namespace
}  // namespace ndmap::reference

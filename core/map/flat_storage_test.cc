// SPDX-License-Identifier: GPL-3.0-or-later
// Indices, growth and walks of the flat storage. That CGAL's operations work on it:
// flat_storage_random_test.cc.
#include "core/map/flat_storage.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

#include "core/map/dart_index.h"
#include "core/map/map_types.h"

namespace ndmap {
namespace {

template <unsigned n_, bool kSlots>
struct Kind {
  static constexpr unsigned n = n_;
  using Flat = MapTypes<n, StorageKind::kFlat, kSlots>;
  using Cgal = MapTypes<n, StorageKind::kCgal, kSlots>;
};

template <class K>
class FlatStorageTest : public testing::Test {};
using Kinds = testing::Types<Kind<2, false>, Kind<2, true>, Kind<3, false>, Kind<3, true>, Kind<4, false>,
                             Kind<4, true>>;
TYPED_TEST_SUITE(FlatStorageTest, Kinds);

TYPED_TEST(FlatStorageTest, AnErasedIndexIsRefusedAndGivenToTheNextDart) {
  typename TypeParam::Flat::Lcc map;
  std::vector<typename TypeParam::Flat::Dart> darts;
  for (int i = 0; i < 10; ++i) darts.push_back(map.create_dart());
  const DartIndex third = IndexOf(map, darts[3]);
  map.template set_dart_attribute<0>(darts[3], map.create_vertex_attribute());
  map.template link_beta<1>(darts[2], darts[4]);
  map.erase_dart(darts[3]);
  EXPECT_EQ(map.template number_of_attributes<0>(), 0u);
  EXPECT_TRUE(DartAt(map, third) == nullptr);
  for (int i = 0; i < 10; ++i) {
    if (i == 3) continue;
    EXPECT_TRUE(DartAt(map, IndexOf(map, darts[i])) == darts[i]);
  }
  const auto again = map.create_dart();
  EXPECT_EQ(IndexOf(map, again), third);
  EXPECT_TRUE(map.template attribute<0>(again) == nullptr);
  for (unsigned i = 0; i <= TypeParam::n; ++i) EXPECT_TRUE(map.is_free(again, i));
  EXPECT_TRUE(map.template beta<1>(darts[2]) == darts[4]);
}

TYPED_TEST(FlatStorageTest, IndicesThatNoDartHasAreRefused) {
  const auto check = [](auto& map) {
    for (int i = 0; i < 3; ++i) map.create_dart();
    EXPECT_TRUE(DartAt(map, DartIndex{}) == nullptr);
    EXPECT_TRUE(DartAt(map, DartIndex{DartIndexBound(map)}) == nullptr);
    EXPECT_TRUE(DartAt(map, DartIndex{0x80000000u}) == nullptr);
    EXPECT_FALSE(IndexOf(map, map.null_dart_handle).valid());
    EXPECT_FALSE(IndexOf(map, nullptr).valid());
    uint32_t found = 0;
    for (uint32_t i = 0; i < DartIndexBound(map); ++i) found += DartAt(map, DartIndex{i}) != nullptr;
    EXPECT_EQ(found, 3u);
    const auto& constant = map;
    EXPECT_TRUE(DartAt(constant, IndexOf(map, map.darts().begin())) == map.darts().begin());
  };
  typename TypeParam::Flat::Lcc flat;
  check(flat);
  EXPECT_TRUE(DartAt(flat, DartIndex{0}) == nullptr) << "the null dart";
  typename TypeParam::Cgal::Lcc cgal;
  check(cgal);
}

TYPED_TEST(FlatStorageTest, ManyDartsGrowTheMapAndClearGivesTheMemoryBack) {
  typename TypeParam::Flat::Lcc map;
  const size_t empty = AllocatedBytes(map);
  const auto first_vertex = map.create_vertex_attribute();
  const auto* address = &map.template get_attribute<0>(first_vertex);
  constexpr unsigned kDarts = 50000;
  auto last = map.create_dart();
  const auto first = last;
  for (unsigned i = 1; i < kDarts; ++i) {
    const auto next = map.create_dart();
    map.template basic_link_beta<1>(last, next);
    map.template set_dart_attribute<0>(next, map.create_vertex_attribute());
    last = next;
  }
  EXPECT_EQ(address, &map.template get_attribute<0>(first_vertex)) << "attributes must never move";
  unsigned length = 1;
  for (auto d = first; !map.template is_free<1>(d); d = map.template beta<1>(d)) ++length;
  EXPECT_EQ(length, kDarts);
  EXPECT_GT(AllocatedBytes(map), empty + kDarts * (4 * (TypeParam::n + 2) + 2 + sizeof(*address)));
  map.clear();
  EXPECT_EQ(AllocatedBytes(map), empty);
  EXPECT_TRUE(map.is_empty());
  EXPECT_EQ(IndexOf(map, map.create_dart()), DartIndex{1});
}

TYPED_TEST(FlatStorageTest, WalkingGoesOnWhileDartsAreMadeAndErased) {
  typename TypeParam::Flat::Lcc map;
  for (int i = 0; i < 100; ++i) map.create_dart();
  const auto end = map.darts().end();
  int walked = 0;
  for (auto it = map.darts().begin(); it != end; ++walked) {
    typename TypeParam::Flat::Dart d = it;
    ++it;
    map.erase_dart(d);
    if (walked < 50) map.create_dart();
  }
  EXPECT_EQ(walked, 100);
  EXPECT_EQ(map.number_of_darts(), 50u);
}

}  // namespace
}  // namespace ndmap

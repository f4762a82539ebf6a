// SPDX-License-Identifier: GPL-3.0-or-later
// Indices, growth and walks of the flat storage. That CGAL's operations work on it:
// flat_storage_random_test.cc.
#include "core/map/flat_storage.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <functional>
#include <limits>
#include <new>
#include <random>
#include <vector>

#include "absl/hash/hash_testing.h"
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
  EXPECT_GT(AllocatedBytes(map), empty + kDarts * (4 * (TypeParam::n + 2) + sizeof(*address)));
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

// beta_0 is no column: it must be right in faces that are closed, open, opened and closed again.
TYPED_TEST(FlatStorageTest, BetaZeroIsFoundWhateverIsLinkedAndUnlinked) {
  typename TypeParam::Flat::Lcc map;
  typename TypeParam::Cgal::Lcc reference;
  constexpr int kDarts = 40;
  std::vector<typename TypeParam::Flat::Dart> darts;
  std::vector<typename TypeParam::Cgal::Dart> theirs;
  for (int i = 0; i < kDarts; ++i) {
    darts.push_back(map.create_dart());
    theirs.push_back(reference.create_dart());
  }
  std::mt19937 random(TypeParam::n);
  int closed = 0;
  for (int step = 0; step < 4000; ++step) {
    const auto x = random() % kDarts, y = random() % kDarts;
    if (map.template is_free<1>(darts[x]) && map.template is_free<0>(darts[y])) {
      map.template link_beta<1>(darts[x], darts[y]);
      reference.template link_beta<1>(theirs[x], theirs[y]);
    } else if (random() % 3 == 0 && !map.template is_free<0>(darts[x])) {
      map.template unlink_beta<0>(darts[x]);
      reference.template unlink_beta<0>(theirs[x]);
    } else if (random() % 3 == 0 && !map.template is_free<1>(darts[x])) {
      // Another dart is put behind x, as when an edge is split.
      const auto d = map.create_dart();
      const auto t = reference.create_dart();
      map.basic_link_beta_1(d, map.template beta<1>(darts[x]));
      map.basic_link_beta_1(darts[x], d);
      reference.basic_link_beta_1(t, reference.template beta<1>(theirs[x]));
      reference.basic_link_beta_1(theirs[x], t);
      // And taken out again.
      map.basic_link_beta_1(darts[x], map.template beta<1>(d));
      reference.basic_link_beta_1(theirs[x], reference.template beta<1>(t));
      map.erase_dart(d);
      reference.erase_dart(t);
    }
    for (int i = 0; i < kDarts; ++i) {
      const auto before = map.template beta<0>(darts[i]);
      const auto expected = reference.template beta<0>(theirs[i]);
      ASSERT_EQ(before == map.null_dart_handle, expected == reference.null_dart_handle) << step;
      if (before == map.null_dart_handle) continue;
      ASSERT_TRUE(map.template beta<1>(before) == darts[i]) << step;
      closed += map.template beta<0, 1>(darts[i]) == darts[i];
    }
  }
  EXPECT_GT(closed, 1000);
}

TYPED_TEST(FlatStorageTest, BetaZeroTakesNoMemoryWhereFacesAreClosed) {
  typename TypeParam::Flat::Lcc map;
  const auto d = map.make_combinatorial_hexahedron();
  EXPECT_EQ(map.darts().exceptions(), 0u);
  map.template unlink_beta<1>(d);
  EXPECT_GT(map.darts().exceptions(), 0u);
  EXPECT_TRUE(map.template is_free<1>(d));
}

TYPED_TEST(FlatStorageTest, MarksAndLinksAndAttributesOfADartDoNotTouchEachOther) {
  typename TypeParam::Flat::Lcc map;
  const auto d = map.create_dart();
  const auto e = map.create_dart();
  std::vector<size_t> marks;
  for (size_t i = 0; i < TypeParam::Flat::Lcc::NB_MARKS; ++i) marks.push_back(map.get_new_mark());
  EXPECT_ANY_THROW(map.get_new_mark());
  const auto vertex = map.create_vertex_attribute();
  for (const size_t mark : marks) {
    map.mark(d, mark);
    map.template basic_link_beta<1>(d, e);
    map.template basic_link_beta_for_involution<2>(d, e);
    map.template set_dart_attribute<0>(d, vertex);
    for (const size_t other : marks) {
      EXPECT_EQ(map.is_marked(d, other), other <= mark);
      EXPECT_FALSE(map.is_marked(e, other));
    }
    EXPECT_TRUE(map.template beta<1>(d) == e);
    EXPECT_TRUE(map.template beta<2>(e) == d);
    EXPECT_TRUE(map.template attribute<0>(d) == vertex);
    EXPECT_TRUE(map.template attribute<0>(e) == nullptr);
  }
  EXPECT_EQ(map.get_dart_marks(d).count(), marks.size());
  for (const size_t mark : marks) map.unmark(d, mark);
  EXPECT_TRUE(map.template beta<1>(d) == e);
  map.erase_dart(e);
  EXPECT_TRUE(map.is_marked(map.create_dart(), marks[0]) == false);
}

// What CGAL offers beside the operations that flat_storage_random_test.cc compares.
TYPED_TEST(FlatStorageTest, ConstantMapsAreWalkedAndCopiedIntoCgalStorage) {
  typename TypeParam::Flat::Lcc map;
  const auto d = map.make_combinatorial_hexahedron();
  int vertices = 0;
  for (auto it = map.template darts_of_orbit<1, 2>(d).begin(),
            end = map.template darts_of_orbit<1, 2>(d).end();
       it != end; ++it) {
    if (map.vertex_attribute(it) != nullptr) continue;
    map.set_vertex_attribute(it, map.create_vertex_attribute());
    ++vertices;
  }
  EXPECT_EQ(vertices, 8);
  const auto& constant = map;
  int faces = 0, walked = 0;
  for (auto it = constant.template one_dart_per_cell<2>().begin(),
            end = constant.template one_dart_per_cell<2>().end();
       it != end; ++it) {
    faces += constant.template is_free<0>(it) ? 0 : 1;
  }
  for (auto it = constant.vertex_attributes().begin(); it != constant.vertex_attributes().end(); ++it) {
    EXPECT_TRUE(it->is_valid());
    ++walked;
  }
  EXPECT_EQ(faces, 6);
  EXPECT_EQ(walked, 8);
  typename TypeParam::Cgal::Lcc cgal;
  cgal.copy_from_const(constant, nullptr, nullptr, false);
  EXPECT_TRUE(map.is_isomorphic_to(cgal, false, false, true));
}

TEST(FlatHandle, IsHashableAndOrderedAndNullUntilItIsSet) {
  EXPECT_TRUE(
      absl::VerifyTypeImplementsAbslHashCorrectly({FlatDart(), kNullFlatDart, FlatDart(7u), FlatDart(8u)}));
  EXPECT_TRUE(FlatDart() == nullptr);
  EXPECT_TRUE(kNullFlatDart != nullptr);
  EXPECT_LT(FlatDart(7u), FlatDart(8u));
  EXPECT_NE(std::hash<FlatDart>()(FlatDart(7u)), std::hash<FlatDart>()(FlatDart(8u)));
}

TEST(GrowableArray, ThrowsWhenThereIsNoMemoryAndKeepsWhatItHas) {
  GrowableArray<uint32_t> array;
  array.Reserve(1000);
  const size_t capacity = array.capacity();
  for (uint32_t i = 0; i < capacity; ++i) array[i] = i;
  // More than the address space of a process.
  EXPECT_THROW(array.Reserve(size_t{1} << 46), std::bad_alloc);
  EXPECT_THROW(array.Reserve(std::numeric_limits<size_t>::max()), std::bad_alloc);
  EXPECT_EQ(array.capacity(), capacity);
  array.Reserve(capacity + 1);
  EXPECT_GE(array.capacity(), 2 * capacity);
  for (uint32_t i = 0; i < capacity; ++i) ASSERT_EQ(array[i], i);
  for (size_t i = capacity; i < array.capacity(); ++i) ASSERT_EQ(array[i], 0u);
  array.Release();
  EXPECT_EQ(array.capacity(), 0u);
}

TEST(FlatPool, DestroysEachAttributeOnce) {
  static int alive = 0;
  struct Counted {
    explicit Counted(int v) : value(v) {
      if (v < 0) throw std::bad_alloc();
      ++alive;
    }
    Counted(const Counted& other) : Counted(other.value) {}
    ~Counted() { --alive; }
    int value;
  };
  {
    internal::FlatPool<Counted> pool;
    std::vector<FlatHandle<Counted>> handles;
    for (int i = 0; i < 20000; ++i) handles.push_back(pool.emplace(i));
    for (int i = 0; i < 20000; i += 2) pool.erase(handles[i]);
    EXPECT_EQ(alive, 10000);
    EXPECT_THROW(pool.emplace(-1), std::bad_alloc);
    EXPECT_EQ(pool.emplace(5).index, 19998u) << "the last erased is used first, also after a failure";
    EXPECT_EQ(pool.emplace(6).index, 19996u);
    int sum = 0;
    for (const Counted& c : pool) sum += c.value % 2;
    EXPECT_EQ(sum, 10001);
    EXPECT_FALSE(pool.is_used(size_t{0}));
    EXPECT_FALSE(pool.is_used(FlatHandle<Counted>()));
  }
  EXPECT_EQ(alive, 0);
}

}  // namespace
}  // namespace ndmap

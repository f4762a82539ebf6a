// SPDX-License-Identifier: GPL-3.0-or-later
// What is_valid() of CGAL finds, the dart by dart check finds too.
#include "core/map/validity.h"

#include <random>
#include <string>
#include <vector>

#include "core/map/cube_grid.h"
#include "gtest/gtest.h"

namespace ndmap {
namespace {

template <class Types>
class ValidityTest : public testing::Test {
 protected:
  static constexpr unsigned n = Types::n;
  using Lcc = typename Types::Lcc;
  using Dart = typename Types::Dart;

  void Make(Lcc& map, uint64_t seed) {
    typename CubeGrid<Types>::Sizes sizes;
    sizes.fill(2);
    CubeGrid<Types>(map, sizes, seed);
    darts_.clear();
    for (auto it = map.darts().begin(); it != map.darts().end(); ++it) darts_.push_back(it);
  }

  // The first fault; empty if there is none.
  static std::string FaultOf(Lcc& map) {
    ValidityCheck<Lcc> check(map);
    std::string fault;
    for (auto it = map.darts().begin(); it != map.darts().end() && fault.empty(); ++it) fault = check.At(it);
    return fault.empty() ? check.AtEnd() : fault;
  }

  void Damage(Lcc& map, int kind, std::mt19937_64& random) {
    const Dart a = darts_[random() % darts_.size()];
    Dart b = a;
    // Linking what is linked does nothing.
    while (b == a || map.template beta<1>(a) == b || map.template beta<2>(a) == b) {
      b = darts_[random() % darts_.size()];
    }
    const typename Types::Point p = map.point(a);
    switch (kind) {
      case 0:
        return map.basic_link_beta_1(a, b);
      case 1:
        return map.template basic_link_beta_for_involution<2>(a, b);
      case 2:
        return map.template basic_link_beta_for_involution<n>(a, b);
      case 3:
        if (!map.template is_free<n>(a)) map.template unlink_beta_for_involution<n>(a);
        return;
      case 4:
        return map.template set_dart_attribute<0>(a, map.template create_attribute<0>(p));
      default:
        return map.template set_dart_attribute<n>(a, map.template attribute<n>(b));
    }
  }

  std::vector<Dart> darts_;
};

using ValidityTypes = testing::Types<MapTypes<2, StorageKind::kFlat>, MapTypes<3, StorageKind::kFlat>,
                                     MapTypes<4, StorageKind::kFlat>, MapTypes<3, StorageKind::kCgal>>;
TYPED_TEST_SUITE(ValidityTest, ValidityTypes);

TYPED_TEST(ValidityTest, FindsNothingInAGrid) {
  typename TestFixture::Lcc map;
  this->Make(map, 3);
  EXPECT_EQ(this->FaultOf(map), "");
  ASSERT_TRUE(map.is_valid());
}

// CGAL itself may walk for ever where links are broken.
TYPED_TEST(ValidityTest, FindsBrokenLinks) {
  for (int kind = 0; kind <= 2; ++kind) {
    for (uint64_t seed = 0; seed < 12; ++seed) {
      std::mt19937_64 random(seed);
      typename TestFixture::Lcc map;
      this->Make(map, seed);
      this->Damage(map, kind, random);
      EXPECT_NE(this->FaultOf(map), "") << "damage " << kind << ", seed " << seed;
    }
  }
}

TYPED_TEST(ValidityTest, FindsWhateverCgalFinds) {
  for (int kind = 3; kind <= 5; ++kind) {
    int found = 0;
    for (uint64_t seed = 0; seed < 12; ++seed) {
      std::mt19937_64 random(seed);
      typename TestFixture::Lcc map;
      this->Make(map, seed);
      this->Damage(map, kind, random);
      if (map.is_valid()) continue;
      ++found;
      EXPECT_NE(this->FaultOf(map), "") << "damage " << kind << ", seed " << seed;
    }
    EXPECT_GT(found, 0) << "damage " << kind;
  }
}

TYPED_TEST(ValidityTest, NamesTheFault) {
  typename TestFixture::Lcc map;
  this->Make(map, 1);
  const auto d = this->darts_[0];
  ValidityCheck<typename TestFixture::Lcc> check(map);
  map.template basic_link_beta_for_involution<2>(d, d);
  EXPECT_EQ(check.At(d), "beta 2 leads to the dart itself");
}

TYPED_TEST(ValidityTest, TwoCellsWithOneAttributeAreFound) {
  typename TestFixture::Lcc map;
  this->Make(map, 1);
  const auto first = this->darts_[0];
  // All darts of another cell get the attribute of the first: each cell for itself has one.
  constexpr unsigned n = TestFixture::n;
  const auto theirs = map.template attribute<n>(this->darts_.back());
  for (auto d : this->darts_) {
    if (map.template attribute<n>(d) == theirs) {
      map.template set_dart_attribute<n>(d, map.template attribute<n>(first));
    }
  }
  EXPECT_NE(this->FaultOf(map), "");
}

TEST(ValidityErasedTest, ALinkToAnErasedDartIsFound) {
  using Types = MapTypes<3, StorageKind::kFlat>;
  Types::Lcc map;
  CubeGrid<Types>(map, {1, 1, 1}, 1);
  const auto d = map.darts().begin();
  const Types::Dart across = map.beta<2>(d);
  map.erase_dart(across);
  EXPECT_EQ(ValidityCheck<Types::Lcc>(map).At(d), "beta 2 leads to a dart that was erased");
}

}  // namespace
}  // namespace ndmap

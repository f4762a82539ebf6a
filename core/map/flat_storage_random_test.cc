// SPDX-License-Identifier: GPL-3.0-or-later
// The flat storage against CGAL's own: the same random operations on both must give the same map, dart by
// dart.
#include "core/map/flat_storage.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <random>
#include <tuple>
#include <unordered_map>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_set.h"
#include "absl/strings/str_cat.h"
#include "core/map/dart_index.h"
#include "core/map/map_types.h"

namespace ndmap {
namespace {

template <unsigned n_, bool kSlots_>
struct RandomKind {
  static constexpr unsigned n = n_;
  static constexpr bool kSlots = kSlots_;
  using Flat = MapTypes<n, StorageKind::kFlat, kSlots>;
  using Cgal = MapTypes<n, StorageKind::kCgal, kSlots>;
};

enum class Op {
  kHexahedron,
  kPolygon,
  kSew,
  kUnsew,
  kSplitEdge,
  kStarFace,
  kSplitFace,
  kSplitVolume,
  kRemove,
  kContract,
  kSetCell,
  kMark,
  kReverse,
  kCopy,
  kAssign,
  kSwap,
  kClear,
  kCount
};

enum class Outcome { kDone, kImpossible, kThrew };

// One operation with its random numbers: the same is done to both maps.
struct Step {
  Op op;
  unsigned dimension;
  uint32_t a, b;
  double coordinate;
};

template <class Types>
class Driver {
 public:
  using Lcc = typename Types::Lcc;
  using Dart = typename Types::Dart;
  static constexpr unsigned n = Types::n;

  // All darts in the order in which the map walks them.
  std::vector<Dart> Darts() {
    std::vector<Dart> darts;
    for (auto it = map.darts().begin(); it != map.darts().end(); ++it) darts.push_back(it);
    return darts;
  }

  // Whether the operation was possible there.
  bool Do(const Step& s) {
    const auto darts = Darts();
    if (s.op == Op::kHexahedron) return GivePoints(map.make_combinatorial_hexahedron(), s);
    if (s.op == Op::kPolygon) return GivePoints(map.make_combinatorial_polygon(3 + s.a % 4), s);
    if (darts.empty()) return false;
    const Dart d = darts[s.a % darts.size()];
    const Dart e = darts[s.b % darts.size()];
    switch (s.op) {
      case Op::kSew:
        return Dimension<2>(s, [&]<unsigned i>() {
          if (!map.template is_sewable<i>(d, e)) return false;
          map.template sew<i>(d, e);
          return true;
        });
      case Op::kUnsew:
        return Dimension<2>(s, [&]<unsigned i>() {
          if (map.template is_free<i>(d)) return false;
          map.template unsew<i>(d);
          return true;
        });
      case Op::kSplitEdge:
        return map.template insert_point_in_cell<1>(d, MakePoint(s.coordinate)) != nullptr;
      case Op::kStarFace:
        return map.template insert_point_in_cell<2>(d, MakePoint(s.coordinate)) != nullptr;
      case Op::kSplitFace:
        return SplitFace(d, s.b);
      case Op::kSplitVolume:
        return SplitVolume(d);
      case Op::kRemove:
        return Dimension<0>(s, [&]<unsigned i>() {
          if (!map.template is_removable<i>(d)) return false;
          map.template remove_cell<i>(d);
          return true;
        });
      case Op::kContract:
        return Dimension<1>(s, [&]<unsigned i>() {
          if (!map.template is_contractible<i>(d)) return false;
          map.template contract_cell<i>(d);
          return true;
        });
      default:
        return DoToMap(s, d, e);
    }
  }

  Outcome Try(const Step& step) {
    try {
      return Do(step) ? Outcome::kDone : Outcome::kImpossible;
    } catch (const CGAL::Failure_exception&) {
      return Outcome::kThrew;
    }
  }

  Lcc map;
  typename Lcc::size_type mark = Lcc::INVALID_MARK;

 private:
  bool DoToMap(const Step& s, Dart d, Dart e) {
    switch (s.op) {
      case Op::kSetCell:
        SetCells(d, s.b);
        return true;
      case Op::kMark:
        if (mark == Lcc::INVALID_MARK) mark = map.get_new_mark();
        map.mark(d, mark);
        map.unmark(e, mark);
        if (s.b % 7 == 0) map.negate_mark(mark);
        if (s.b % 11 == 0) {
          map.free_mark(mark);
          mark = Lcc::INVALID_MARK;
        }
        return true;
      case Op::kReverse:
        // CGAL asserts that all darts of open faces have attributes.
        if (!map.are_all_faces_closed()) return false;
        map.reverse_orientation_connected_component(d);
        return true;
      case Op::kCopy: {
        Lcc copy(map);
        map.swap(copy);
        return true;
      }
      case Op::kAssign: {
        Lcc other;
        other = map;
        map.clear();
        map = other;
        return true;
      }
      case Op::kSwap: {
        Lcc other;
        other.make_combinatorial_hexahedron();
        other.swap(map);
        EXPECT_EQ(map.number_of_darts(), 24u);
        map.clear();
        map.swap(other);
        return true;
      }
      default:
        map.clear();
        return true;
    }
  }

  // Calls f<i> for an i that the step chooses from kFrom … n.
  template <unsigned kFrom, class F, unsigned i = kFrom>
  bool Dimension(const Step& s, F f) {
    if constexpr (i < n) {
      if (s.dimension % (n + 1 - kFrom) != i - kFrom) return Dimension<kFrom, F, i + 1>(s, f);
    }
    return f.template operator()<i>();
  }

  static typename Types::Point MakePoint(double x) {
    if constexpr (Types::kAmbient == 3) {
      return {x, x / 3, -x};
    } else {
      const std::array<double, 4> c = {x, x / 3, -x, x * x};
      return typename Types::Point(4, c.begin(), c.end());
    }
  }

  bool GivePoints(Dart d, const Step& s) {
    double x = s.coordinate;
    for (auto it = map.template darts_of_orbit<1, 2>(d).begin(),
              end = map.template darts_of_orbit<1, 2>(d).end();
         it != end; ++it) {
      if (map.vertex_attribute(it) == nullptr) {
        map.set_vertex_attribute(it, map.create_vertex_attribute(MakePoint(x), VertexInfo{uint8_t(s.b % 8)}));
        x += 1;
      }
    }
    return true;
  }

  // From d to the dart `steps` further on along the face.
  bool SplitFace(Dart d, uint32_t steps) {
    Dart e = d;
    for (steps %= 6; steps > 0 && !map.template is_free<1>(e); --steps) e = map.template beta<1>(e);
    if (!map.is_insertable_cell_1_in_cell_2(d, e)) return false;
    return map.insert_cell_1_in_cell_2(d, e) != nullptr;
  }

  // Along the border of the face of d: the new face doubles that one.
  bool SplitVolume(Dart d) {
    if constexpr (n >= 3) {
      std::vector<Dart> path;
      Dart at = d;
      do {
        if (path.size() > 100 || map.template is_free<1>(at) || map.template is_free<2>(at)) return false;
        path.push_back(at);
        at = map.template beta<1>(at);
      } while (at != d);
      if (!map.is_insertable_cell_2_in_cell_3(path.begin(), path.end())) return false;
      return map.insert_cell_2_in_cell_3(path.begin(), path.end()) != nullptr;
    } else {
      return false;
    }
  }

  void SetCells(Dart d, uint32_t number) {
    const auto cell = map.template create_attribute<n>();
    map.template info_of_attribute<n>(cell).id = CellId::Initial(number);
    map.template info_of_attribute<n>(cell).reference = d;
    map.template set_attribute<n>(d, cell);
    if constexpr (requires { typename Lcc::template Attribute_type<1>::type::Info; }) {
      map.template set_attribute<1>(d, map.template create_attribute<1>(AttributeSlot{number}));
    }
  }
};

// Compares the attributes of dimension i of darts of the same rank: the same ones shared, with equal
// contents.
struct CompareAttributes {
  template <unsigned i, class A, class B>
  static void run(A& a, B& b, const std::vector<typename A::Dart>& da,
                  const std::vector<typename B::Dart>& db) {
    ASSERT_EQ(a.map.template number_of_attributes<i>(), b.map.template number_of_attributes<i>());
    std::unordered_map<uint32_t, typename B::Lcc::template Attribute_handle<i>::type> partner;
    absl::flat_hash_set<const void*> seen;
    for (size_t k = 0; k < da.size(); ++k) {
      const auto x = a.map.template attribute<i>(da[k]);
      const auto y = b.map.template attribute<i>(db[k]);
      ASSERT_EQ(x == nullptr, y == nullptr);
      if (x == nullptr) continue;
      const auto [it, fresh] = partner.try_emplace(x.index, y);
      if (fresh) {
        ASSERT_TRUE(seen.insert(&b.map.template get_attribute<i>(y)).second);
        Contents<i>(a.map, x, b.map, y);
      }
      ASSERT_TRUE(it->second == y);
    }
    size_t walked = 0;
    auto& attributes = a.map.template attributes<i>();
    for (auto at = attributes.begin(); at != attributes.end(); ++at, ++walked) {
      ASSERT_TRUE(attributes.is_used(at));
      ASSERT_EQ(&*at, &a.map.template get_attribute<i>(at));
    }
    ASSERT_EQ(walked, attributes.size());
  }

  template <unsigned i, class MapA, class MapB, class X, class Y>
  static void Contents(MapA& a, X x, MapB& b, Y y) {
    ASSERT_EQ(a.template get_attribute_ref_counting<i>(x), b.template get_attribute_ref_counting<i>(y));
    const auto& info = a.template info_of_attribute<i>(x);
    const auto& expected = b.template info_of_attribute<i>(y);
    if constexpr (i == 0) {
      ASSERT_EQ(a.point_of_vertex_attribute(x), b.point_of_vertex_attribute(y));
      ASSERT_EQ(info, expected);
    } else if constexpr (i == MapA::dimension) {
      ASSERT_EQ(info.id, expected.id);
    } else {
      ASSERT_EQ(info, expected);
    }
  }
};

template <class A, class B>
void ExpectSame(A& a, B& b) {
  ASSERT_EQ(a.map.number_of_darts(), b.map.number_of_darts());
  const auto da = a.Darts();
  const auto db = b.Darts();
  ASSERT_EQ(da.size(), a.map.number_of_darts());
  std::vector<size_t> rank_a(DartIndexBound(a.map)), rank_b(DartIndexBound(b.map));
  for (size_t k = 0; k < da.size(); ++k) {
    rank_a.at(IndexOf(a.map, da[k]).value) = k;
    rank_b.at(IndexOf(b.map, db[k]).value) = k;
    ASSERT_TRUE(DartAt(a.map, IndexOf(a.map, da[k])) == da[k]);
    ASSERT_TRUE(DartAt(b.map, IndexOf(b.map, db[k])) == db[k]);
  }
  for (size_t k = 0; k < da.size(); ++k) {
    for (unsigned i = 0; i <= A::n; ++i) {
      ASSERT_EQ(a.map.is_free(da[k], i), b.map.is_free(db[k], i));
      if (a.map.is_free(da[k], i)) continue;
      ASSERT_EQ(rank_a[IndexOf(a.map, a.map.beta(da[k], i)).value],
                rank_b[IndexOf(b.map, b.map.beta(db[k], i)).value]);
    }
    if (a.mark != A::Lcc::INVALID_MARK) {
      ASSERT_EQ(a.map.is_marked(da[k], a.mark), b.map.is_marked(db[k], b.mark));
    }
  }
  A::Lcc::Helper::template Foreach_enabled_attributes<CompareAttributes>::run(a, b, da, db);
}

template <class K>
class FlatStorageRandomTest : public testing::Test {};
// With slots and without; the other combinations would only add to the time it takes to compile.
using RandomKinds =
    testing::Types<RandomKind<2, false>, RandomKind<3, false>, RandomKind<3, true>, RandomKind<4, true>>;
TYPED_TEST_SUITE(FlatStorageRandomTest, RandomKinds);

Step RandomStep(std::mt19937& random) {
  static constexpr int kWeights[] = {5, 3, 8, 3, 6, 3, 8, 3, 5, 2, 4, 4, 2, 1, 1, 1, 0};
  static_assert(std::size(kWeights) == static_cast<size_t>(Op::kCount));
  int left = static_cast<int>(random() % 59);
  int op = 0;
  while (left >= kWeights[op]) left -= kWeights[op++];
  const uint32_t dimension = random(), a = random(), b = random();
  return {static_cast<Op>(op), dimension, a, b, static_cast<double>(random() % 1000)};
}

TYPED_TEST(FlatStorageRandomTest, OperationsGiveTheSameMapAsCgal) {
  std::array<int, static_cast<size_t>(Op::kCount)> done{};
  int steps = 0;
  for (unsigned seed = 0; seed < 40; ++seed) {
    SCOPED_TRACE(absl::StrCat("seed ", seed));
    std::mt19937 random(seed);
    Driver<typename TypeParam::Flat> flat;
    Driver<typename TypeParam::Cgal> cgal;
    for (int k = 0; k < 60; ++k) {
      Step step = RandomStep(random);
      if (k % 30 == 29 && seed % 4 == 3) step.op = Op::kClear;
      SCOPED_TRACE(absl::StrCat("step ", k, ", operation ", static_cast<int>(step.op)));
      const Outcome expected = cgal.Try(step);
      ASSERT_EQ(flat.Try(step), expected);
      done[static_cast<size_t>(step.op)] += expected == Outcome::kDone;
      // Some operations of CGAL break odd maps on any storage: then there is nothing more to compare.
      if (expected == Outcome::kThrew) break;
      const bool valid = cgal.map.is_valid();
      ASSERT_EQ(flat.map.is_valid(), valid);
      ASSERT_NO_FATAL_FAILURE(ExpectSame(flat, cgal));
      if (!valid) break;
      ++steps;
    }
    EXPECT_EQ(flat.map.count_all_cells(), cgal.map.count_all_cells());
    EXPECT_TRUE(flat.map.is_isomorphic_to(cgal.map, false, false, true));
  }
  EXPECT_GT(steps, 40 * 60 * 3 / 4);
  for (size_t op = 0; op < done.size(); ++op) {
    if (TypeParam::n == 2 && op == static_cast<size_t>(Op::kSplitVolume)) continue;
    EXPECT_GT(done[op], 0) << "operation " << op << " was never possible";
  }
}

}  // namespace
}  // namespace ndmap

// SPDX-License-Identifier: GPL-3.0-or-later
// Cells across blocks against CGAL's own orbits on the uncut map, for n = 2, 3, 4, both storages, random
// cuts.
#include "core/navigate/closure.h"

#include <map>
#include <memory>
#include <random>
#include <set>
#include <vector>

#include "core/map/cube_grid.h"
#include "core/map/gather.h"
#include "core/navigate/dart_key_testing.h"
#include "core/navigate/memory_access.h"
#include "gtest/gtest.h"

namespace ndmap {
namespace {

constexpr size_t kMost = 1 << 20;

using Key = DartKey;

template <class Types>
class ClosureTest : public testing::Test {
 protected:
  static constexpr unsigned n = Types::n;
  using BlockT = Block<Types>;
  using Dart = typename Types::Dart;

  // A grid with some cells removed, whole and in blocks.
  void Make(uint64_t seed) {
    std::mt19937_64 random(seed);
    typename CubeGrid<Types>::Sizes sizes;
    uint64_t cells = 1;
    for (uint32_t& s : sizes) cells *= s = 1 + static_cast<uint32_t>(random() % (n == 4 ? 2 : 3));
    whole_ = std::make_unique<BlockT>(BlockId{0});
    CubeGrid<Types>(whole_->map(), sizes, seed);
    RemoveSome(cells, random);
    const uint32_t count = 1 + static_cast<uint32_t>(random() % 9);
    std::vector<BlockId> block_of;
    for (uint64_t i = 0; i < cells; ++i) block_of.push_back(BlockId{static_cast<uint32_t>(random() % count)});
    auto& map = whole_->map();
    auto cut = CutMap<Types>(
        map, count,
        [&](Dart d) {
          return block_of[map.template info_of_attribute<n>(map.template attribute<n>(d)).id.initial()];
        },
        random() % 2 == 0);
    ASSERT_TRUE(cut.ok()) << cut.status();
    blocks_ = *std::move(cut);
    whole_keys_ = DartKeysOf<Types>(map);
    places_.clear();
    block_keys_.clear();
    for (auto& block : blocks_) {
      block_keys_.push_back(DartKeysOf<Types>(block->map()));
      for (const auto& [d, key] : block_keys_.back()) places_[key] = {block->id(), d};
    }
    ASSERT_EQ(places_.size(), whole_keys_.size());
  }

  // Removes about a quarter of the cells, never all.
  void RemoveSome(uint64_t cells, std::mt19937_64& random) {
    auto& map = whole_->map();
    std::vector<Dart> doomed;
    auto& all = map.template attributes<n>();
    for (auto it = all.begin(); it != all.end(); ++it) {
      if (doomed.size() + 1 < cells && random() % 4 == 0)
        doomed.push_back(map.template info_of_attribute<n>(it).reference);
    }
    for (Dart d : doomed) map.template remove_cell<n>(d);
  }

  template <unsigned i>
  std::set<Key> Expected(const std::set<Key>& start) {
    std::set<Key> result;
    auto& map = whole_->map();
    for (const auto& [index, key] : whole_keys_) {
      if (!start.contains(key) || result.contains(key)) continue;
      for (auto it = map.template darts_of_cell<i>(DartAt(map, index)).begin(); it.cont(); ++it) {
        result.insert(whole_keys_.at(IndexOf(map, it)));
      }
    }
    return result;
  }

  DartSet Places(const std::set<Key>& keys) {
    DartSet set;
    for (const Key& key : keys) {
      const auto& [b, d] = places_.at(key);
      set.blocks[b].darts.push_back(d);
    }
    return set;
  }

  std::set<Key> KeysIn(const DartSet& set) {
    std::set<Key> keys;
    for (const auto& [b, part] : set.blocks) {
      for (DartIndex d : part.darts) EXPECT_TRUE(keys.insert(block_keys_[b.value].at(d)).second);
    }
    return keys;
  }

  // Close() from a dart, and again with another dimension from what that found.
  template <unsigned i, unsigned j>
  void CompareWord(const Key& begin) {
    MemoryAccess<BlockT> access(&blocks_);
    const std::set<Key> first = Expected<i>({begin});
    auto found = Close(access, i, Places({begin}), kMost);
    ASSERT_TRUE(found.ok()) << found.status();
    EXPECT_EQ(KeysIn(*found), first) << "dimension " << i;
    auto again = Close(access, j, *found, kMost);
    ASSERT_TRUE(again.ok()) << again.status();
    EXPECT_EQ(KeysIn(*again), Expected<j>(first)) << "dimension " << j << " after " << i;
  }

  template <unsigned i = 0>
  void CompareAll(const Key& begin) {
    if constexpr (i <= n) {
      CompareWord<i, (i + n) % (n + 1)>(begin);
      CompareWord<i, 0>(begin);
      CompareAll<i + 1>(begin);
    }
  }

  std::unique_ptr<BlockT> whole_;
  std::vector<std::unique_ptr<BlockT>> blocks_;
  std::map<DartIndex, Key> whole_keys_;
  std::vector<std::map<DartIndex, Key>> block_keys_;
  std::map<Key, std::pair<BlockId, DartIndex>> places_;
};

using ClosureTypes = testing::Types<MapTypes<2, StorageKind::kFlat>, MapTypes<3, StorageKind::kFlat>,
                                    MapTypes<4, StorageKind::kFlat>, MapTypes<3, StorageKind::kCgal>>;
TYPED_TEST_SUITE(ClosureTest, ClosureTypes);

TYPED_TEST(ClosureTest, CellsAreThoseOfTheUncutMap) {
  for (uint64_t seed = 1; seed <= 100; ++seed) {
    SCOPED_TRACE(seed);
    ASSERT_NO_FATAL_FAILURE(this->Make(seed));
    std::mt19937_64 random(seed);
    for (int k = 0; k < 4; ++k) {
      auto it = this->places_.begin();
      std::advance(it, static_cast<int64_t>(random() % this->places_.size()));
      ASSERT_NO_FATAL_FAILURE(this->CompareAll(it->first));
    }
  }
}

TYPED_TEST(ClosureTest, ErrorsAreTyped) {
  this->Make(3);
  MemoryAccess<Block<TypeParam>> access(&this->blocks_);
  const auto [block, dart] = this->places_.begin()->second;
  DartSet start;
  start.blocks[block].darts = {dart};
  EXPECT_EQ(Close(access, TypeParam::n + 1, start, kMost).status().code(),
            absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(Close(access, TypeParam::n, start, 1).status().code(), absl::StatusCode::kResourceExhausted);
  start.blocks[block].version = this->blocks_[block.value]->version() + 1;
  EXPECT_EQ(Close(access, 0, start, kMost).status().code(), absl::StatusCode::kFailedPrecondition);
  start.blocks[block] = {0, {DartIndex{123456789}}};
  EXPECT_EQ(Close(access, 0, start, kMost).status().code(), absl::StatusCode::kNotFound);
}

TYPED_TEST(ClosureTest, LabelWithoutPartnerIsUnavailable) {
  for (uint64_t seed = 1; seed <= 20; ++seed) {
    ASSERT_NO_FATAL_FAILURE(this->Make(seed));
    for (auto& block : this->blocks_) {
      if (block->labels().empty()) continue;
      const Label label = block->labels().begin()->label;
      const auto dart = block->labels().begin()->dart;
      for (auto& other : this->blocks_) {
        if (other != block && other->Find(label) != TypeParam::Lcc::null_handle)
          other->ClearCritical(other->Find(label));
      }
      MemoryAccess<Block<TypeParam>> access(&this->blocks_);
      DartSet start;
      start.blocks[block->id()].darts = {IndexOf(block->map(), dart)};
      EXPECT_EQ(Close(access, 1, start, kMost).status().code(), absl::StatusCode::kUnavailable);
      return;
    }
  }
  FAIL() << "no seed has a critical dart";
}

}  // namespace
}  // namespace ndmap

// SPDX-License-Identifier: GPL-3.0-or-later
// The distributed map for n = 2, 3, 4 on both storages: cut any way, it satisfies Definition 1, a walk over
// blocks (Proposition 1) arrives where a walk on the whole map does, and put together it is the map that was
// cut.
#include "core/map/block.h"

#include <memory>
#include <random>
#include <vector>

#include "absl/strings/str_join.h"
#include "core/algorithm/check/check.h"
#include "core/map/cube_grid.h"
#include "core/map/gather.h"
#include "core/map/walk.h"
#include "core/sim/simulator.h"
#include "gtest/gtest.h"

namespace ndmap {
namespace {

template <class Types>
class DistributedMapTest : public testing::Test {
 protected:
  static constexpr unsigned n = Types::n;
  using Lcc = typename Types::Lcc;
  using Dart = typename Types::Dart;
  using Blocks = std::vector<std::unique_ptr<Block<Types>>>;

  void Make(uint64_t seed) {
    random_.seed(seed);
    typename CubeGrid<Types>::Sizes sizes;
    for (uint32_t& s : sizes) s = 1 + static_cast<uint32_t>(random_() % 3);
    global_ = std::make_unique<Block<Types>>(BlockId{0});
    CubeGrid<Types>(global_->map(), sizes, seed);
    uint64_t cells = 1;
    for (uint32_t s : sizes) cells *= s;
    block_count_ = 1 + static_cast<uint32_t>(random_() % 9);
    block_of_.clear();
    for (uint64_t i = 0; i < cells; ++i)
      block_of_.push_back(BlockId{static_cast<uint32_t>(random_() % block_count_)});
  }

  Blocks Cut(bool direct) {
    auto& map = global_->map();
    auto blocks = CutMap<Types>(
        map, block_count_, [&](Dart d) { return block_of_[IdOf(map, d).initial()]; }, direct);
    EXPECT_TRUE(blocks.ok()) << blocks.status();
    return *std::move(blocks);
  }

  static CellId IdOf(Lcc& map, Dart d) {
    return map.template info_of_attribute<n>(map.template attribute<n>(d)).id;
  }

  Report RunCheck(Blocks& blocks, bool direct, uint64_t seed) {
    std::vector<std::unique_ptr<BlockAlgorithm>> checks;
    for (auto& block : blocks) {
      checks.push_back(
          std::make_unique<Check<Block<Types>>>(direct ? Routing::kDirect : Routing::kBroadcast, *block));
    }
    SimulatorOptions options;
    options.seed = seed;
    auto report = Simulator(options).RunPhase(checks);
    EXPECT_TRUE(report.ok()) << report.status();
    return *report;
  }

  // The dart of a block that was copied from `d`: in the same cell, at the same place of a walk that visits
  // both cells alike.
  static Dart Counterpart(Lcc& whole, Dart d, Lcc& part) {
    auto& cells = part.template attributes<n>();
    const CellId id = IdOf(whole, d);
    for (auto it = cells.begin(); it != cells.end(); ++it) {
      if (part.template info_of_attribute<n>(it).id != id) continue;
      const Dart begin = whole.template info_of_attribute<n>(whole.template attribute<n>(d)).reference;
      std::map<uint32_t, Dart> seen = {
          {IndexOf(whole, begin).value, part.template info_of_attribute<n>(it).reference}};
      std::vector<Dart> queue = {begin};
      for (size_t i = 0; i < queue.size(); ++i) {
        for (int b = 1; b < static_cast<int>(n); ++b) {
          const Dart next = whole.beta(queue[i], b);
          if (!seen.try_emplace(IndexOf(whole, next).value,
                                part.beta(seen.at(IndexOf(whole, queue[i]).value), b))
                   .second) {
            continue;
          }
          queue.push_back(next);
        }
      }
      return seen.at(IndexOf(whole, d).value);
    }
    return Lcc::null_handle;
  }

  // A critical dart of some block, and its block; false if the cut made none.
  bool AnyCritical(Blocks& blocks, Block<Types>** block, Dart* dart) {
    for (auto& b : blocks) {
      if (b->labels().empty()) continue;
      *block = b.get();
      *dart = b->labels().begin()->dart;
      return true;
    }
    return false;
  }

  std::mt19937_64 random_;
  std::unique_ptr<Block<Types>> global_;
  uint32_t block_count_ = 0;
  std::vector<BlockId> block_of_;
};

using BlockTypes = testing::Types<MapTypes<2, StorageKind::kFlat>, MapTypes<2, StorageKind::kCgal>,
                                  MapTypes<3, StorageKind::kFlat>, MapTypes<3, StorageKind::kCgal>,
                                  MapTypes<3, StorageKind::kFlat, true>, MapTypes<4, StorageKind::kFlat>,
                                  MapTypes<4, StorageKind::kCgal>>;
TYPED_TEST_SUITE(DistributedMapTest, BlockTypes);

constexpr uint64_t kSeeds = 12;

TYPED_TEST(DistributedMapTest, AnyCutSatisfiesDefinition1) {
  for (uint64_t seed = 0; seed < kSeeds; ++seed) {
    this->Make(seed);
    for (bool direct : {true, false}) {
      auto blocks = this->Cut(direct);
      const Report report = this->RunCheck(blocks, direct, seed);
      EXPECT_EQ(report.counts.at("findings"), 0)
          << "seed " << seed << ": " << absl::StrJoin(report.findings, "; ");
      EXPECT_EQ(report.counts.at("darts"), static_cast<int64_t>(this->global_->map().number_of_darts()));
    }
  }
}

TYPED_TEST(DistributedMapTest, GatheredBlocksAreTheMapThatWasCut) {
  for (uint64_t seed = 0; seed < kSeeds; ++seed) {
    this->Make(seed);
    auto blocks = this->Cut(true);
    Block<TypeParam> gathered(BlockId{0});
    const absl::Status status = Gather<TypeParam>(blocks, gathered);
    ASSERT_TRUE(status.ok()) << status;
    EXPECT_TRUE(gathered.map().is_valid());
    EXPECT_TRUE(gathered.map().is_isomorphic_to(this->global_->map(), false, false, true)) << "seed " << seed;
    EXPECT_EQ(gathered.map().template number_of_attributes<0>(),
              this->global_->map().template number_of_attributes<0>());
  }
}

// Proposition 1: where a word leads from a dart, crossing blocks by labels.
TYPED_TEST(DistributedMapTest, WalkOverBlocksArrivesWhereTheWholeMapDoes) {
  using Dart = typename TypeParam::Dart;
  for (uint64_t seed = 0; seed < kSeeds; ++seed) {
    this->Make(seed);
    auto blocks = this->Cut(true);
    auto& whole = this->global_->map();
    std::vector<Dart> darts;
    for (auto it = whole.darts().begin(); it != whole.darts().end(); ++it) darts.push_back(it);
    for (int trial = 0; trial < 50; ++trial) {
      const Dart from = darts[this->random_() % darts.size()];
      std::vector<uint8_t> word;
      for (int i = 0; i < 12; ++i) word.push_back(static_cast<uint8_t>(this->random_() % (TypeParam::n + 1)));
      auto expected = Walk(*this->global_, IndexOf(whole, from), word);
      ASSERT_TRUE(expected.ok()) << expected.status();
      // The same dart in its block: same cell, same flag, found by walking from the cell's reference dart.
      Block<TypeParam>* block = blocks[this->block_of_[this->IdOf(whole, from).initial()].value].get();
      Dart here = this->Counterpart(whole, from, block->map());
      ASSERT_TRUE(here != TypeParam::Lcc::null_handle);
      size_t used = 0;
      auto result = Walk(*block, IndexOf(block->map(), here), word);
      ASSERT_TRUE(result.ok()) << result.status();
      used = result->used;
      while (result->end == WalkResult::End::kCrossing) {
        block = blocks[result->peer.value].get();
        const Dart partner = block->Find(result->label);
        ASSERT_TRUE(partner != TypeParam::Lcc::null_handle);
        ++used;
        result = Walk(*block, IndexOf(block->map(), partner), absl::MakeSpan(word).subspan(used));
        ASSERT_TRUE(result.ok()) << result.status();
        used += result->used;
      }
      EXPECT_EQ(used, expected->used);
      EXPECT_EQ(result->end, expected->end);
      const Dart arrived = DartAt(block->map(), result->dart);
      const Dart should = DartAt(whole, expected->dart);
      EXPECT_EQ(internal::CoordinatesOf<TypeParam>(block->map(), arrived),
                internal::CoordinatesOf<TypeParam>(whole, should));
      EXPECT_EQ(this->IdOf(block->map(), arrived), this->IdOf(whole, should));
    }
  }
}

TYPED_TEST(DistributedMapTest, CheckFindsEachPropertyBroken) {
  using Dart = typename TypeParam::Dart;
  int broken = 0;
  for (uint64_t seed = 0; seed < kSeeds; ++seed) {
    for (int how = 0; how < 5; ++how) {
      this->Make(seed);
      auto blocks = this->Cut(true);
      Block<TypeParam>* block = nullptr;
      Dart d;
      if (!this->AnyCritical(blocks, &block, &d)) continue;
      Critical c = block->critical(d);
      block->ClearCritical(d);
      if (how == 1) c.positive = !c.positive;
      if (how == 2) c.label = Label{c.label.root + 1'000'000, 1};
      if (how == 3) c.peer = block->id();
      if (how == 4) block->map().point(d) = block->map().point(block->map().template beta<1>(d));
      // how == 0: one dart of its cell is not critical any more.
      if (how != 0) block->SetCritical(d, c);
      ++broken;
      EXPECT_GT(this->RunCheck(blocks, true, seed).counts.at("findings"), 0)
          << "seed " << seed << " how " << how;
    }
  }
  EXPECT_GT(broken, 20);
}

TYPED_TEST(DistributedMapTest, WalkRefusesWhatIsNotThere) {
  this->Make(1);
  const std::vector<uint8_t> word = {static_cast<uint8_t>(TypeParam::n + 1)};
  auto& map = this->global_->map();
  EXPECT_EQ(Walk(*this->global_, DartIndex{1'000'000'000}, {}).status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(Walk(*this->global_, DartIndex{}, {}).status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(Walk(*this->global_, IndexOf(map, map.darts().begin()), word).status().code(),
            absl::StatusCode::kInvalidArgument);
}

TYPED_TEST(DistributedMapTest, CutRefusesAnAssignmentThatTearsCells) {
  this->Make(2);
  using Dart = typename TypeParam::Dart;
  auto& map = this->global_->map();
  const Dart torn = map.darts().begin();
  auto blocks = CutMap<TypeParam>(
      map, 2, [&](Dart d) { return BlockId{d == torn ? 1u : 0u}; }, true);
  EXPECT_EQ(blocks.status().code(), absl::StatusCode::kInvalidArgument);
  blocks = CutMap<TypeParam>(
      map, 2, [&](Dart) { return BlockId{2}; }, true);
  EXPECT_EQ(blocks.status().code(), absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace ndmap

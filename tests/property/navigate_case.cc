// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/property/navigate_case.h"

#include <algorithm>
#include <map>
#include <memory>
#include <random>
#include <set>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "core/map/cube_grid.h"
#include "core/map/gather.h"
#include "core/map/walk.h"
#include "core/navigate/closure.h"
#include "core/navigate/dart_key_testing.h"
#include "core/navigate/memory_access.h"

namespace ndmap {
namespace {

constexpr size_t kMost = 1 << 20;
constexpr int kStarts = 3;
constexpr int kWordsAStart = 4;

using Key = DartKey;
using Keys = std::set<Key>;

template <class Types>
class Case {
 public:
  static constexpr unsigned n = Types::n;
  using BlockT = Block<Types>;
  using Dart = typename Types::Dart;

  explicit Case(uint64_t seed) : random_(seed), whole_(BlockId{0}) {}

  absl::Status Run() {
    if (absl::Status s = Make(); !s.ok()) return s;
    for (int k = 0; k < kStarts; ++k) {
      auto it = places_.begin();
      std::advance(it, static_cast<int64_t>(Random(places_.size())));
      const Key begin = it->first;
      for (int w = 0; w < kWordsAStart; ++w) {
        if (absl::Status s = CompareBetas(begin); !s.ok()) return s;
      }
      for (unsigned i = 0; i <= n; ++i) {
        const unsigned j = Random(n + 1);
        // The orbit; cells incident to that cell; cells adjacent to it.
        if (absl::Status s = CompareRegion(begin, {i}, j); !s.ok()) return s;
        if (absl::Status s = CompareRegion(begin, {i, j}, i); !s.ok()) return s;
      }
      // A ring of n-cells through cells of some dimension, and any word.
      const unsigned through = Random(n);
      if (absl::Status s = CompareRegion(begin, {n, through, n, through}, n); !s.ok()) return s;
      std::vector<unsigned> word(1 + Random(4));
      for (unsigned& i : word) i = Random(n + 1);
      if (absl::Status s = CompareRegion(begin, word, Random(n + 1)); !s.ok()) return s;
    }
    return absl::OkStatus();
  }

 private:
  unsigned Random(size_t below) { return static_cast<unsigned>(random_() % below); }

  absl::Status Make() {
    auto& map = whole_.map();
    typename CubeGrid<Types>::Sizes sizes;
    uint64_t cells = 1;
    for (uint32_t& s : sizes) cells *= s = 1 + Random(n == 4 ? 2 : 3);
    CubeGrid<Types>(map, sizes, random_());
    RemoveSome(cells);
    SplitSome();
    std::vector<BlockId> block_of;
    const uint32_t count = 1 + Random(9);
    for (uint64_t i = 0; i < cells; ++i) block_of.push_back(BlockId{Random(count)});
    const auto block = [&](Dart d) {
      return block_of[map.template info_of_attribute<n>(map.template attribute<n>(d)).id.initial()];
    };
    auto cut = CutMap<Types>(map, count, block, Random(2) == 0);
    if (!cut.ok()) return cut.status();
    blocks_ = *std::move(cut);
    for (const auto& [d, key] : DartKeysOf<Types>(map)) whole_darts_[key] = d;
    whole_keys_ = DartKeysOf<Types>(map);
    for (auto& b : blocks_) {
      block_keys_.push_back(DartKeysOf<Types>(b->map()));
      for (const auto& [d, key] : block_keys_.back()) places_[key] = {b->id(), d};
    }
    if (places_.size() == whole_keys_.size()) return absl::OkStatus();
    return absl::InternalError(
        absl::StrCat("the blocks have ", places_.size(), " darts of ", whole_keys_.size()));
  }

  // About a quarter of the cells, never all.
  void RemoveSome(uint64_t cells) {
    auto& map = whole_.map();
    std::vector<Dart> doomed;
    auto& all = map.template attributes<n>();
    for (auto it = all.begin(); it != all.end(); ++it) {
      if (doomed.size() + 1 < cells && Random(4) == 0)
        doomed.push_back(map.template info_of_attribute<n>(it).reference);
    }
    for (Dart d : doomed) map.template remove_cell<n>(d);
  }

  // Some edges in two, and in maps of more than two dimensions some faces in two, along two of their
  // vertices.
  void SplitSome() {
    auto& map = whole_.map();
    for (unsigned k = Random(6); k > 0; --k) map.template insert_barycenter_in_cell<1>(Any());
    for (unsigned k = n > 2 ? Random(4) : 0; k > 0; --k) {
      const Dart d = Any();
      const Dart e = map.template beta<1, 1>(d);
      if (map.is_insertable_cell_1_in_cell_2(d, e)) map.insert_cell_1_in_cell_2(d, e);
    }
  }
  Dart Any() {
    auto it = whole_.map().darts().begin();
    std::advance(it, static_cast<int64_t>(Random(whole_.map().number_of_darts())));
    return it;
  }

  // Follows the word from block to block.
  absl::StatusOr<std::pair<Key, WalkResult>> WalkOverBlocks(const Key& begin,
                                                            const std::vector<uint8_t>& word) {
    auto [block, dart] = places_.at(begin);
    size_t used = 0;
    while (true) {
      auto result = Walk(*blocks_[block.value], dart, absl::MakeSpan(word).subspan(used));
      if (!result.ok()) return result.status();
      used += result->used;
      if (result->end != WalkResult::End::kCrossing) {
        result->used = used;
        return std::make_pair(block_keys_[block.value].at(result->dart), *result);
      }
      ++used;
      const BlockId from = block;
      for (auto& other : blocks_) {
        if (other->id() == from || (result->peer.valid() && other->id() != result->peer)) continue;
        const Dart partner = other->Find(result->label);
        if (partner == Types::Lcc::null_handle) continue;
        block = other->id();
        dart = IndexOf(other->map(), partner);
      }
      if (block == from) return absl::InternalError(absl::StrCat("nobody has ", ToString(result->label)));
    }
  }

  absl::Status CompareBetas(const Key& begin) {
    std::vector<uint8_t> word(Random(20));
    for (uint8_t& letter : word) letter = static_cast<uint8_t>(Random(n + 1));
    auto expected = Walk(whole_, whole_darts_.at(begin), word);
    if (!expected.ok()) return expected.status();
    auto found = WalkOverBlocks(begin, word);
    if (!found.ok()) return found.status();
    if (found->first == whole_keys_.at(expected->dart) && found->second.used == expected->used &&
        found->second.end == expected->end) {
      return absl::OkStatus();
    }
    return absl::InternalError(absl::StrCat("betas ", absl::StrJoin(word, ","), " from ", Show(begin)));
  }

  // CGAL's own orbits.
  Keys CellOf(unsigned i, const Key& begin) { return CellOf(i, begin, std::make_index_sequence<n + 1>()); }
  template <size_t... kDimensions>
  Keys CellOf(unsigned i, const Key& begin, std::index_sequence<kDimensions...>) {
    Keys keys;
    ((i == kDimensions ? AddCell<kDimensions>(begin, keys) : void()), ...);
    return keys;
  }
  template <unsigned i>
  void AddCell(const Key& begin, Keys& keys) {
    auto& map = whole_.map();
    for (auto it = map.template darts_of_cell<i>(DartAt(map, whole_darts_.at(begin))).begin(); it.cont();
         ++it) {
      keys.insert(whole_keys_.at(IndexOf(map, it)));
    }
  }

  DartSet Places(const Keys& keys) {
    DartSet set;
    for (const Key& key : keys) {
      const auto& [b, d] = places_.at(key);
      set.blocks[b].darts.push_back(d);
    }
    return set;
  }

  // The closures `word` of a dart, and the cells of dimension j that it meets.
  absl::Status CompareRegion(const Key& begin, const std::vector<unsigned>& word, unsigned j) {
    const std::string what = absl::StrCat("closures ", absl::StrJoin(word, ","), " from ", Show(begin));
    MemoryAccess<BlockT> access(&blocks_);
    Keys expected = {begin};
    DartSet found = Places(expected);
    for (unsigned i : word) {
      Keys closed;
      for (const Key& key : expected) {
        if (!closed.contains(key)) closed.merge(CellOf(i, key));
      }
      expected = std::move(closed);
      auto next = Close(access, i, found, kMost);
      if (!next.ok()) return next.status();
      found = *std::move(next);
    }
    Keys keys;
    for (const auto& [b, part] : found.blocks) {
      for (DartIndex d : part.darts) {
        if (!keys.insert(block_keys_[b.value].at(d)).second)
          return absl::InternalError(absl::StrCat(what, ": a dart twice"));
      }
    }
    if (keys != expected) {
      return absl::InternalError(absl::StrCat(what, ": ", keys.size(), " darts, expected ", expected.size()));
    }
    return CompareCells(what, keys, j);
  }

  // Each dart's cell of dimension j by its canonical dart, for some of the darts.
  absl::Status CompareCells(const std::string& what, const Keys& keys, unsigned j) {
    MemoryAccess<BlockT> access(&blocks_);
    const size_t step = 1 + keys.size() / 16;
    size_t place = 0;
    for (const Key& key : keys) {
      if (place++ % step != 0) continue;
      auto cell = Close(access, j, Places({key}), kMost);
      if (!cell.ok()) return cell.status();
      Key canonical = key;
      size_t darts = 0;
      for (const auto& [b, part] : cell->blocks) {
        darts += part.darts.size();
        for (DartIndex d : part.darts) canonical = std::min(canonical, block_keys_[b.value].at(d));
      }
      const Keys expected = CellOf(j, key);
      if (canonical != *expected.begin() || darts != expected.size()) {
        return absl::InternalError(absl::StrCat(what, ": the ", j, "-cell of ", Show(key), " has ", darts,
                                                " darts, the first ", Show(canonical), ", expected ",
                                                expected.size(), " and ", Show(*expected.begin())));
      }
    }
    return absl::OkStatus();
  }

  static std::string Show(const Key& key) { return absl::StrCat("cell ", key.first, " dart ", key.second); }

  std::mt19937_64 random_;
  BlockT whole_;
  std::vector<std::unique_ptr<BlockT>> blocks_;
  std::map<DartIndex, Key> whole_keys_;
  std::map<Key, DartIndex> whole_darts_;
  std::vector<std::map<DartIndex, Key>> block_keys_;
  std::map<Key, std::pair<BlockId, DartIndex>> places_;
};

template <unsigned n>
absl::Status RunOn(StorageKind storage, uint64_t seed) {
  return storage == StorageKind::kFlat ? Case<MapTypes<n, StorageKind::kFlat>>(seed).Run()
                                       : Case<MapTypes<n, StorageKind::kCgal>>(seed).Run();
}

}  // namespace

absl::Status RunNavigateCase(unsigned n, StorageKind storage, uint64_t seed) {
  absl::Status status = n == 2   ? RunOn<2>(storage, seed)
                        : n == 3 ? RunOn<3>(storage, seed)
                        : n == 4 ? RunOn<4>(storage, seed)
                                 : absl::InvalidArgumentError(absl::StrCat("n = ", n));
  if (status.ok()) return status;
  return absl::Status(status.code(), absl::StrCat("n = ", n, ", seed ", seed, ": ", status.message()));
}

}  // namespace ndmap

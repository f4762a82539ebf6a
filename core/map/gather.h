// SPDX-License-Identifier: GPL-3.0-or-later
// The global map in one piece: what Proposition 1 describes, really put together. For tests and small maps
// only; and its inverse, cutting a map into blocks.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "core/map/block.h"
#include "core/map/handle_hash.h"

namespace ndmap {

namespace internal {

template <class Types>
typename Types::Coordinates CoordinatesOf(const typename Types::Lcc& map, typename Types::Dart d) {
  typename Types::Coordinates x;
  const auto& p = map.point(d);
  for (unsigned c = 0; c < Types::kAmbient; ++c) x[c] = p[static_cast<int>(c)];
  return x;
}

template <class Types>
using DartMap =
    absl::flat_hash_map<typename Types::Dart, typename Types::Dart, HandleHash<typename Types::Dart>>;

// Copies darts of `from` for which take(d), with their betas among each other, into `to`.
template <class Types, class Take>
DartMap<Types> CopyDarts(typename Types::Lcc& from, typename Types::Lcc& to, Take take) {
  DartMap<Types> copy;
  for (auto it = from.darts().begin(); it != from.darts().end(); ++it) {
    if (take(it)) copy.emplace(it, to.create_dart());
  }
  for (const auto& [d, c] : copy) {
    for (unsigned i = 1; i <= Types::n; ++i) {
      if (from.is_free(d, i)) continue;
      const auto beyond = copy.find(from.beta(d, static_cast<int>(i)));
      if (beyond != copy.end()) to.basic_link_beta(c, beyond->second, i);
    }
  }
  return copy;
}

// Gives the copies the vertices and n-cells of their originals, one for each orbit of `to`.
template <class Types>
void CopyCells(typename Types::Lcc& from, typename Types::Lcc& to, const DartMap<Types>& copy) {
  for (const auto& [d, c] : copy) {
    if (to.template attribute<0>(c) == Types::Lcc::null_handle) {
      const auto v = to.template create_attribute<0>(from.point(d));
      to.template info_of_attribute<0>(v) = from.template info_of_attribute<0>(from.template attribute<0>(d));
      to.template set_attribute<0>(c, v);
    }
    if (to.template attribute<Types::n>(c) == Types::Lcc::null_handle &&
        from.template attribute<Types::n>(d) != Types::Lcc::null_handle) {
      const auto& info = from.template info_of_attribute<Types::n>(from.template attribute<Types::n>(d));
      const auto cell = to.template create_attribute<Types::n>();
      auto& own = to.template info_of_attribute<Types::n>(cell);
      own.id = info.id;
      own.state = info.state;
      own.kind = info.kind;
      const auto reference = copy.find(info.reference);
      if (reference != copy.end()) own.reference = reference->second;
      to.template set_attribute<Types::n>(c, cell);
    }
  }
}

}  // namespace internal

// Puts all blocks together into `global`, which is empty: beta_n of a critical dart becomes the dart with the
// same label in the peer. INTERNAL when a label has no partner or two. O(darts).
template <class Types>
absl::Status Gather(const std::vector<std::unique_ptr<Block<Types>>>& blocks, Block<Types>& global) {
  using Lcc = typename Types::Lcc;
  using Dart = typename Types::Dart;
  Lcc& to = global.map();
  absl::flat_hash_map<Label, Dart> open;
  std::vector<internal::DartMap<Types>> copies;
  size_t labels = 0;
  for (const auto& block : blocks) {
    copies.push_back(internal::CopyDarts<Types>(block->map(), to, [](Dart) { return true; }));
    for (const auto& row : block->labels()) {
      ++labels;
      const Dart c = copies.back().find(row.dart)->second;
      const auto [it, first] = open.emplace(row.label, c);
      if (first) continue;
      if (!to.template is_free<Types::n>(it->second)) {
        return absl::InternalError(
            absl::StrCat("label ", ToString(row.label), " is on three critical darts"));
      }
      to.template basic_link_beta_for_involution<Types::n>(it->second, c);
    }
  }
  if (labels != 2 * open.size()) {
    return absl::InternalError(absl::StrCat(labels, " critical darts carry ", open.size(), " labels"));
  }
  for (size_t b = 0; b < blocks.size(); ++b) internal::CopyCells<Types>(blocks[b]->map(), to, copies[b]);
  return absl::OkStatus();
}

// Names the pairs of darts that a cut makes critical: called once a pair, with the dart of the positive side.
template <class Types>
using Labeler = std::function<Label(typename Types::Dart positive)>;

// Cuts a map into `blocks` blocks: block_of tells each dart's block and is constant on n-cells. The side in
// the lower block is positive. Without a labeler, labels are (0, 0), (0, 1), ... at level 0, which suits maps
// whose cells have not been refined. INVALID_ARGUMENT if block_of is not constant on an n-cell or not below
// `blocks`. O(darts).
template <class Types>
absl::StatusOr<std::vector<std::unique_ptr<Block<Types>>>> CutMap(
    typename Types::Lcc& global, uint32_t blocks,
    const std::function<BlockId(typename Types::Dart)>& block_of, bool direct,
    Labeler<Types> labeler = nullptr) {
  using Dart = typename Types::Dart;
  uint64_t counter = 0;
  if (!labeler) labeler = [&counter](Dart) { return Label{counter++, 1}; };
  for (auto it = global.darts().begin(); it != global.darts().end(); ++it) {
    const BlockId b = block_of(it);
    for (unsigned i = 1; i < Types::n; ++i) {
      if (!global.is_free(it, i) && block_of(global.beta(it, static_cast<int>(i))) != b) {
        return absl::InvalidArgumentError("cut: an n-cell is given to two blocks");
      }
    }
    if (b.value >= blocks) {
      return absl::InvalidArgumentError(absl::StrCat("cut: block ", b.value, " of ", blocks));
    }
  }
  std::vector<std::unique_ptr<Block<Types>>> result;
  std::vector<internal::DartMap<Types>> copies;
  for (uint32_t b = 0; b < blocks; ++b) {
    result.push_back(std::make_unique<Block<Types>>(BlockId{b}));
    copies.push_back(internal::CopyDarts<Types>(global, result[b]->map(),
                                                [&](Dart d) { return block_of(d) == BlockId{b}; }));
    internal::CopyCells<Types>(global, result[b]->map(), copies[b]);
  }
  for (auto it = global.darts().begin(); it != global.darts().end(); ++it) {
    if (global.template is_free<Types::n>(it)) continue;
    const Dart other = global.template beta<Types::n>(it);
    const BlockId b = block_of(it), c = block_of(other);
    if (!(b < c)) continue;
    const Label label = labeler(it);
    result[b.value]->SetCritical(copies[b.value].find(it)->second, {label, direct ? c : BlockId(), true});
    result[c.value]->SetCritical(copies[c.value].find(other)->second, {label, direct ? b : BlockId(), false});
  }
  return result;
}

}  // namespace ndmap

// SPDX-License-Identifier: GPL-3.0-or-later
// For tests: names of darts that are the same however the map is cut.
#pragma once

#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "core/map/block.h"
#include "core/map/dart_index.h"

namespace ndmap {

// A dart whatever the map it is in: the number of its n-cell, and its place in a walk through that cell.
using DartKey = std::pair<uint64_t, uint32_t>;

template <class Types>
std::map<DartIndex, DartKey> DartKeysOf(typename Types::Lcc& map) {
  std::map<DartIndex, DartKey> keys;
  auto& cells = map.template attributes<Types::n>();
  for (auto it = cells.begin(); it != cells.end(); ++it) {
    const auto& info = map.template info_of_attribute<Types::n>(it);
    std::vector<typename Types::Dart> queue = {info.reference};
    keys[IndexOf(map, info.reference)] = {info.id.initial(), 0};
    for (uint32_t i = 0; i < queue.size(); ++i) {
      for (unsigned b = 1; b < Types::n; ++b) {
        const auto next = map.beta(queue[i], static_cast<int>(b));
        const DartKey key{info.id.initial(), static_cast<uint32_t>(queue.size())};
        if (keys.emplace(IndexOf(map, next), key).second) queue.push_back(next);
      }
    }
  }
  return keys;
}

}  // namespace ndmap

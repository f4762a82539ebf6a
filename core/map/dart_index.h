// SPDX-License-Identifier: GPL-3.0-or-later
// Darts as 32-bit numbers, for both storages.
#pragma once

#include <cstddef>

#include "core/map/ids.h"

namespace ndmap {

namespace internal {
// CGAL keeps its containers protected; a derived class may look.
template <class Lcc>
struct OpenMap : Lcc {
  static auto& darts(Lcc& map) { return map.*(&OpenMap::mdarts); }
  static const auto& darts(const Lcc& map) { return map.*(&OpenMap::mdarts); }
};
}  // namespace internal

// The index of a dart of the map: stable until the dart is erased.
template <class Lcc>
DartIndex IndexOf(const Lcc& map, typename Lcc::Dart_const_handle d) {
  return DartIndex{static_cast<uint32_t>(internal::OpenMap<Lcc>::darts(map).index(d))};
}

// The dart with this index, null if there is none: an index from the wire is safe here. O(1).
template <class Lcc>
typename Lcc::Dart_handle DartAt(Lcc& map, DartIndex index) {
  auto& darts = internal::OpenMap<Lcc>::darts(map);
  if (index.value >= darts.capacity() || !darts.is_used(index.value)) return Lcc::null_handle;
  return darts.iterator_to(darts[index.value]);
}

// Bytes in use by darts and attributes (an estimate for CGAL's storage).
template <class Lcc>
size_t AllocatedBytes(const Lcc& map) {
  return map.number_of_darts() * sizeof(typename Lcc::Dart) + map.template number_of_attributes<0>() * 48;
}

}  // namespace ndmap

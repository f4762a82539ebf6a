// SPDX-License-Identifier: GPL-3.0-or-later
// Darts by number, and the memory of a map, for both storages. Lcc is MapTypes<…>::Lcc.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/map/ids.h"

namespace ndmap {

namespace internal {
template <class Container>
inline constexpr bool kIsFlat = requires {
  Container::kFlat;
};

template <class Container>
size_t ContainerBytes(const Container& container) {
  if constexpr (requires { container.allocated_bytes(); }) {
    return container.allocated_bytes();
  } else {
    return container.capacity() * sizeof(typename Container::value_type);
  }
}

struct AddAttributeBytes {
  template <unsigned i, class Lcc>
  static void run(const Lcc& lcc, size_t& bytes) {
    bytes += ContainerBytes(lcc.template attributes<i>());
  }
};

template <class Container>
constexpr size_t ElementBytes(const Container&) {
  if constexpr (requires { Container::kDartBytes; }) {
    return Container::kDartBytes;
  } else {
    return sizeof(typename Container::value_type);
  }
}

// Rows of a container that elements have or had, which ContainerBytes counts.
template <class Container>
size_t RowsOf(const Container& container) {
  if constexpr (requires { container.rows(); }) {
    return container.rows();
  } else {
    return container.capacity();
  }
}
}  // namespace internal

// The index of a dart of the map; none for the null handle and the null dart. O(1) in flat storage; in CGAL's
// it takes the square root of the number of darts.
template <class Lcc>
DartIndex IndexOf(const Lcc& lcc, typename Lcc::Dart_const_handle dart) {
  if (dart == nullptr || dart == lcc.null_dart_handle) return DartIndex{};
  return DartIndex{static_cast<uint32_t>(lcc.darts().index(dart))};
}

// All indices of darts of the map are below it; so are those of darts that were erased.
template <class Lcc>
uint32_t DartIndexBound(const Lcc& lcc) {
  if constexpr (internal::kIsFlat<typename Lcc::Dart_container>) {
    return lcc.darts().bound();
  } else {
    return static_cast<uint32_t>(lcc.darts().capacity());
  }
}

// The dart with that index, or the null handle where there is none: any index, from anywhere, may be asked.
template <class Lcc>
typename Lcc::Dart_handle DartAt(Lcc& lcc, DartIndex index) {
  if (index.value >= DartIndexBound(lcc) || !lcc.darts().is_used(size_t{index.value}))
    return Lcc::null_handle;
  return lcc.dart_handle(size_t{index.value});
}
template <class Lcc>
typename Lcc::Dart_const_handle DartAt(const Lcc& lcc, DartIndex index) {
  if (index.value >= DartIndexBound(lcc) || !lcc.darts().is_used(size_t{index.value}))
    return Lcc::null_handle;
  return lcc.dart_handle(size_t{index.value});
}

// Bytes of the map's arrays: in flat storage, of all elements ever used since the last clear(), which is what
// the arrays have in memory; in CGAL's, of all it has room for. What points of dimension 4 and above keep on
// the heap is not counted.
template <class Lcc>
size_t AllocatedBytes(const Lcc& lcc) {
  size_t bytes = internal::ContainerBytes(lcc.darts());
  Lcc::Helper::template Foreach_enabled_attributes<internal::AddAttributeBytes>::run(lcc, bytes);
  return bytes;
}

}  // namespace ndmap

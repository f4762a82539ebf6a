// SPDX-License-Identifier: GPL-3.0-or-later
// What the flat storage hands out in place of pointers: a 32-bit index, and iterators that are such an index.
#pragma once

#include <CGAL/Handle_hash_function.h>

#include <compare>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <iterator>
#include <limits>
#include <type_traits>
#include <utility>

namespace ndmap {

// The index of an element in the storage of its map; `Of` only keeps handles of different things apart.
// Equal to nullptr (CGAL's null_handle) until it is set. Stays valid until the element is erased.
template <class Of>
struct FlatHandle {
  static constexpr uint32_t kNull = std::numeric_limits<uint32_t>::max();
  uint32_t index = kNull;

  constexpr FlatHandle() = default;
  constexpr FlatHandle(std::nullptr_t) {}  // NOLINT: CGAL writes handle = null_handle
  constexpr explicit FlatHandle(uint32_t i) : index(i) {}

  friend constexpr bool operator==(const FlatHandle&, const FlatHandle&) = default;
  friend constexpr auto operator<=>(const FlatHandle&, const FlatHandle&) = default;
  template <typename H>
  friend H AbslHashValue(H h, const FlatHandle& handle) {
    return H::combine(std::move(h), handle.index);
  }
};

struct FlatDartTag;
// Index 0 is the null dart, to which the betas of a free dart point.
using FlatDart = FlatHandle<FlatDartTag>;
inline constexpr FlatDart kNullFlatDart{uint32_t{0}};
static_assert(sizeof(FlatDart) == 4 && std::is_trivially_copyable_v<FlatDart>);

// Walks the used elements of a container in the order of their indices. It is a handle, as CGAL's iterators
// are, and can be made from a bare handle; only one made by its container can be incremented. The end is the
// null handle, so that it stays the end while elements are added. A dart's iterator refers to its own handle:
// there is no object of a dart.
template <class Container, class Handle, class Reference>
class FlatIterator : public Handle {
 public:
  using iterator_category = std::forward_iterator_tag;
  using difference_type = std::ptrdiff_t;
  using reference = Reference;
  using value_type = std::remove_cvref_t<Reference>;
  using pointer = std::add_pointer_t<Reference>;

  FlatIterator() = default;
  FlatIterator(Handle handle) : Handle(handle) {}    // NOLINT: see above
  FlatIterator(std::nullptr_t) : Handle(nullptr) {}  // NOLINT
  FlatIterator(Container* container, Handle handle) : Handle(handle), container_(container) {}
  FlatIterator& operator=(Handle handle) {
    Handle::operator=(handle);
    return *this;
  }

  reference operator*() const {
    if constexpr (std::is_same_v<Reference, const Handle&>) {
      return *this;
    } else {
      return (*container_)[*this];
    }
  }
  pointer operator->() const { return &**this; }
  FlatIterator& operator++() {
    Handle::operator=(container_->Next(*this));
    return *this;
  }
  FlatIterator operator++(int) {
    FlatIterator before = *this;
    ++*this;
    return before;
  }

 private:
  Container* container_ = nullptr;
};

}  // namespace ndmap

template <class Of>
struct std::hash<ndmap::FlatHandle<Of>> {
  size_t operator()(const ndmap::FlatHandle<Of>& handle) const { return handle.index; }
};

// CGAL's hash function takes addresses otherwise.
template <class Of>
struct CGAL::internal::handle::Hash_functor<ndmap::FlatHandle<Of>> {
  std::size_t operator()(const ndmap::FlatHandle<Of>& handle) const { return handle.index; }
};

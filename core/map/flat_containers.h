// SPDX-License-Identifier: GPL-3.0-or-later
// The two containers of the flat storage: darts in columns, and attributes in chunks that never move.
#pragma once

#include <CGAL/Compact_container.h>
#include <CGAL/assertions.h>
#include <CGAL/tags.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <new>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/map/flat_handle.h"
#include "core/map/growable_array.h"

namespace ndmap::internal {

struct FlatPoolTag;

}  // namespace ndmap::internal

// CGAL's attributes let only a Compact_container construct them, whatever its allocator.
template <class T>
class CGAL::Compact_container<T, ndmap::internal::FlatPoolTag, CGAL::Default, CGAL::Default> {
 public:
  template <class... Args>
  static T* Construct(void* place, const Args&... args) {
    return ::new (place) T(args...);
  }
};

namespace ndmap::internal {

// The darts of an n-map: a column for each beta, one of 16 marks, one for each kind of attribute. Row 0 is
// the null dart, which is not counted and not iterated. A free row holds the next free row in its column of
// beta 0, with the highest bit set. The names in lower case are those that CGAL asks of a container.
template <unsigned n, size_t kAttributes>
class FlatDarts {
 public:
  static constexpr bool kFlat = true;
  static constexpr size_t kDartBytes = (n + 1) * 4 + 2 + kAttributes * 4;
  struct value_type {
    using Has_id = CGAL::Tag_false;
    unsigned char bytes[kDartBytes];
  };
  using size_type = size_t;
  using iterator = FlatIterator<const FlatDarts, FlatDart, const FlatDart&>;
  using const_iterator = iterator;

  // Makes row 0, if it is not there. Throws std::bad_alloc.
  FlatDart MakeNullDart() {
    if (bound_ == 0) {
      Grow();
      Clear(0);
      bound_ = 1;
    }
    return kNullFlatDart;
  }

  // A new dart: betas at the null dart, no marks, no attributes. Throws std::bad_alloc, with nothing changed.
  FlatDart emplace() {
    uint32_t row = free_;
    if (row != 0) {
      free_ = betas_[0][row].index & ~kFree;
    } else {
      if (bound_ == capacity_) Grow();
      row = bound_++;
    }
    Clear(row);
    ++size_;
    if (row < first_) first_ = row;
    return FlatDart(row);
  }
  void erase(FlatDart dart) {
    CGAL_assertion(is_used(dart));
    betas_[0][dart.index] = FlatDart(kFree | free_);
    free_ = dart.index;
    --size_;
  }
  // Gives the memory back to the system; the null dart goes too.
  void clear() {
    FlatDarts empty;
    swap(empty);
  }
  void swap(FlatDarts& other) noexcept {
    betas_.swap(other.betas_);
    marks_.swap(other.marks_);
    attributes_.swap(other.attributes_);
    std::swap(capacity_, other.capacity_);
    std::swap(bound_, other.bound_);
    std::swap(size_, other.size_);
    std::swap(free_, other.free_);
    std::swap(first_, other.first_);
  }

  bool is_used(size_type i) const { return i != 0 && i < bound_ && (betas_[0][i].index & kFree) == 0; }
  bool is_used(FlatDart dart) const { return is_used(size_type{dart.index}); }
  size_type index(FlatDart dart) const { return dart.index; }
  size_type size() const { return size_; }
  bool empty() const { return size_ == 0; }
  size_type capacity() const { return capacity_; }
  // All indices ever used are below it.
  uint32_t bound() const { return bound_; }
  size_t allocated_bytes() const { return bound_ * kDartBytes; }

  iterator begin() {
    first_ = NextUsed(first_).index;
    return iterator(this, FlatDart(first_));
  }
  iterator begin() const { return iterator(this, NextUsed(first_)); }
  iterator end() const { return iterator(this, nullptr); }
  FlatDart Next(FlatDart dart) const { return NextUsed(dart.index + 1); }
  // For CGAL's dart_handle(i), which asks for the handle of what is at i.
  FlatDart operator[](size_type i) const { return FlatDart(static_cast<uint32_t>(i)); }
  FlatDart iterator_to(FlatDart dart) const { return dart; }

  FlatDart beta(FlatDart dart, unsigned i) const { return betas_[i][dart.index]; }
  void set_beta(FlatDart dart, unsigned i, FlatDart to) { betas_[i][dart.index] = to; }
  // Marks change in constant maps too: CGAL's iterators mark what they pass.
  uint16_t& marks(FlatDart dart) const { return marks_[dart.index]; }
  template <size_t kColumn>
  uint32_t attribute(FlatDart dart) const {
    return attributes_[kColumn][dart.index];
  }
  template <size_t kColumn>
  void set_attribute(FlatDart dart, uint32_t attribute) {
    attributes_[kColumn][dart.index] = attribute;
  }

 private:
  static constexpr uint32_t kFree = uint32_t{1} << 31;

  void Clear(uint32_t row) {
    for (auto& column : betas_) column[row] = kNullFlatDart;
    marks_[row] = 0;
    for (auto& column : attributes_) column[row] = FlatDart::kNull;
  }

  void Grow() {
    const size_t wanted = size_t{capacity_} + 1;
    if (wanted > kFree) throw std::bad_alloc();
    size_t capacity = kFree;
    const auto grow = [&](auto& column) {
      column.Reserve(wanted);
      capacity = std::min(capacity, column.capacity());
    };
    for (auto& column : betas_) grow(column);
    grow(marks_);
    for (auto& column : attributes_) grow(column);
    capacity_ = static_cast<uint32_t>(capacity);
  }

  FlatDart NextUsed(uint32_t row) const {
    for (; row < bound_; ++row) {
      if ((betas_[0][row].index & kFree) == 0) return FlatDart(row);
    }
    return nullptr;
  }

  std::array<GrowableArray<FlatDart>, n + 1> betas_;
  mutable GrowableArray<uint16_t> marks_;
  std::array<GrowableArray<uint32_t>, kAttributes> attributes_;
  uint32_t capacity_ = 0;
  uint32_t bound_ = 0;
  uint32_t size_ = 0;
  uint32_t free_ = 0;   // the free row to use next, or 0
  uint32_t first_ = 1;  // no used row is below it
};

// Attributes of one kind: addressed by index, at addresses that never change. A bit tells whether an index is
// in use; a free place holds the next free index.
template <class T>
class FlatPool {
 public:
  using value_type = T;
  using size_type = size_t;
  using Handle = FlatHandle<T>;
  using iterator = FlatIterator<FlatPool, Handle, T&>;
  using const_iterator = FlatIterator<const FlatPool, Handle, const T&>;

  FlatPool() = default;
  FlatPool(const FlatPool&) = delete;
  FlatPool& operator=(const FlatPool&) = delete;
  ~FlatPool() { DestroyAll(); }

  // Throws std::bad_alloc, with nothing changed.
  template <class... Args>
  Handle emplace(const Args&... args) {
    const bool reuse = free_ != Handle::kNull;
    if (!reuse && bound_ == capacity()) AddChunk();
    const uint32_t i = reuse ? free_ : bound_;
    void* place = Place(i);
    uint32_t next_free = Handle::kNull;
    if (reuse) std::memcpy(&next_free, place, sizeof next_free);
    try {
      CGAL::Compact_container<T, FlatPoolTag>::Construct(place, args...);
    } catch (...) {
      if (reuse) std::memcpy(place, &next_free, sizeof next_free);
      throw;
    }
    if (reuse) {
      free_ = next_free;
    } else {
      ++bound_;
    }
    used_[i / 64] |= uint64_t{1} << (i % 64);
    ++size_;
    return Handle(i);
  }
  void erase(Handle handle) {
    CGAL_assertion(is_used(handle));
    T* object = Place(handle.index);
    object->~T();
    std::memcpy(static_cast<void*>(object), &free_, sizeof free_);
    free_ = handle.index;
    used_[handle.index / 64] &= ~(uint64_t{1} << (handle.index % 64));
    --size_;
  }
  // Gives the memory back to the system.
  void clear() {
    FlatPool empty;
    swap(empty);
  }
  void swap(FlatPool& other) noexcept {
    chunks_.swap(other.chunks_);
    used_.swap(other.used_);
    std::swap(bound_, other.bound_);
    std::swap(size_, other.size_);
    std::swap(free_, other.free_);
  }

  bool is_used(size_type i) const { return i < bound_ && ((used_[i / 64] >> (i % 64)) & 1) != 0; }
  bool is_used(Handle handle) const { return is_used(size_type{handle.index}); }
  size_type index(Handle handle) const { return handle.index; }
  size_type size() const { return size_; }
  bool empty() const { return size_ == 0; }
  size_type capacity() const { return chunks_.size() * kChunk; }
  uint32_t bound() const { return bound_; }
  size_t allocated_bytes() const { return bound_ * sizeof(T) + (bound_ + 7) / 8; }

  iterator begin() { return iterator(this, NextUsed(0)); }
  iterator end() { return iterator(this, nullptr); }
  const_iterator begin() const { return const_iterator(this, NextUsed(0)); }
  const_iterator end() const { return const_iterator(this, nullptr); }
  Handle Next(Handle handle) const { return NextUsed(size_t{handle.index} + 1); }

  T& operator[](Handle handle) { return *Place(handle.index); }
  const T& operator[](Handle handle) const { return *Place(handle.index); }

 private:
  static constexpr size_t kChunk = 8192;  // elements

  T* Place(uint32_t i) { return chunks_[i / kChunk].data() + i % kChunk; }
  const T* Place(uint32_t i) const { return chunks_[i / kChunk].data() + i % kChunk; }

  void AddChunk() {
    if (capacity() + kChunk > Handle::kNull) throw std::bad_alloc();
    used_.Reserve((capacity() + kChunk) / 64);
    Chunk chunk;
    chunk.Reserve();
    chunks_.push_back(std::move(chunk));
  }

  Handle NextUsed(size_t i) const {
    while (i < bound_) {
      const uint64_t rest = used_[i / 64] >> (i % 64);
      if (rest != 0) return Handle(static_cast<uint32_t>(i + std::countr_zero(rest)));
      i = (i / 64 + 1) * 64;
    }
    return nullptr;
  }

  void DestroyAll() {
    if constexpr (!std::is_trivially_destructible_v<T>) {
      for (Handle h = NextUsed(0); h != nullptr; h = Next(h)) Place(h.index)->~T();
    }
  }

  // Pages for kChunk objects, which it neither constructs nor destroys.
  class Chunk {
   public:
    void Reserve() { bytes_.Reserve(kChunk * sizeof(T)); }
    T* data() { return reinterpret_cast<T*>(bytes_.data()); }
    const T* data() const { return reinterpret_cast<const T*>(bytes_.data()); }

   private:
    GrowableArray<std::byte> bytes_;
  };

  std::vector<Chunk> chunks_;
  GrowableArray<uint64_t> used_;
  uint32_t bound_ = 0;
  uint32_t size_ = 0;
  uint32_t free_ = Handle::kNull;
};

}  // namespace ndmap::internal

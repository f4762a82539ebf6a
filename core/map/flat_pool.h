// SPDX-License-Identifier: GPL-3.0-or-later
// The attributes of the flat storage: in chunks that never move.
#pragma once

#include <CGAL/assertions.h>

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
      ::new (place) T(args...);
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
  size_t rows() const { return bound_; }
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
  // FlatDarts has 29 bits for the number of an attribute, and numbers from 1.
  static constexpr size_t kMaxRows = (size_t{1} << 29) - 1;

  T* Place(uint32_t i) { return chunks_[i / kChunk].data() + i % kChunk; }
  const T* Place(uint32_t i) const { return chunks_[i / kChunk].data() + i % kChunk; }

  void AddChunk() {
    if (capacity() + kChunk > kMaxRows) throw std::bad_alloc();
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

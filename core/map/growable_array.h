// SPDX-License-Identifier: GPL-3.0-or-later
// An array in pages of its own that grows without copying.
#pragma once

#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <new>
#include <type_traits>
#include <utility>

namespace ndmap {

// A column of T: capacity grows at least by doubling and by moving page tables, never elements; elements that
// were never written are zero bytes and cost no memory. Addresses change when the array grows. Several
// columns share one number of elements, so that number is kept by their owner.
template <class T>
class GrowableArray {
  static_assert(std::is_trivially_copyable_v<T> && std::is_trivially_destructible_v<T>);

 public:
  GrowableArray() = default;
  GrowableArray(GrowableArray&& other) noexcept { swap(other); }
  GrowableArray& operator=(GrowableArray&& other) noexcept {
    GrowableArray taken(std::move(other));
    swap(taken);
    return *this;
  }
  GrowableArray(const GrowableArray&) = delete;
  GrowableArray& operator=(const GrowableArray&) = delete;
  ~GrowableArray() { Release(); }

  T& operator[](size_t i) { return data_[i]; }
  const T& operator[](size_t i) const { return data_[i]; }
  T* data() { return data_; }
  const T* data() const { return data_; }
  size_t capacity() const { return bytes_ / sizeof(T); }

  // Room for at least `elements`. Throws std::bad_alloc, with nothing changed, when the system gives no
  // memory.
  void Reserve(size_t elements) {
    if (elements <= capacity()) return;
    if (elements > std::numeric_limits<size_t>::max() / 4 / sizeof(T)) throw std::bad_alloc();
    const size_t need = elements * sizeof(T);
    // Doubling may pass a limit of the address space that the need itself does not pass.
    if (Resize(std::max(need, 2 * bytes_)) || Resize(std::max(need, bytes_ + bytes_ / 8)) || Resize(need))
      return;
    throw std::bad_alloc();
  }

  // Gives all memory back to the system.
  void Release() noexcept {
    if (data_ != nullptr) munmap(data_, bytes_);
    data_ = nullptr;
    bytes_ = 0;
  }

  void swap(GrowableArray& other) noexcept {
    std::swap(data_, other.data_);
    std::swap(bytes_, other.bytes_);
  }

 private:
  static size_t PageSize() {
    static const size_t size = static_cast<size_t>(sysconf(_SC_PAGESIZE));
    return size;
  }

  bool Resize(size_t bytes) noexcept {
    bytes = (bytes + PageSize() - 1) / PageSize() * PageSize();
    void* moved = data_ == nullptr
                      ? mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0)
                      : mremap(data_, bytes_, bytes, MREMAP_MAYMOVE);
    if (moved == MAP_FAILED) return false;
    data_ = static_cast<T*>(moved);
    bytes_ = bytes;
    return true;
  }

  T* data_ = nullptr;
  size_t bytes_ = 0;
};

}  // namespace ndmap

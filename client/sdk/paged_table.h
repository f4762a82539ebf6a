// SPDX-License-Identifier: Apache-2.0
// A table by 32-bit index whose entries never move: pages that appear when they are first written. One thread
// writes, any number read what was published to them.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <utility>

namespace ndmap::internal {

template <class T>
class PagedTable {
 public:
  PagedTable() : folders_(std::make_unique<std::array<std::atomic<Folder*>, kFolders>>()) {}
  ~PagedTable() { Clear(); }
  PagedTable(const PagedTable&) = delete;
  PagedTable& operator=(const PagedTable&) = delete;

  // nullptr where no page is.
  T* Find(uint32_t index) const {
    const Folder* folder = (*folders_)[index >> (kPageBits + kFolderBits)].load(std::memory_order_acquire);
    if (folder == nullptr) return nullptr;
    Page* page = (*folder)[index >> kPageBits & (kFolderSize - 1)].load(std::memory_order_acquire);
    return page == nullptr ? nullptr : &(*page)[index & (kPageSize - 1)];
  }

  // For the writer: makes the page.
  T& Make(uint32_t index) {
    std::atomic<Folder*>& slot = (*folders_)[index >> (kPageBits + kFolderBits)];
    Folder* folder = slot.load(std::memory_order_relaxed);
    if (folder == nullptr) slot.store(folder = new Folder{}, std::memory_order_release);
    std::atomic<Page*>& place = (*folder)[index >> kPageBits & (kFolderSize - 1)];
    Page* page = place.load(std::memory_order_relaxed);
    if (page == nullptr) place.store(page = new Page{}, std::memory_order_release);
    return (*page)[index & (kPageSize - 1)];
  }

  // Nobody else may be reading.
  void Clear() {
    for (std::atomic<Folder*>& slot : *folders_) {
      std::unique_ptr<Folder> folder(slot.exchange(nullptr));
      if (folder == nullptr) continue;
      for (std::atomic<Page*>& place : *folder) delete place.exchange(nullptr);
    }
  }

 private:
  static constexpr unsigned kPageBits = 12;
  static constexpr unsigned kFolderBits = 10;
  static constexpr uint32_t kPageSize = 1u << kPageBits;
  static constexpr uint32_t kFolderSize = 1u << kFolderBits;
  static constexpr uint32_t kFolders = 1u << (32 - kPageBits - kFolderBits);
  using Page = std::array<T, kPageSize>;
  using Folder = std::array<std::atomic<Page*>, kFolderSize>;

  std::unique_ptr<std::array<std::atomic<Folder*>, kFolders>> folders_;
};

}  // namespace ndmap::internal

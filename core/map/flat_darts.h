// SPDX-License-Identifier: GPL-3.0-or-later
// The darts of the flat storage: columns of 32-bit numbers.
#pragma once

#include <CGAL/assertions.h>
#include <CGAL/tags.h>

#include <algorithm>
#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <new>

#include "absl/container/flat_hash_map.h"
#include "core/map/flat_handle.h"
#include "core/map/growable_array.h"

namespace ndmap::internal {

// The darts of an n-map: a column for each of beta_1 ... beta_n and for each kind of attribute, and nothing
// else. Row 0 is the null dart, which is not counted and not iterated. The names in lower case are those that
// CGAL asks of a container.
//
// A number takes 29 bits of its column's 32: a dart's index, or an attribute's plus 1 (0 is none). The other
// three bits of the first four columns are the marks. A free row has all 29 bits of beta_1 set, and the next
// free row in beta_2.
//
// beta_0 is not stored: it is the last dart of a walk along beta_1 around the face, which is short. Where
// that walk does not come back (in faces that are open, as they are while CGAL links and removes) beta_0 is
// kept in a table of exceptions: what was linked and cannot be found by walking. It is empty as long as all
// faces are closed.
template <unsigned n, size_t kAttributes>
class FlatDarts {
 public:
  static constexpr bool kFlat = true;
  static constexpr size_t kColumns = n + kAttributes;
  static constexpr size_t kDartBytes = kColumns * sizeof(uint32_t);
  static constexpr size_t kMarks = 12;
  // Darts, the null dart included, and attributes of one kind.
  static constexpr uint32_t kMaxRows = (uint32_t{1} << 29) - 1;
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
      free_ = columns_[1][row] & kIndex;
    } else {
      if (bound_ == capacity_) Grow();
      row = bound_++;
    }
    Clear(row);
    ++size_;
    if (row < first_) first_ = row;
    return FlatDart(row);
  }
  // The other darts of its face are unlinked or erased, too, before anybody asks for their beta_0.
  void erase(FlatDart dart) {
    CGAL_assertion(is_used(dart));
    columns_[0][dart.index] = kIndex;
    columns_[1][dart.index] = free_;
    free_ = dart.index;
    --size_;
    if (!exceptions_.empty()) exceptions_.erase(dart.index);
  }
  // Gives the memory back to the system; the null dart goes too.
  void clear() {
    FlatDarts empty;
    swap(empty);
  }
  void swap(FlatDarts& other) noexcept {
    columns_.swap(other.columns_);
    exceptions_.swap(other.exceptions_);
    std::swap(capacity_, other.capacity_);
    std::swap(bound_, other.bound_);
    std::swap(size_, other.size_);
    std::swap(free_, other.free_);
    std::swap(first_, other.first_);
  }

  bool is_used(size_type i) const { return i != 0 && i < bound_ && (columns_[0][i] & kIndex) != kIndex; }
  bool is_used(FlatDart dart) const { return is_used(size_type{dart.index}); }
  size_type index(FlatDart dart) const { return dart.index; }
  size_type size() const { return size_; }
  bool empty() const { return size_ == 0; }
  size_type capacity() const { return capacity_; }
  // All indices ever used are below it.
  uint32_t bound() const { return bound_; }
  // Darts ever used, which the next ones are put in the place of.
  size_t rows() const { return bound_ == 0 ? 0 : bound_ - 1; }
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

  // O(1), but O(darts of the face) for i = 0.
  FlatDart beta(FlatDart dart, unsigned i) const {
    return i == 0 ? Previous(dart) : FlatDart(columns_[i - 1][dart.index] & kIndex);
  }
  // One side of a link; CGAL tells the other, too. O(darts of the faces) for i = 0 and 1.
  void set_beta(FlatDart dart, unsigned i, FlatDart to) {
    if (i == 0) {
      SetPrevious(dart.index, to.index);
    } else if (i == 1) {
      SetNext(dart.index, to.index);
    } else {
      SetColumn(i - 1, dart.index, to.index);
    }
  }
  // beta_1(dart) = to and beta_0(to) = dart, where every face that this opens is closed again before anybody
  // asks for its beta_0. O(1).
  void LinkInClosedFaces(FlatDart dart, FlatDart to) {
    if (exceptions_.empty()) {
      SetColumn(0, dart.index, to.index);
    } else {
      SetNext(dart.index, to.index);
      SetPrevious(to.index, dart.index);
    }
  }
  // How many darts have a beta_0 that is kept.
  size_t exceptions() const { return exceptions_.size(); }

  // Marks change in constant maps too: CGAL's iterators mark what they pass.
  bool mark(FlatDart dart, size_t m) const {
    return (columns_[m / kMarkBits][dart.index] >> (kIndexBits + m % kMarkBits) & 1) != 0;
  }
  void flip_mark(FlatDart dart, size_t m) const {
    columns_[m / kMarkBits][dart.index] ^= uint32_t{1} << (kIndexBits + m % kMarkBits);
  }
  std::bitset<kMarks> marks(FlatDart dart) const {
    uint32_t marks = 0;
    for (size_t c = 0; c < kMarks / kMarkBits; ++c) {
      marks |= columns_[c][dart.index] >> kIndexBits << kMarkBits * c;
    }
    return std::bitset<kMarks>(marks);
  }
  void set_marks(FlatDart dart, const std::bitset<kMarks>& marks) const {
    const uint32_t bits = static_cast<uint32_t>(marks.to_ulong());
    for (size_t c = 0; c < kMarks / kMarkBits; ++c) {
      uint32_t& at = columns_[c][dart.index];
      at = (at & kIndex) | bits >> kMarkBits * c << kIndexBits;
    }
  }

  template <size_t kColumn>
  uint32_t attribute(FlatDart dart) const {
    return (columns_[n + kColumn][dart.index] & kIndex) - 1;
  }
  template <size_t kColumn>
  void set_attribute(FlatDart dart, uint32_t attribute) {
    SetColumn(n + kColumn, dart.index, attribute + 1);
  }

 private:
  static constexpr unsigned kIndexBits = 29;
  static constexpr unsigned kMarkBits = 32 - kIndexBits;
  static constexpr uint32_t kIndex = (uint32_t{1} << kIndexBits) - 1;
  static_assert(n >= 2 && kColumns >= kMarks / kMarkBits && kMarks % kMarkBits == 0 &&
                FlatDart::kNull + 1 == 0);

  void SetColumn(size_t column, uint32_t row, uint32_t number) {
    uint32_t& at = columns_[column][row];
    at = (at & ~kIndex) | number;
  }

  void Clear(uint32_t row) {
    for (auto& column : columns_) column[row] = 0;
  }

  void Grow() {
    const size_t wanted = size_t{capacity_} + 1;
    if (wanted > kMaxRows) throw std::bad_alloc();
    size_t capacity = kMaxRows;
    for (auto& column : columns_) {
      column.Reserve(wanted);
      capacity = std::min(capacity, column.capacity());
    }
    capacity_ = static_cast<uint32_t>(capacity);
  }

  FlatDart NextUsed(uint32_t row) const {
    for (; row < bound_; ++row) {
      if ((columns_[0][row] & kIndex) != kIndex) return FlatDart(row);
    }
    return nullptr;
  }

  // beta_1, and 0 too where the walk has come to a row that is free.
  uint32_t NextOf(uint32_t row) const {
    const uint32_t next = columns_[0][row] & kIndex;
    return next == kIndex ? 0 : next;
  }

  // The dart before it by walking: 0 if the walk ends, or comes into a circle that the dart is not on (a walk
  // looks at about three times the darts of that circle then: Brent's algorithm).
  uint32_t WalkToPrevious(uint32_t row) const {
    uint32_t at = row, kept = row;
    for (size_t steps = 1, keep = 8;; ++steps) {
      const uint32_t next = NextOf(at);
      if (next == row) return at;
      if (next == 0 || next == kept) return 0;
      at = next;
      if (steps == keep) {
        kept = at;
        keep *= 2;
      }
    }
  }

  FlatDart Previous(FlatDart dart) const {
    if (!exceptions_.empty()) {
      const auto it = exceptions_.find(dart.index);
      if (it != exceptions_.end()) return FlatDart(it->second);
    }
    return FlatDart(WalkToPrevious(dart.index));
  }

  void SetPrevious(uint32_t row, uint32_t previous) {
    if (WalkToPrevious(row) != previous) {
      exceptions_[row] = previous;
    } else if (!exceptions_.empty()) {
      exceptions_.erase(row);
    }
  }

  // Changes beta_1 of a dart, and of none beta_0.
  void SetNext(uint32_t row, uint32_t next) {
    const uint32_t before = NextOf(row);
    if (before == next) return;
    // The circle that is opened: its darts cannot be walked to any more.
    if (before != 0 && WalkToPrevious(row) != 0) {
      for (uint32_t previous = row, d = before;; previous = d, d = NextOf(d)) {
        exceptions_.emplace(d, previous);
        if (d == row) break;
      }
    }
    SetColumn(0, row, next);
    if (next == 0 || WalkToPrevious(row) == 0) return;
    // The circle that is closed: they can now, and those that had no beta_0 keep none.
    for (uint32_t previous = row, d = next;; previous = d, d = NextOf(d)) {
      const auto it = exceptions_.emplace(d, 0).first;
      if (it->second == previous) exceptions_.erase(it);
      if (d == row) break;
    }
  }

  mutable std::array<GrowableArray<uint32_t>, kColumns> columns_;
  absl::flat_hash_map<uint32_t, uint32_t> exceptions_;
  uint32_t capacity_ = 0;
  uint32_t bound_ = 0;
  uint32_t size_ = 0;
  uint32_t free_ = 0;   // the free row to use next, or 0
  uint32_t first_ = 1;  // no used row is below it
};

}  // namespace ndmap::internal

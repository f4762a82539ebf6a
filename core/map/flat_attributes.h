// SPDX-License-Identifier: GPL-3.0-or-later
// The attributes of cells in flat storage, in place of CGAL's, which keep a count of 8 bytes: what CGAL asks
// of an attribute, whose dart and count take 8 bytes together. The names in lower case are CGAL's.
#pragma once

#include <CGAL/Combinatorial_map_functors.h>
#include <CGAL/assertions.h>
#include <CGAL/tags.h>

#include <cstddef>
#include <cstdint>
#include <new>

namespace ndmap::internal {

// An attribute with an Info: 8 bytes more than that.
template <class Refs, class Info_>
class FlatAttribute {
 public:
  using Info = Info_;
  using Supports_cell_dart = CGAL::Tag_true;
  using Dart_handle = typename Refs::Dart_handle;
  using Dart_const_handle = typename Refs::Dart_const_handle;
  using Alloc = typename Refs::Alloc;
  using On_merge = CGAL::Null_functor;
  using On_split = CGAL::Null_functor;
  using Has_id = CGAL::Tag_false;

  FlatAttribute() = default;
  explicit FlatAttribute(const Info& info) : info_(info) {}

  Info& info() { return info_; }
  const Info& info() const { return info_; }
  Dart_handle dart() const { return dart_; }
  void set_dart(Dart_handle dart) { dart_ = dart; }
  bool is_valid() const { return dart_ != Refs::null_handle; }

  // For the storage: how many darts have it. There are fewer than 2^29 darts.
  size_t get_nb_refs() const { return references_; }
  void reset_nb_refs() { references_ = 0; }
  void inc_nb_refs() { ++references_; }
  void dec_nb_refs() {
    CGAL_assertion(references_ > 0);
    --references_;
  }

  friend bool operator==(const FlatAttribute& a, const FlatAttribute& b) { return a.info_ == b.info_; }

 private:
  Info info_;
  Dart_handle dart_ = Refs::null_handle;
  uint32_t references_ = 0;
};

// An attribute with a point and an Info of one byte: 8 bytes more than the point.
template <class Refs, class Info_>
class FlatVertex {
 public:
  using Info = Info_;
  using Point = typename Refs::Point;
  using Supports_cell_dart = CGAL::Tag_true;
  using Dart_handle = typename Refs::Dart_handle;
  using Dart_const_handle = typename Refs::Dart_const_handle;
  using Alloc = typename Refs::Alloc;
  using On_merge = CGAL::Null_functor;
  using On_split = CGAL::Null_functor;
  using Functor_on_merge = On_merge;
  using Functor_on_split = On_split;
  using Has_id = CGAL::Tag_false;

  FlatVertex() : references_(0) {}
  explicit FlatVertex(const Point& point) : point_(point), references_(0) {}
  FlatVertex(const Point& point, const Info& info) : point_(point), references_(0), info_(info) {}

  Point& point() { return point_; }
  const Point& point() const { return point_; }
  Info& info() { return info_; }
  const Info& info() const { return info_; }
  Dart_handle dart() const { return dart_; }
  void set_dart(Dart_handle dart) { dart_ = dart; }
  bool is_valid() const { return dart_ != Refs::null_handle; }

  // For the storage: how many darts have it. Throws std::bad_alloc for the 2^24th.
  size_t get_nb_refs() const { return references_; }
  void reset_nb_refs() { references_ = 0; }
  void inc_nb_refs() {
    if (references_ == kMaxReferences) throw std::bad_alloc();
    ++references_;
  }
  void dec_nb_refs() {
    CGAL_assertion(references_ > 0);
    --references_;
  }

  friend bool operator==(const FlatVertex& a, const FlatVertex& b) {
    return a.info_ == b.info_ && a.point_ == b.point_;
  }

 private:
  static constexpr uint32_t kMaxReferences = (uint32_t{1} << 24) - 1;
  static_assert(sizeof(Info) == 1 && sizeof(Dart_handle) == 4);

  Point point_;
  Dart_handle dart_ = Refs::null_handle;
  uint32_t references_ : 24;
  Info info_;
};

}  // namespace ndmap::internal

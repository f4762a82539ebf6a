// SPDX-License-Identifier: GPL-3.0-or-later
// The storage of CGAL's linear cell complex for maps whose Items are MapItems<n, kSlots, true>: darts in
// columns of 32-bit numbers (core/map/flat_darts.h), attributes in chunks at stable addresses (flat_pool.h)
// with 8 bytes of their own beside what they carry (flat_attributes.h). A dart of a 3-map takes 20 bytes with
// the attributes of vertices and volumes (64.3 with CGAL's own storage), each slot 4 more. CGAL's operations
// work on it, with these differences from CGAL's own storage:
// - handles of darts and attributes are 4 bytes and cannot be dereferenced: ask the map
//   (info_of_attribute<i>(a), point_of_vertex_attribute(v), ...), which works for both storages; hence CGAL's
//   XML reader does not compile;
// - const handles are the same type as handles;
// - darts and attributes are walked in the order of their indices, and elements added meanwhile may be met;
// - beta_0 is not stored: it costs a walk around the face, and so do CGAL's links and unlinks by beta_0 and
//   beta_1 (core/map/link.h for those that may be cheaper);
// - 12 marks, so a copy into a map of CGAL's storage, which has 32, must be made without marks: CGAL asks the
//   source for all 32;
// - fewer than 2^29 darts and as many attributes of a kind, and 2^24 darts at a vertex; std::bad_alloc when
//   memory or indices run out, with the map unchanged.
// The index of a dart is stable until the dart is erased; then it is given to a later dart.
#pragma once

#include <CGAL/Linear_cell_complex_for_combinatorial_map.h>

#include <bitset>
#include <cstddef>
#include <cstdint>
#include <iostream>
#include <memory>
#include <tuple>
#include <type_traits>

#include "core/map/flat_darts.h"
#include "core/map/flat_handle.h"
#include "core/map/flat_pool.h"

namespace ndmap::internal {

// Defined in core/map/map_types.h.
template <unsigned n, bool kSlots, bool kFlat>
struct MapItems;

// CGAL's helper takes iterators of attribute containers as handles; ours hold an index only.
template <class Storage>
struct FlatHelper : CGAL::internal::Combinatorial_map_helper<Storage> {
  using Base = CGAL::internal::Combinatorial_map_helper<Storage>;

  template <int d, class Type = typename Base::template Attribute_type<d>::type>
  struct Attribute_handle {
    using type = FlatHandle<Type>;
  };
  template <int d>
  struct Attribute_handle<d, CGAL::Void> {
    using type = CGAL::Void*;
  };
  template <int d, class Type = typename Base::template Attribute_type<d>::type>
  struct Attribute_const_handle : Attribute_handle<d, Type> {};
};

}  // namespace ndmap::internal

namespace CGAL {

// The members are those of CGAL's primary template, whose documentation holds; `protected` is as there.
template <unsigned int d_, unsigned int ambient_dim, class Traits_, unsigned n, bool kSlots, class Alloc_,
          class Concurrent_tag>
class CMap_linear_cell_complex_storage_1<d_, ambient_dim, Traits_, ndmap::internal::MapItems<n, kSlots, true>,
                                         Alloc_, Concurrent_tag> {
 public:
  using Items = ndmap::internal::MapItems<n, kSlots, true>;
  using Self = CMap_linear_cell_complex_storage_1<d_, ambient_dim, Traits_, Items, Alloc_, Concurrent_tag>;
  using Alloc = Alloc_;
  using Point = typename Traits_::Point;
  using Vector = typename Traits_::Vector;
  using FT = typename Traits_::FT;
  using Use_index = Tag_false;  // with Tag_true CGAL would give all attributes the type of dart handles
  using Hash_function = Handle_hash_function;
  using size_type = std::size_t;
  static const size_type NB_MARKS = 12;
  static const unsigned int dimension = d_;

  using Dart_handle = ndmap::FlatDart;
  using Dart_const_handle = ndmap::FlatDart;
  using Null_handle_type = std::nullptr_t;
  static constexpr Null_handle_type null_handle = nullptr;

  using Dart_wrapper = typename Items::template Dart_wrapper<Self>;
  using Dart_info = typename internal::Get_dart_info<Dart_wrapper>::type;
  using Darts_with_id = typename internal::Get_darts_with_id<Dart_wrapper>::type;
  static_assert(std::is_same_v<Dart_info, Void> && std::is_same_v<Darts_with_id, Tag_false>,
                "flat storage keeps nothing with a dart but betas, marks and attributes");
  using Attributes = typename internal::Get_attributes_tuple<Dart_wrapper>::type;

  template <typename T>
  struct Container_for_attributes : ndmap::internal::FlatPool<T> {};
  using Helper = ndmap::internal::FlatHelper<Self>;

  template <int i>
  struct Attribute_type : Helper::template Attribute_type<i> {};
  template <int i>
  struct Attribute_handle : Helper::template Attribute_handle<i> {};
  template <int i>
  struct Attribute_const_handle : Helper::template Attribute_const_handle<i> {};
  template <int i>
  struct Attribute_range : Helper::template Attribute_range<i> {};
  template <int i>
  struct Attribute_const_range : Helper::template Attribute_const_range<i> {};

  using Vertex_attribute = typename Attribute_type<0>::type;
  using Vertex_attribute_handle = typename Attribute_handle<0>::type;
  using Vertex_attribute_const_handle = typename Attribute_const_handle<0>::type;
  using Vertex_attribute_range = typename Attribute_range<0>::type;
  using Vertex_attribute_const_range = typename Attribute_const_range<0>::type;

  using Dart_container = ndmap::internal::FlatDarts<d_, Helper::nb_attribs>;
  using Dart = typename Dart_container::value_type;
  static_assert(NB_MARKS == Dart_container::kMarks);

  void init_storage() { null_dart_handle = mdarts.MakeNullDart(); }

  template <unsigned int i>
  bool is_free(Dart_const_handle dart) const {
    return get_beta<static_cast<int>(i)>(dart) == ndmap::kNullFlatDart;
  }
  bool is_free(Dart_const_handle dart, unsigned int i) const {
    return get_beta(dart, static_cast<int>(i)) == ndmap::kNullFlatDart;
  }
  bool is_perforated(Dart_const_handle) const { return false; }

  void set_dart_marks(Dart_const_handle dart, const std::bitset<NB_MARKS>& marks) const {
    CGAL_assertion(dart != nullptr);
    mdarts.set_marks(dart, marks);
  }
  std::bitset<NB_MARKS> get_dart_marks(Dart_const_handle dart) const {
    CGAL_assertion(dart != nullptr);
    return mdarts.marks(dart);
  }
  bool get_dart_mark(Dart_const_handle dart, size_type mark) const {
    CGAL_assertion(dart != nullptr && mark < NB_MARKS);
    return mdarts.mark(dart, mark);
  }
  void set_dart_mark(Dart_const_handle dart, size_type mark, bool value) const {
    if (get_dart_mark(dart, mark) != value) flip_dart_mark(dart, mark);
  }
  void flip_dart_mark(Dart_const_handle dart, size_type mark) const {
    CGAL_assertion(dart != nullptr && mark < NB_MARKS);
    mdarts.flip_mark(dart, mark);
  }

  Dart_handle get_beta(Dart_const_handle dart, int i) const {
    CGAL_assertion(dart != nullptr && i >= 0 && i <= static_cast<int>(dimension));
    return mdarts.beta(dart, static_cast<unsigned>(i));
  }
  template <int i>
  Dart_handle get_beta(Dart_const_handle dart) const {
    static_assert(i >= 0 && i <= static_cast<int>(dimension));
    CGAL_assertion(dart != nullptr);
    return mdarts.beta(dart, i);
  }

  template <unsigned int i>
  typename Attribute_handle<i>::type attribute(Dart_const_handle dart) const {
    CGAL_assertion(dart != nullptr);
    return typename Attribute_handle<i>::type(mdarts.template attribute<kColumn<i>>(dart));
  }
  template <unsigned int i>
  typename Attribute_handle<i>::type copy_attribute(typename Attribute_const_handle<i>::type attribute) {
    const auto copy = Pool<i>().emplace(get_attribute<i>(attribute));
    init_attribute_ref_counting<i>(copy);
    return copy;
  }
  template <unsigned int i>
  bool is_valid_attribute(typename Attribute_const_handle<i>::type attribute) const {
    return get_attribute<i>(attribute).is_valid();
  }

  template <unsigned int i>
  std::size_t get_attribute_ref_counting(typename Attribute_const_handle<i>::type attribute) const {
    return get_attribute<i>(attribute).get_nb_refs();
  }
  template <unsigned int i>
  void init_attribute_ref_counting(typename Attribute_handle<i>::type attribute) {
    get_attribute<i>(attribute).reset_nb_refs();
  }
  template <unsigned int i>
  void inc_attribute_ref_counting(typename Attribute_handle<i>::type attribute) {
    get_attribute<i>(attribute).inc_nb_refs();
  }
  template <unsigned int i>
  void dec_attribute_ref_counting(typename Attribute_handle<i>::type attribute) {
    get_attribute<i>(attribute).dec_nb_refs();
  }

  template <unsigned int i>
  typename Attribute_type<i>::type& get_attribute(typename Attribute_handle<i>::type attribute) {
    CGAL_assertion(Pool<i>().is_used(attribute));
    return Pool<i>()[attribute];
  }
  template <unsigned int i>
  const typename Attribute_type<i>::type& get_attribute(
      typename Attribute_const_handle<i>::type attribute) const {
    CGAL_assertion(Pool<i>().is_used(attribute));
    return Pool<i>()[attribute];
  }
  template <unsigned int i>
  Dart_handle dart_of_attribute(typename Attribute_const_handle<i>::type attribute) const {
    return get_attribute<i>(attribute).dart();
  }
  template <unsigned int i>
  void set_dart_of_attribute(typename Attribute_handle<i>::type attribute, Dart_handle dart) {
    get_attribute<i>(attribute).set_dart(dart);
  }
  template <unsigned int i>
  typename Attribute_type<i>::type::Info& info_of_attribute(typename Attribute_handle<i>::type attribute) {
    return get_attribute<i>(attribute).info();
  }
  template <unsigned int i>
  const typename Attribute_type<i>::type::Info& info_of_attribute(
      typename Attribute_const_handle<i>::type attribute) const {
    return get_attribute<i>(attribute).info();
  }

  template <unsigned int i>
  typename Attribute_type<i>::type::Info& info(Dart_handle dart) {
    return info_of_attribute<i>(attribute<i>(dart));
  }
  template <unsigned int i>
  const typename Attribute_type<i>::type::Info& info(Dart_const_handle dart) const {
    return info_of_attribute<i>(attribute<i>(dart));
  }
  template <unsigned int i>
  Dart_handle dart(Dart_const_handle dart) const {
    return dart_of_attribute<i>(attribute<i>(dart));
  }
  Point& point_of_vertex_attribute(Vertex_attribute_handle vertex) {
    return get_attribute<0>(vertex).point();
  }
  const Point& point_of_vertex_attribute(Vertex_attribute_const_handle vertex) const {
    return get_attribute<0>(vertex).point();
  }

  // basic_link_beta_1 for whoever closes all faces that he opens before beta_0 is asked for: core/map/link.h.
  void LinkInClosedFaces(Dart_handle dart, Dart_handle to) {
    CGAL_assertion(dart != nullptr && to != nullptr && dart != null_dart_handle && to != null_dart_handle);
    mdarts.LinkInClosedFaces(dart, to);
  }

  void display_dart(Dart_const_handle dart) const { std::cout << dart.index; }
  template <unsigned int i>
  void display_attribute(typename Attribute_const_handle<i>::type attribute) const {
    std::cout << attribute.index;
  }

 protected:
  template <unsigned int i>
  void basic_set_dart_attribute(Dart_handle dart, typename Attribute_handle<i>::type attribute) {
    mdarts.template set_attribute<kColumn<i>>(dart, attribute.index);
  }
  template <unsigned int i>
  void dart_link_beta(Dart_handle dart, Dart_handle to) {
    dart_link_beta(dart, to, i);
  }
  void dart_link_beta(Dart_handle dart, Dart_handle to, unsigned int i) {
    CGAL_assertion(i <= dimension && dart != nullptr && to != nullptr && dart != null_dart_handle);
    mdarts.set_beta(dart, i, to);
  }
  template <unsigned int i>
  void dart_unlink_beta(Dart_handle dart) {
    dart_unlink_beta(dart, i);
  }
  void dart_unlink_beta(Dart_handle dart, unsigned int i) {
    CGAL_assertion(i <= dimension && dart != nullptr);
    mdarts.set_beta(dart, i, ndmap::kNullFlatDart);
  }

 public:
  Dart_handle null_dart_handle;

 protected:
  // CGAL swaps a container of the null dart by this name; ours is a row among the darts.
  struct NoNullDartContainer {
    void swap(NoNullDartContainer&) {}
  };

  template <unsigned int i>
  static constexpr size_t kColumn = Helper::template Dimension_index<i>::value;
  template <unsigned int i>
  auto& Pool() {
    return std::get<kColumn<i>>(mattribute_containers);
  }
  template <unsigned int i>
  const auto& Pool() const {
    return std::get<kColumn<i>>(mattribute_containers);
  }

  Dart_container mdarts;
  NoNullDartContainer mnull_dart_container;
  typename Helper::Attribute_containers mattribute_containers;
};

// CGAL's version walks on from a bare handle, which here has no container to ask for the next dart: the map
// has.
template <typename Map_, bool Const>
requires(Map_::Dart_container::kFlat) class CMap_dart_iterator_basic_of_all<Map_, Const>
    : public CMap_dart_iterator<Map_, Const> {
 public:
  using Self = CMap_dart_iterator_basic_of_all;
  using Base = CMap_dart_iterator<Map_, Const>;
  using Dart_handle = typename Base::Dart_handle;
  using Map = typename Base::Map;
  using size_type = typename Map::size_type;
  using Use_mark = Tag_false;

  explicit CMap_dart_iterator_basic_of_all(Map& map) : Base(map, map.darts().begin()) {}
  CMap_dart_iterator_basic_of_all(Map& map, size_type) : Base(map, map.darts().begin()) {}
  CMap_dart_iterator_basic_of_all(Map& map, Dart_handle dart) : Base(map, dart) {}
  CMap_dart_iterator_basic_of_all(Map& map, Dart_handle dart, size_type) : Base(map, dart) {}

  Self& operator++() {
    CGAL_assertion(this->cont());
    this->set_current_dart(this->mmap->darts().Next(*this));
    this->mprev_op = this->cont() ? OP_POP : OP_END;
    return *this;
  }
  Self operator++(int) {
    Self before = *this;
    ++*this;
    return before;
  }
};

}  // namespace CGAL

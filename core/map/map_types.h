// SPDX-License-Identifier: GPL-3.0-or-later
// The CGAL map that a block stores, for any dimension n and for two storages: CGAL's own (pointers; the
// reference in tests) and ours (core/map/flat_storage.h: arrays and 32-bit indices; what services use).
#pragma once

#include <CGAL/Cell_attribute.h>
#include <CGAL/Cell_attribute_with_point.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Linear_cell_complex_for_combinatorial_map.h>
#include <CGAL/Linear_cell_complex_traits.h>

#include <array>
#include <cstdint>
#include <tuple>
#include <type_traits>

#include "core/map/flat_attributes.h"
#include "core/map/flat_storage.h"
#include "core/map/ids.h"
#include "core/mesh/volume_mesh.h"

namespace ndmap {

// Beside its point a vertex knows the level at which it was made; level(edge) = max of its two ends.
struct VertexInfo {
  uint8_t level = 0;

  friend bool operator==(const VertexInfo&, const VertexInfo&) = default;
};

// Whether an n-cell meets the surface, or which side of it the cell is on.
// (kClear: known not to meet the surface, side not asked yet).
enum class CellState : uint8_t { kUnknown = 0, kOutside = 1, kInside = 2, kCut = 3, kClear = 4 };

// What every n-cell knows. `reference` is the dart at the corner from which child numbers count
// (core/algorithm/refine/hexahedron.h); of a cell that is no hexahedron, its dart number 0
// (core/mesh/cell_darts.h).
template <class Refs>
struct CellInfo {
  CellId id;
  typename Refs::Dart_handle reference = Refs::null_handle;
  CellState state = CellState::kUnknown;
  CellKind kind = CellKind::kHexahedron;

  // For CGAL's is_isomorphic_to, between two maps: a handle means nothing in the other map.
  friend bool operator==(const CellInfo& a, const CellInfo& b) {
    return a.id == b.id && a.state == b.state && a.kind == b.kind;
  }
};

// A row number in the attribute columns of one dimension: the slot that an i-cell has for user attributes.
struct AttributeSlot {
  static constexpr uint32_t kNone = 0xffffffff;
  uint32_t row = kNone;

  friend bool operator==(const AttributeSlot&, const AttributeSlot&) = default;
};

namespace internal {

// The attributes of one kind of storage: CGAL's, or the smaller ones that flat storage has instead.
template <class Refs, bool kFlat>
struct AttributeKinds {
  using Vertex = CGAL::Cell_attribute_with_point<Refs, VertexInfo>;
  using Slot = CGAL::Cell_attribute<Refs, AttributeSlot, CGAL::Tag_true>;
  using Cell = CGAL::Cell_attribute<Refs, CellInfo<Refs>, CGAL::Tag_true>;
};
template <class Refs>
struct AttributeKinds<Refs, true> {
  using Vertex = FlatVertex<Refs, VertexInfo>;
  using Slot = FlatAttribute<Refs, AttributeSlot>;
  using Cell = FlatAttribute<Refs, CellInfo<Refs>>;
};

// Attributes of an n-map: points on vertices, CellInfo on n-cells, and between them slots or nothing.
template <unsigned n, class Slot, class Kinds>
struct AttributeTuple;
template <class Slot, class Kinds>
struct AttributeTuple<2, Slot, Kinds> {
  using type = std::tuple<typename Kinds::Vertex, Slot, typename Kinds::Cell>;
};
template <class Slot, class Kinds>
struct AttributeTuple<3, Slot, Kinds> {
  using type = std::tuple<typename Kinds::Vertex, Slot, Slot, typename Kinds::Cell>;
};
template <class Slot, class Kinds>
struct AttributeTuple<4, Slot, Kinds> {
  using type = std::tuple<typename Kinds::Vertex, Slot, Slot, Slot, typename Kinds::Cell>;
};

// FlatStorage is chosen by the tag in the Items class: see flat_storage.h.
template <unsigned n, bool kSlots, bool kFlat>
struct MapItems {
  using UseFlatStorage = std::bool_constant<kFlat>;
  template <class Refs>
  struct Dart_wrapper {
    using Dart_info = void;
    using Kinds = AttributeKinds<Refs, kFlat>;
    using Slot = std::conditional_t<kSlots, typename Kinds::Slot, void>;
    using Attributes = typename AttributeTuple<n, Slot, Kinds>::type;
  };
};

}  // namespace internal

enum class StorageKind { kFlat, kCgal };

// The types of one kind of map. Surfaces (n = 2) lie in space; otherwise the ambient dimension is n.
// With kSlots, i-cells with 0 < i < n have an AttributeSlot too (4 more bytes a dart and dimension).
template <unsigned n_, StorageKind kStorage, bool kSlots = false>
struct MapTypes {
  static constexpr unsigned n = n_;
  static constexpr unsigned kAmbient = n_ < 3 ? 3 : n_;
  static constexpr StorageKind storage = kStorage;
  using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
  using Traits = std::conditional_t<(kAmbient <= 3), CGAL::Linear_cell_complex_traits<kAmbient, Kernel>,
                                    CGAL::Linear_cell_complex_traits<kAmbient>>;
  using Items = internal::MapItems<n, kSlots, kStorage == StorageKind::kFlat>;
  using Lcc = CGAL::Linear_cell_complex_for_combinatorial_map<n, kAmbient, Traits, Items>;
  using Dart = typename Lcc::Dart_handle;
  using Vertex = typename Lcc::template Attribute_handle<0>::type;
  using Cell = typename Lcc::template Attribute_handle<n>::type;
  using Point = typename Lcc::Point;
  using Coordinates = std::array<double, kAmbient>;
};

}  // namespace ndmap

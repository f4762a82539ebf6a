// SPDX-License-Identifier: GPL-3.0-or-later
// The reference of the central property: the global map on ONE plain CGAL linear cell complex with CGAL's own
// storage, refined with CGAL's operations only (plain_hexahedra.h). Whatever the number of blocks and the
// order of messages, the distributed map must be isomorphic to it, points bit for bit (compare.h).
#pragma once

#include <CGAL/Cell_attribute.h>
#include <CGAL/Cell_attribute_with_point.h>
#include <CGAL/Linear_cell_complex_for_combinatorial_map.h>

#include <array>
#include <cstdint>
#include <memory>
#include <tuple>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "core/geometry/surface.h"
#include "core/map/ids.h"
#include "core/mesh/volume_mesh.h"

namespace ndmap::reference {

struct ReferenceVertex {
  int level = 0;
};
struct ReferenceHexahedron {
  CellId id;
  int level = 0;
};
struct ReferenceItems {
  template <class Refs>
  struct Dart_wrapper {
    using Attributes = std::tuple<CGAL::Cell_attribute_with_point<Refs, ReferenceVertex>, void, void,
                                  CGAL::Cell_attribute<Refs, ReferenceHexahedron>>;
  };
};
using ReferenceLcc =
    CGAL::Linear_cell_complex_for_combinatorial_map<3, 3, CGAL::Linear_cell_complex_traits<3>,
                                                    ReferenceItems>;

class ReferenceMap {
 public:
  using Dart = ReferenceLcc::Dart_handle;

  // nx * ny * nz hexahedra; corner(i, j, k) is the point of grid corner (i, j, k), 0 <= i <= nx and so on.
  // Hexahedron (i, j, k) is initial cell i + nx * (j + ny * k). The counts must be at least 1.
  static ReferenceMap Build(uint32_t nx, uint32_t ny, uint32_t nz,
                            absl::FunctionRef<Point3(uint32_t, uint32_t, uint32_t)> corner);

  // The cells of a mesh, glued where they list the same points; cell i is initial cell i.
  static ReferenceMap BuildMesh(const VolumeMesh& mesh);

  // Splits a hexahedron in eight, Child(0) ... Child(7). NOT_FOUND when there is no such hexahedron (now).
  // Not after Remove: what is left of a removed neighbour's split edges would still be handled, but the
  // distributed map has its removal in a later phase too.
  absl::Status Refine(CellId id);
  // Erases a hexahedron, or another cell of a mesh. NOT_FOUND as above.
  absl::Status Remove(CellId id);

  bool Contains(CellId id) const { return hexahedra_.contains(id); }
  // The dart from corner 0 to corner 1 in the face z = 0 of a hexahedron of this map.
  Dart ReferenceDart(CellId id) const { return hexahedra_.at(id); }
  // The corners of a hexahedron of this map.
  std::array<Point3, 8> Corners(CellId id) const;
  // All hexahedra, ascending.
  std::vector<CellId> Leaves() const;

  const ReferenceLcc& lcc() const { return *lcc_; }

 private:
  ReferenceMap() : lcc_(std::make_unique<ReferenceLcc>()) {}

  std::unique_ptr<ReferenceLcc> lcc_;
  absl::flat_hash_map<CellId, Dart> hexahedra_;
};

// The name of the hexahedron of a dart, as compare.h wants it.
inline CellId NameOf(const ReferenceLcc& lcc, ReferenceLcc::Dart_const_handle d) { return lcc.info<3>(d).id; }

}  // namespace ndmap::reference

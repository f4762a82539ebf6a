// SPDX-License-Identifier: GPL-3.0-or-later
// Random surfaces of polygons with their cut into blocks and what to remove, and each as one plain CGAL map.
// Plain data; the same seed gives the same case on every platform.
#pragma once

#include <CGAL/Cell_attribute.h>
#include <CGAL/Cell_attribute_with_point.h>
#include <CGAL/Linear_cell_complex_for_combinatorial_map.h>

#include <cstdint>
#include <memory>
#include <string>
#include <tuple>
#include <vector>

#include "core/map/ids.h"
#include "core/mesh/polygon_mesh.h"

namespace ndmap::reference {

struct SurfaceCase {
  static constexpr uint32_t kMaxBlocks = 9;

  uint64_t seed = 0;
  std::string shape;
  PolygonMesh mesh;
  uint32_t blocks = 1;
  // By face; each block has at least one, mostly in several parts.
  std::vector<uint32_t> block_of;
  std::vector<CellId> removed;  // Ascending; often empty.

  // One line for a failing test.
  std::string Describe() const;
};

// A sheet, tube, torus or box of quadrilaterals, some cut into triangles, some joined to larger polygons,
// some taken out, so that there are boundaries, several components, and vertices at which faces meet only
// there; faces in random order, their corners from a random one on.
SurfaceCase MakeSurfaceCase(uint64_t seed);

struct SurfaceItems {
  template <class Refs>
  struct Dart_wrapper {
    using Attributes =
        std::tuple<CGAL::Cell_attribute_with_point<Refs>, void, CGAL::Cell_attribute<Refs, CellId>>;
  };
};
using SurfaceLcc =
    CGAL::Linear_cell_complex_for_combinatorial_map<2, 3, CGAL::Linear_cell_complex_traits<3>, SurfaceItems>;

// The surface as one map, made by CGAL's operations alone (make_combinatorial_polygon, sew).
std::unique_ptr<SurfaceLcc> MakeSurfaceMap(const PolygonMesh& mesh);
// Erases a face that is there, by CGAL's remove_cell.
void RemoveFace(SurfaceLcc& map, const CellId& face);

}  // namespace ndmap::reference

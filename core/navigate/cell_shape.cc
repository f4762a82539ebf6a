// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/navigate/cell_shape.h"

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "core/geometry/parity.h"
#include "core/geometry/surface_index.h"

namespace ndmap {

template <class BlockT>
TriangleSurface FacesOf(BlockT& block, const CellNames<BlockT>& names, size_t darts) {
  auto& map = block.map();
  TriangleSurface surface;
  absl::flat_hash_map<CellId, uint32_t> number_of;
  std::vector<std::pair<CellId, uint32_t>> face;
  for (size_t i = 0; i < darts;) {
    face.clear();
    const auto first = names.dart(i);
    do {
      const CellId id = names.Name(i, 0);
      const auto [it, added] = number_of.try_emplace(id, static_cast<uint32_t>(surface.points.size()));
      if (added) surface.points.push_back(Frame<BlockT>::StartPoint(map, names.dart(i)));
      face.emplace_back(id, it->second);
    } while (map.template beta<1>(names.dart(i++)) != first);
    std::rotate(face.begin(), std::min_element(face.begin(), face.end()), face.end());
    for (size_t k = 1; k + 1 < face.size(); ++k) {
      surface.triangles.push_back({face[0].second, face[k].second, face[k + 1].second});
    }
  }
  return surface;
}

template <class BlockT>
bool CellMeets(BlockT& block, CellNames<BlockT>& names, typename BlockT::Types::Cell cell, const Box3& box) {
  const size_t darts = names.Look(cell);
  for (size_t i = 0; i < darts; ++i) {
    const Point3 p = Frame<BlockT>::StartPoint(block.map(), names.dart(i));
    bool within = true;
    for (int c = 0; c < 3; ++c) within = within && box.lo[c] <= p[c] && p[c] <= box.hi[c];
    if (within) return true;
  }
  const auto faces = std::make_shared<const TriangleSurface>(FacesOf(block, names, darts));
  return SurfaceIndex(faces).Meets(box) || (BlockT::n == 3 && InsideByParity(*faces, box.lo));
}

template TriangleSurface FacesOf(Block2&, const CellNames<Block2>&, size_t);
template TriangleSurface FacesOf(Block3&, const CellNames<Block3>&, size_t);
template bool CellMeets(Block2&, CellNames<Block2>&, Block2::Types::Cell, const Box3&);
template bool CellMeets(Block3&, CellNames<Block3>&, Block3::Types::Cell, const Box3&);

}  // namespace ndmap

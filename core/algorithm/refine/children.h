// SPDX-License-Identifier: GPL-3.0-or-later
// Where the children of a hexahedron will be.
#pragma once

#include <array>

#include "core/algorithm/refine/frame.h"
#include "core/algorithm/refine/geometry.h"
#include "core/algorithm/refine/hexahedron.h"
#include "core/geometry/surface.h"

namespace ndmap {

// By child number the closed box of the child's corners, given the parent's corners: the very same numbers as
// CornerBox() of the child's corners in the map, whoever has split the edges and faces.
inline std::array<Box3, 8> ChildBoxes(const std::array<Point3, 8>& corners) {
  std::array<Point3, hexahedron::kFaces> faces;
  for (unsigned f = 0; f < hexahedron::kFaces; ++f) {
    const auto& c = hexahedron::kFaceCorners[f];
    faces[f] = FaceCentre({corners[c[0]], corners[c[1]], corners[c[2]], corners[c[3]]});
  }
  const Point3 centre = VolumeCentre(corners);
  std::array<Box3, 8> boxes;
  for (unsigned c = 0; c < 8; ++c) {
    boxes[c] = CornerBox({corners[c], Midpoint(corners[c], corners[c ^ 1]),
                          Midpoint(corners[c], corners[c ^ 2]), Midpoint(corners[c], corners[c ^ 4]),
                          faces[c >> 2 & 1], faces[2 + (c >> 1 & 1)], faces[4 + (c & 1)], centre});
  }
  return boxes;
}

}  // namespace ndmap

// SPDX-License-Identifier: GPL-3.0-or-later
// How large and how well shaped the cell is that a kind and the places of its corners make.
#pragma once

#include "absl/types/span.h"
#include "core/mesh/volume_mesh.h"

namespace ndmap {

// The volume within the cell's faces, negative if it is turned inside out. A face of four corners that is not
// plane counts as the four triangles about the mean of its corners, so that two cells agree on it.
double CellVolume(CellKind kind, absl::Span<const Point3> corners);

// At a corner with three edges: the determinant of the edges' unit vectors, in the turn that the kind
// prescribes. 1 where they stand at right angles, 0 where they lie in a plane, negative where the cell is
// turned inside out; 0.71 in the regular tetrahedron. A pyramid's apex, which has four edges, is left out.
struct CornerQuality {
  double smallest = 1, largest = -1;
};
CornerQuality ScaledJacobians(CellKind kind, absl::Span<const Point3> corners);

enum class CellSoundness { kSound, kConcave, kFlat, kInverted };

// kSound: every corner stands the right way. kConcave: some corner does not, but the volume is positive.
// kFlat: no volume beyond rounding. kInverted: a negative volume.
CellSoundness Soundness(CellKind kind, absl::Span<const Point3> corners);

// The places of a cell's corners.
struct CellCorners {
  CellCorners(const VolumeMesh& mesh, uint64_t cell);
  operator absl::Span<const Point3>() const { return absl::MakeConstSpan(places).first(count); }

  std::array<Point3, kMostCellCorners> places;
  size_t count;
};

}  // namespace ndmap

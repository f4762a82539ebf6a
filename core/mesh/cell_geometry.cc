// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/mesh/cell_geometry.h"

#include <algorithm>
#include <cmath>

#include "core/geometry/vector.h"

namespace ndmap {
namespace {

// Below this a scaled Jacobian is rounding: coordinates have 16 digits, and a mesh may lie far from the
// origin.
constexpr double kNothing = 1e-13;

double Length(const Point3& a) { return std::hypot(a[0], a[1], a[2]); }

// A corner and the ends of its edges, in right-handed turn.
struct CornerFrame {
  uint8_t at, x, y, z;
};
constexpr CornerFrame kTetrahedron[] = {{0, 1, 2, 3}, {1, 2, 0, 3}, {2, 0, 1, 3}, {3, 0, 2, 1}};
constexpr CornerFrame kPyramid[] = {{0, 1, 3, 4}, {1, 2, 0, 4}, {2, 3, 1, 4}, {3, 0, 2, 4}};
constexpr CornerFrame kPrism[] = {{0, 1, 2, 3}, {1, 2, 0, 4}, {2, 0, 1, 5},
                                  {3, 5, 4, 0}, {4, 3, 5, 1}, {5, 4, 3, 2}};
constexpr CornerFrame kHexahedron[] = {{0, 1, 3, 4}, {1, 2, 0, 5}, {2, 3, 1, 6}, {3, 0, 2, 7},
                                       {4, 7, 5, 0}, {5, 4, 6, 1}, {6, 5, 7, 2}, {7, 6, 4, 3}};

absl::Span<const CornerFrame> FramesOf(CellKind kind) {
  switch (kind) {
    case CellKind::kTetrahedron:
      return kTetrahedron;
    case CellKind::kPyramid:
      return kPyramid;
    case CellKind::kPrism:
      return kPrism;
    case CellKind::kHexahedron:
      return kHexahedron;
    case CellKind::kPolygon:
      break;
  }
  return {};
}

double LongestEdge(const CellShape& shape, absl::Span<const Point3> corners) {
  double longest = 0;
  for (int f = 0; f < shape.faces; ++f) {
    for (int i = 0; i < shape.face_corners[f]; ++i) {
      const uint8_t a = shape.face[f][i], b = shape.face[f][(i + 1) % shape.face_corners[f]];
      longest = std::max(longest, Length(Minus(corners[b], corners[a])));
    }
  }
  return longest;
}

}  // namespace

double CellVolume(CellKind kind, absl::Span<const Point3> corners) {
  const CellShape& shape = ShapeOf(kind);
  double six_volumes = 0;
  for (int f = 0; f < shape.faces; ++f) {
    Point3 at[kMostFaceCorners];  // Relative to the first corner, to lose fewer digits.
    const int size = shape.face_corners[f];
    for (int i = 0; i < size; ++i) at[i] = Minus(corners[shape.face[f][i]], corners[0]);
    if (size == 3) {
      six_volumes += Determinant(at[0], at[1], at[2]);
      continue;
    }
    Point3 middle;
    for (int x = 0; x < 3; ++x) middle[x] = (at[0][x] + at[1][x] + at[2][x] + at[3][x]) / 4;
    for (int i = 0; i < 4; ++i) six_volumes += Determinant(middle, at[i], at[(i + 1) % 4]);
  }
  return six_volumes / 6;
}

CornerQuality ScaledJacobians(CellKind kind, absl::Span<const Point3> corners) {
  CornerQuality quality;
  for (const CornerFrame& frame : FramesOf(kind)) {
    const Point3 x = Minus(corners[frame.x], corners[frame.at]);
    const Point3 y = Minus(corners[frame.y], corners[frame.at]);
    const Point3 z = Minus(corners[frame.z], corners[frame.at]);
    const double lengths = Length(x) * Length(y) * Length(z);
    const double scaled = lengths > 0 ? Determinant(x, y, z) / lengths : 0;
    quality.smallest = std::min(quality.smallest, scaled);
    quality.largest = std::max(quality.largest, scaled);
  }
  return quality;
}

CellSoundness Soundness(CellKind kind, absl::Span<const Point3> corners) {
  const double volume = CellVolume(kind, corners);
  if (volume > 0 && ScaledJacobians(kind, corners).smallest > kNothing) return CellSoundness::kSound;
  const double longest = LongestEdge(ShapeOf(kind), corners);
  const double nothing = kNothing * longest * longest * longest;
  if (volume < -nothing) return CellSoundness::kInverted;
  return volume > nothing ? CellSoundness::kConcave : CellSoundness::kFlat;
}

CellCorners::CellCorners(const VolumeMesh& mesh, uint64_t cell) {
  const auto corners = mesh.Corners(cell);
  count = corners.size();
  for (size_t i = 0; i < count; ++i) places[i] = mesh.points[corners[i]];
}

}  // namespace ndmap

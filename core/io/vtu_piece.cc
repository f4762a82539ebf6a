// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>

#include "core/io/vtu_writer.h"

namespace ndmap {

size_t VtuField::size() const {
  switch (type) {
    case Type::kDoubles:
      return doubles.size();
    case Type::kVectors:
      return doubles.size() / 3;
    case Type::kIntegers:
      return integers.size();
    case Type::kTexts:
      break;
  }
  return texts.size();
}

int64_t VtuPiece::AddPoint(const Point3& point, int64_t id) {
  points.push_back(point);
  point_ids.push_back(id);
  return static_cast<int64_t>(points.size()) - 1;
}

void VtuPiece::AddHexahedron(absl::Span<const int64_t> corners, const VtuCell& cell) {
  AddCell(kVtkHexahedron, corners, cell);
}

void VtuPiece::AddCell(uint8_t type, absl::Span<const int64_t> corners, const VtuCell& cell) {
  connectivity.insert(connectivity.end(), corners.begin(), corners.end());
  EndCell(type, -1, cell);
}

void VtuPiece::AddPolyhedron(absl::Span<const int64_t> face_sizes, absl::Span<const int64_t> face_points,
                             const VtuCell& cell) {
  // Cells added before the first polyhedron had no use for face offsets.
  face_offsets.resize(types.size(), -1);

  const auto begin = connectivity.insert(connectivity.end(), face_points.begin(), face_points.end());
  std::sort(begin, connectivity.end());
  connectivity.erase(std::unique(begin, connectivity.end()), connectivity.end());

  faces.push_back(static_cast<int64_t>(face_sizes.size()));
  auto next = face_points.begin();
  for (int64_t size : face_sizes) {
    faces.push_back(size);
    faces.insert(faces.end(), next, next + size);
    next += size;
  }
  EndCell(kVtkPolyhedron, static_cast<int64_t>(faces.size()), cell);
}

void VtuPiece::EndCell(uint8_t type, int64_t face_offset, const VtuCell& cell) {
  types.push_back(type);
  offsets.push_back(static_cast<int64_t>(connectivity.size()));
  if (!faces.empty()) face_offsets.push_back(face_offset);
  block.push_back(cell.block);
  level.push_back(cell.level);
  cell_ids.push_back(cell.id);
  state.push_back(cell.state);
}

}  // namespace ndmap

// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/reference/reference_map.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "tests/reference/plain_hexahedra.h"

namespace ndmap::reference {
namespace {

absl::Status NoSuchHexahedron(CellId id) {
  return absl::NotFoundError(absl::StrCat("no hexahedron ", id.ToString(), " in the reference map"));
}

}  // namespace

ReferenceMap ReferenceMap::Build(uint32_t nx, uint32_t ny, uint32_t nz,
                                 absl::FunctionRef<Point3(uint32_t, uint32_t, uint32_t)> corner) {
  ReferenceMap map;
  ReferenceLcc& lcc = *map.lcc_;
  PlainHexahedra<ReferenceLcc> hexahedra(lcc);
  std::vector<Dart> made;
  for (uint32_t k = 0; k < nz; ++k) {
    for (uint32_t j = 0; j < ny; ++j) {
      for (uint32_t i = 0; i < nx; ++i) {
        std::array<ReferenceLcc::Point, 8> points;
        for (unsigned c = 0; c < 8; ++c) {
          const Point3 p = corner(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2));
          points[c] = ReferenceLcc::Point(p[0], p[1], p[2]);
        }
        const Dart d = hexahedra.Make(points);
        if (i > 0) hexahedra.SewAlong(made[made.size() - 1], d, 0);
        if (j > 0) hexahedra.SewAlong(made[made.size() - nx], d, 1);
        if (k > 0) hexahedra.SewAlong(made[made.size() - size_t{nx} * ny], d, 2);
        made.push_back(d);
      }
    }
  }
  for (size_t number = 0; number < made.size(); ++number) {
    const CellId id = CellId::Initial(number);
    lcc.set_attribute<3>(made[number], lcc.create_attribute<3>(ReferenceHexahedron{id, 0}));
    map.hexahedra_[id] = made[number];
  }
  return map;
}

absl::Status ReferenceMap::Refine(CellId id) {
  const auto found = hexahedra_.find(id);
  if (found == hexahedra_.end()) return NoSuchHexahedron(id);
  const int level = id.level();
  const std::array<Dart, 8> children = PlainHexahedra<ReferenceLcc>(*lcc_).Split(found->second, level);
  hexahedra_.erase(found);
  for (unsigned c = 0; c < 8; ++c) {
    const CellId child = id.Child(c);
    lcc_->info<3>(children[c]) = {child, level + 1};
    hexahedra_[child] = children[c];
  }
  return absl::OkStatus();
}

absl::Status ReferenceMap::Remove(CellId id) {
  const auto found = hexahedra_.find(id);
  if (found == hexahedra_.end()) return NoSuchHexahedron(id);
  lcc_->remove_cell<3>(found->second);
  hexahedra_.erase(found);
  return absl::OkStatus();
}

std::array<Point3, 8> ReferenceMap::Corners(CellId id) const {
  const auto points = PlainHexahedra<ReferenceLcc>(*lcc_).Corners(ReferenceDart(id), id.level());
  std::array<Point3, 8> corners;
  for (unsigned c = 0; c < 8; ++c) corners[c] = {points[c].x(), points[c].y(), points[c].z()};
  return corners;
}

std::vector<CellId> ReferenceMap::Leaves() const {
  std::vector<CellId> leaves;
  for (const auto& [id, dart] : hexahedra_) leaves.push_back(id);
  std::sort(leaves.begin(), leaves.end());
  return leaves;
}

}  // namespace ndmap::reference

// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/reference/reference_map.h"

#include <algorithm>
#include <map>
#include <utility>

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

ReferenceMap ReferenceMap::BuildMesh(const VolumeMesh& mesh) {
  ReferenceMap map;
  ReferenceLcc& lcc = *map.lcc_;
  // The darts that run from one point to another in a face, by the face's sorted points.
  using Faces = std::map<std::vector<uint32_t>, std::map<std::pair<uint32_t, uint32_t>, Dart>>;
  Faces open;
  std::vector<std::pair<Dart, uint32_t>> starts;
  for (uint64_t cell = 0; cell < mesh.cells(); ++cell) {
    const CellShape& shape = ShapeOf(mesh.kinds[cell]);
    std::map<std::pair<uint32_t, uint32_t>, Dart> darts;
    for (int f = 0; f < shape.faces; ++f) {
      // Clockwise from outside, as make_hexahedron has it.
      const unsigned count = shape.face_corners[f];
      std::vector<uint32_t> points;
      for (unsigned k = 0; k < count; ++k) {
        points.push_back(mesh.FacePoint(cell, f, static_cast<int>((count - k) % count)));
      }
      std::map<std::pair<uint32_t, uint32_t>, Dart> face;
      Dart d = lcc.make_combinatorial_polygon(count);
      if (f == 0) map.hexahedra_[CellId::Initial(cell)] = d;
      for (unsigned k = 0; k < count; ++k, d = lcc.beta<1>(d)) {
        face[{points[k], points[(k + 1) % count]}] = d;
        starts.emplace_back(d, points[k]);
      }
      for (const auto& [ends, dart] : face) {
        const auto across = darts.find({ends.second, ends.first});
        if (across != darts.end()) lcc.link_beta<2>(dart, across->second, false);
      }
      darts.insert(face.begin(), face.end());
      std::sort(points.begin(), points.end());
      const auto [there, first] = open.try_emplace(points, face);
      if (first) continue;
      for (const auto& [ends, dart] : face) {
        lcc.link_beta<3>(dart, there->second.at({ends.second, ends.first}), false);
      }
    }
  }
  for (const auto& [d, point] : starts) {
    const Point3& p = mesh.points[point];
    if (lcc.attribute<0>(d) == lcc.null_handle) {
      lcc.set_vertex_attribute(d, lcc.create_vertex_attribute(ReferenceLcc::Point(p[0], p[1], p[2])));
    }
  }
  for (const auto& [id, d] : map.hexahedra_) {
    lcc.set_attribute<3>(d, lcc.create_attribute<3>(ReferenceHexahedron{id, 0}));
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

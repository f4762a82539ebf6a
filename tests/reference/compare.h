// SPDX-License-Identifier: GPL-3.0-or-later
// Are two linear cell complexes of dimension 2 or 3, of any types and storages, the same map with the same
// points?
#pragma once

#include <bit>
#include <unordered_map>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/map/ids.h"
#include "tests/reference/map_image.h"

namespace ndmap::reference {

// Copies a map. name(d) is the CellId of the n-cell of dart d. FAILED_PRECONDITION when a dart has no vertex
// attribute or is 1-free.
template <class Lcc, class Name>
absl::Status CopyToImage(const Lcc& lcc, const Name* name, MapImage* image) {
  using Dart = typename Lcc::Dart_const_handle;
  std::unordered_map<Dart, uint32_t, typename Lcc::Hash_function> number;
  std::vector<Dart> darts;
  for (auto it = lcc.darts().begin(); it != lcc.darts().end(); ++it) {
    const Dart d = it;
    number.emplace(d, static_cast<uint32_t>(darts.size()));
    darts.push_back(d);
  }
  std::unordered_map<const void*, uint32_t> vertices;  // By the address of the point: one per attribute.
  for (const Dart d : darts) {
    if (lcc.template attribute<0>(d) == lcc.null_handle || lcc.template is_free<1>(d)) {
      return absl::FailedPreconditionError(
          absl::StrCat("dart ", image->beta.size(), " has no vertex attribute or no next dart"));
    }
    const auto at = [&](bool is_free, Dart e) { return is_free ? MapImage::kFree : number.at(e); };
    image->beta.push_back({number.at(lcc.template beta<1>(d)),
                           at(lcc.template is_free<2>(d), lcc.template beta<2>(d)), MapImage::kFree});
    if constexpr (Lcc::dimension >= 3) {
      image->beta.back()[2] = at(lcc.template is_free<3>(d), lcc.template beta<3>(d));
    }
    const auto& point = lcc.point(d);
    const auto [vertex, is_new] = vertices.emplace(&point, static_cast<uint32_t>(vertices.size()));
    if (is_new) {
      image->point.push_back({std::bit_cast<uint64_t>(point.x()), std::bit_cast<uint64_t>(point.y()),
                              std::bit_cast<uint64_t>(point.z())});
    }
    image->vertex.push_back(vertex->second);
    if constexpr (!std::is_void_v<Name>) {
      const CellId id = (*name)(d);
      image->name.push_back({id.hi(), id.lo()});
    }
  }
  return absl::OkStatus();
}

// Isomorphic, points bit for bit, vertex attributes alike: see CompareImages. "a" and "b" in the message are
// the first and the second map.
template <class LccA, class LccB>
absl::Status CompareMaps(const LccA& a, const LccB& b) {
  MapImage image_a, image_b;
  if (absl::Status s = CopyToImage(a, static_cast<const void*>(nullptr), &image_a); !s.ok()) return s;
  if (absl::Status s = CopyToImage(b, static_cast<const void*>(nullptr), &image_b); !s.ok()) return s;
  return CompareImages(image_a, image_b);
}

// The same, and the n-cells have the same names: name_a(d), name_b(d) give the CellId of the n-cell of a
// dart.
template <class LccA, class LccB, class NameA, class NameB>
absl::Status CompareMaps(const LccA& a, const LccB& b, const NameA& name_a, const NameB& name_b) {
  MapImage image_a, image_b;
  if (absl::Status s = CopyToImage(a, &name_a, &image_a); !s.ok()) return s;
  if (absl::Status s = CopyToImage(b, &name_b, &image_b); !s.ok()) return s;
  return CompareImages(image_a, image_b);
}

}  // namespace ndmap::reference

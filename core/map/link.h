// SPDX-License-Identifier: GPL-3.0-or-later
// Links by beta_1 that flat storage makes without looking for beta_0, which it does not store.
#pragma once

#include "core/map/dart_index.h"

namespace ndmap {

// As map.basic_link_beta_1(d, to), for whoever closes all faces that this opens before anybody asks for
// beta_0 of a dart of theirs. O(1), where CGAL's function walks around the faces. Lcc is MapTypes<...>::Lcc.
template <class Lcc>
void LinkBeta1(Lcc& map, typename Lcc::Dart_handle d, typename Lcc::Dart_handle to) {
  if constexpr (internal::kIsFlat<typename Lcc::Dart_container>) {
    map.LinkInClosedFaces(d, to);
  } else {
    map.basic_link_beta_1(d, to);
  }
}

}  // namespace ndmap

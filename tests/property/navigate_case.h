// SPDX-License-Identifier: GPL-3.0-or-later
// A random case of navigation: a random map of dimension n, whole and cut into random blocks, and every
// question that can be asked of it, put to the blocks and to the whole map, which CGAL answers alone.
#pragma once

#include <cstdint>

#include "absl/status/status.h"
#include "core/map/map_types.h"

namespace ndmap {

// The map: a grid of n-cubes without some of its cells, some edges split, some faces too, so that cells are
// irregular. The cut: up to nine blocks, of any cells, with or without known peers. The questions, from
// random darts:
//   beta words of random length, followed over the blocks as far as they lead (Proposition 1);
//   orbits: the darts of the i-cell of a dart, for every i in 0 ... n;
//   words of closures, those of incident cells, adjacent cells and k-rings among them;
//   the cells of dimension j that such a region has, each by its canonical dart: of its darts, wherever they
//   are, the lowest, by the number of its n-cell and its place in that.
// OK, or what differs: the seed is in the message. The same for the same arguments. n: 2, 3 or 4.
absl::Status RunNavigateCase(unsigned n, StorageKind storage, uint64_t seed);

}  // namespace ndmap

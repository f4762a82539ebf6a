// SPDX-License-Identifier: GPL-3.0-or-later
// What the bits of a label mean to hexahedral refinement: `root` names the pair of initial critical darts,
// `path` how the pair came from it, 2-bit digits behind a sentinel bit. The path's length is the level of the
// edge.
//
//   digit 0, 1  first and second half of a split edge, seen from the positive side
//   digit 2     the new dart of a split face from the edge's midpoint to the face's centre (positive side)
//   digit 3     the new dart from the face's centre to the edge's midpoint (positive side)
//
// Each label is retired by its edge's split and each face is split once, so every label is made at most once
// and stays unique without any coordination.
#pragma once

#include <cstdint>

#include "absl/numeric/bits.h"
#include "core/map/ids.h"

namespace ndmap {

// 31 digits of 2 bits and the sentinel fit in 64 bits.
inline constexpr int kMaxLabelLevel = 31;

// A label of level 0 with this root.
inline Label RootLabel(uint64_t root) { return {root, 1}; }

// Roots made when a map is cut: (range, counter); range 0 belongs to initial cells. 20 bits of range.
inline uint64_t RangeRoot(uint32_t range, uint64_t counter) { return uint64_t{range} << 44 | counter; }

inline int LabelLevel(const Label& label) { return (static_cast<int>(absl::bit_width(label.path)) - 1) / 2; }
inline Label ChildLabel(const Label& label, unsigned digit) { return {label.root, label.path << 2 | digit}; }
inline unsigned LastDigit(const Label& label) { return static_cast<unsigned>(label.path & 3); }
// The label's first `level` digits; level <= LabelLevel(label).
inline Label AncestorLabel(const Label& label, int level) {
  return {label.root, label.path >> (2 * (LabelLevel(label) - level))};
}

}  // namespace ndmap

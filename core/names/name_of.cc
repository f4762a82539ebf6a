// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/names/name_of.h"

#include "absl/numeric/bits.h"

namespace ndmap {

CellId NameOf(const InitialCells& initial, const LatticeBox& box) {
  return NameInOwner(initial.ToOwner(box));
}

CellId NameInOwner(const LatticeBox& box) {
  const LatticePlace& owner = box.low;
  // The level: of an edge, face or hexahedron its length, of a vertex the coarsest lattice that has it.
  uint32_t length = box.extent[0] | box.extent[1] | box.extent[2];
  if (length == 0) {
    length = owner.at[0] | owner.at[1] | owner.at[2] | LatticePlace::kSide;
    length &= ~length + 1;
  }
  // The hexahedron of that level that touches the cell and is lowest along each axis.
  unsigned part = 0, weight = 1;
  std::array<uint32_t, 3> low{};
  for (int c = 0; c < 3; ++c) {
    const bool along = box.extent[c] != 0;
    const bool high = !along && owner.at[c] > 0;
    low[c] = high ? owner.at[c] - length : owner.at[c];
    part += weight * (along ? 2 : high ? 1 : 0);
    weight *= 3;
  }
  CellId hexahedron = CellId::Initial(owner.initial);
  for (uint32_t bit = LatticePlace::kSide >> 1; bit >= length; bit >>= 1) {
    hexahedron = hexahedron.Child((low[0] & bit ? 1 : 0) | (low[1] & bit ? 2 : 0) | (low[2] & bit ? 4 : 0));
  }
  return CellId::Part(hexahedron, part);
}

LatticeBox BoxOf(const CellId& id) {
  const CellId hexahedron = id.is_part() ? id.hexahedron() : id;
  const unsigned part = id.is_part() ? id.part() : CellId::kWholePart;
  LatticeBox box;
  box.low.initial = hexahedron.initial();
  uint32_t length = LatticePlace::kSide;
  for (int i = 1; i <= hexahedron.level(); ++i) {
    length >>= 1;
    const unsigned digit = hexahedron.digit(i);
    for (int c = 0; c < 3; ++c) box.low.at[c] += (digit >> c & 1) * length;
  }
  unsigned rest = part;
  for (int c = 0; c < 3; ++c, rest /= 3) {
    if (rest % 3 == 1) box.low.at[c] += length;
    if (rest % 3 == 2) box.extent[c] = length;
  }
  return box;
}

}  // namespace ndmap

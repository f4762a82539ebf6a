// SPDX-License-Identifier: GPL-3.0-or-later
// Navigation by Proposition 1: a word of betas applied to a dart, as far as one block can follow it. Who asks
// (a service, the simulator, a client) goes on in the block that a crossing leads to.
#pragma once

#include <cstddef>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/types/span.h"
#include "core/map/block.h"

namespace ndmap {

struct WalkResult {
  enum class End {
    kArrived,   // the whole word was applied; `dart` is the result
    kFree,      // beta gives the empty dart at the boundary; `used` letters were applied before it
    kCrossing,  // the next letter is beta_n of a critical dart: go on at the dart with `label` in `peer`
  };
  End end = End::kArrived;
  // The last dart in this block.
  DartIndex dart;
  // Letters of the word that were applied; a crossing's or a free letter does not count.
  size_t used = 0;
  Label label;
  // Not valid with broadcast routing: any other block may hold the label.
  BlockId peer;
};

// Applies the letters of `word` (each 0 ... n) to a dart. O(word). NOT_FOUND: no dart with this index.
// INVALID_ARGUMENT: a letter above n.
template <class Types>
absl::StatusOr<WalkResult> Walk(Block<Types>& block, DartIndex from, absl::Span<const uint8_t> word) {
  auto& map = block.map();
  auto d = DartAt(map, from);
  if (d == Types::Lcc::null_handle) {
    return absl::NotFoundError(absl::StrCat("block ", block.id().value, " has no dart ", from.value));
  }
  WalkResult result;
  for (uint8_t letter : word) {
    if (letter > Types::n) {
      return absl::InvalidArgumentError(
          absl::StrCat("beta ", int{letter}, " of a map of dimension ", int{Types::n}));
    }
    if (letter == Types::n && block.IsCritical(d)) {
      const Critical& c = block.critical(d);
      result = {WalkResult::End::kCrossing, IndexOf(map, d), result.used, c.label, c.peer};
      return result;
    }
    if (map.is_free(d, unsigned{letter})) {
      result.end = WalkResult::End::kFree;
      break;
    }
    d = map.beta(d, int{letter});
    ++result.used;
  }
  result.dart = IndexOf(map, d);
  return result;
}

}  // namespace ndmap

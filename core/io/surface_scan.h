// SPDX-License-Identifier: GPL-3.0-or-later
// Looks at the bytes of a surface file before CGAL reads them: CGAL's readers accept much in silence (an OBJ
// index 0, a PLY index out of range, NaN in STL), drop what they do not know, name no line, and trust counts.
#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace ndmap::internal {

// What CGAL is given to read: the same geometry in the plainest form of the same format.
struct ScannedSurface {
  std::string plain;
  std::optional<size_t> points;  // How many CGAL must find; none where it merges points (STL).
  size_t faces = 0;
};

// INVALID_ARGUMENT with the line or element of the first thing that is wrong. O(bytes), memory too.
absl::StatusOr<ScannedSurface> ScanOff(absl::string_view bytes);
absl::StatusOr<ScannedSurface> ScanObj(absl::string_view bytes);
absl::StatusOr<ScannedSurface> ScanPly(absl::string_view bytes);
absl::StatusOr<ScannedSurface> ScanStl(absl::string_view bytes);

}  // namespace ndmap::internal

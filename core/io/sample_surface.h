// SPDX-License-Identifier: GPL-3.0-or-later
// Closed surfaces made by formula, so that a first run needs no download.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/geometry/surface.h"

namespace ndmap {

struct SampleOptions {
  uint32_t triangles = 10000;  // About that many; bumpy-torus with 10,000 is the reference case, exactly.
  double scale = 1;  // Coordinates are multiplied by it; without it they lie within about [-1.5, 1.5].
};

// The kinds that MakeSample knows.
std::vector<std::string> SampleKinds();

// A closed, outward oriented surface without self-intersections; the same on every run:
//   sphere       radius 1, an octahedron's faces subdivided
//   torus        radii 1 and 0.4
//   bumpy-torus  the same with a tube of radius 0.4 (1 + 0.15 sin 5u sin 4w)
//   knot         a tube about the (2,3) torus knot
//   double-torus a plate with two holes, rounded; genus 2
//   shells       a sphere of radius 1 with a spherical cavity of radius 0.5 that holds a ball of radius 0.25
// INVALID_ARGUMENT for another kind, fewer than 100 or more than 20 million triangles, a scale that is not
// positive.
absl::StatusOr<TriangleSurface> MakeSample(absl::string_view kind, const SampleOptions& options = {});

}  // namespace ndmap

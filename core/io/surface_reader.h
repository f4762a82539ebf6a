// SPDX-License-Identifier: GPL-3.0-or-later
// Surface files in: OFF, OBJ, PLY and STL, text and binary, each also compressed with xz.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/geometry/surface.h"

namespace ndmap {

struct ReadLimits {
  uint64_t max_bytes = uint64_t{4} << 30;  // Of the file, also after decompression.
  // Finding pairs of intersecting triangles takes about 5 µs a triangle: off where seconds matter.
  bool check_self_intersections = true;
};

struct SurfaceFile {
  // Satisfies ValidateClosedSurface; no two points are equal, every point is used. Triangles are oriented
  // outward from the volume that parity encloses (towards the cavity in a cavity), as long as components do
  // not intersect.
  TriangleSurface surface;
  std::vector<std::string> notes;     // What was mended: one sentence each.
  std::vector<std::string> warnings;  // What is odd but taken as it is: one sentence each.
};

enum class SurfaceFormat { kOff, kObj, kPly, kStl };

// The format that a file name's extension stands for, without regard to case; ".xz" is taken off first.
// INVALID_ARGUMENT for any other.
absl::StatusOr<SurfaceFormat> SurfaceFormatOf(absl::string_view path);

// Reads a closed surface. The error is one sentence that begins with the path and names the line or element
// (lines count from 1, points and faces from 0): NOT_FOUND if there is no such file, RESOURCE_EXHAUSTED above
// a limit, INVALID_ARGUMENT for whatever is wrong in it: truncated, an index out of range, a coordinate that
// is not a finite number, no faces, not closed, not orientable. Memory is bounded by a multiple of the file's
// size, whatever its header says.
absl::StatusOr<SurfaceFile> ReadSurface(const std::string& path, const ReadLimits& limits = {});

// The same of a file's content; the error does not name a file.
absl::StatusOr<SurfaceFile> ReadSurfaceFromBytes(absl::string_view bytes, SurfaceFormat format,
                                                 const ReadLimits& limits = {});

// One sentence for each closed component whose bounding box is smaller than a cell in every direction: a grid
// may hold it as a few cut cells with nothing inside, or as none. O(triangles).
std::vector<std::string> WarnSmallComponents(const TriangleSurface& surface, double cell_size);

// The surface as an OFF file whose coordinates read back bit for bit. UNAVAILABLE if it cannot be written.
std::string OffText(const TriangleSurface& surface);
absl::Status WriteOff(const std::string& path, const TriangleSurface& surface);

}  // namespace ndmap

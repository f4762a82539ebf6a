// SPDX-License-Identifier: GPL-3.0-or-later
#include "absl/strings/str_format.h"
#include "core/io/file_bytes.h"
#include "core/io/surface_reader.h"

namespace ndmap {

std::string OffText(const TriangleSurface& surface) {
  std::string text;
  absl::StrAppendFormat(&text, "OFF\n%d %d 0\n", surface.points.size(), surface.triangles.size());
  // 17 digits give every double back.
  for (const Point3& p : surface.points)
    absl::StrAppendFormat(&text, "%.17g %.17g %.17g\n", p[0], p[1], p[2]);
  for (const auto& [a, b, c] : surface.triangles) absl::StrAppendFormat(&text, "3 %d %d %d\n", a, b, c);
  return text;
}

absl::Status WriteOff(const std::string& path, const TriangleSurface& surface) {
  return internal::WriteFileBytes(path, OffText(surface));
}

}  // namespace ndmap

// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/io/surface_reader.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/IO/OBJ.h>
#include <CGAL/IO/OFF.h>
#include <CGAL/IO/PLY.h>
#include <CGAL/IO/STL.h>

#include <algorithm>
#include <exception>
#include <new>
#include <sstream>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "core/io/file_bytes.h"
#include "core/io/surface_scan.h"
#include "core/io/surface_soup.h"

namespace ndmap {
namespace {

using Point = CGAL::Exact_predicates_inexact_constructions_kernel::Point_3;

absl::StatusOr<internal::ScannedSurface> Scan(absl::string_view bytes, SurfaceFormat format) {
  switch (format) {
    case SurfaceFormat::kOff:
      return internal::ScanOff(bytes);
    case SurfaceFormat::kObj:
      return internal::ScanObj(bytes);
    case SurfaceFormat::kPly:
      return internal::ScanPly(bytes);
    case SurfaceFormat::kStl:
      return internal::ScanStl(bytes);
  }
  return absl::InvalidArgumentError("unknown surface format");
}

absl::StatusOr<internal::PolygonSoup> ReadByCgal(internal::ScannedSurface scanned, SurfaceFormat format) {
  internal::PolygonSoup soup;
  if (scanned.faces == 0) return absl::InvalidArgumentError("has no faces");
  std::vector<Point> points;
  std::istringstream in(std::move(scanned.plain), std::ios::binary);
  bool ok = false;
  switch (format) {
    case SurfaceFormat::kOff:
      ok = CGAL::IO::read_OFF(in, points, soup.polygons, CGAL::parameters::verbose(false));
      break;
    case SurfaceFormat::kObj:
      ok = CGAL::IO::read_OBJ(in, points, soup.polygons, CGAL::parameters::verbose(false));
      break;
    case SurfaceFormat::kPly:
      ok = CGAL::IO::read_PLY(in, points, soup.polygons, CGAL::parameters::verbose(false));
      break;
    case SurfaceFormat::kStl:
      ok = CGAL::IO::read_STL(in, points, soup.polygons, CGAL::parameters::verbose(false));
      break;
  }
  if (!ok || soup.polygons.size() != scanned.faces ||
      points.size() != scanned.points.value_or(points.size())) {
    return absl::InvalidArgumentError(absl::StrCat("only ", points.size(), " points and ",
                                                   soup.polygons.size(), " of ", scanned.faces,
                                                   " faces can be read"));
  }
  soup.points.reserve(points.size());
  for (const Point& p : points) soup.points.push_back({p.x(), p.y(), p.z()});
  return soup;
}

absl::StatusOr<SurfaceFile> ReadOrThrow(absl::string_view bytes, SurfaceFormat format,
                                        const ReadLimits& limits) {
  if (bytes.size() > limits.max_bytes) {
    return absl::ResourceExhaustedError(
        absl::StrCat("has ", bytes.size(), " bytes; at most ", limits.max_bytes, " are read"));
  }
  auto soup = internal::ReadPolygonSoup(bytes, format);
  if (!soup.ok()) return soup.status();
  return internal::SurfaceFromSoup(*std::move(soup), limits);
}

}  // namespace

absl::StatusOr<internal::PolygonSoup> internal::ReadPolygonSoup(absl::string_view bytes,
                                                                SurfaceFormat format) {
  auto scanned = Scan(bytes, format);
  if (!scanned.ok()) return scanned.status();
  return ReadByCgal(*std::move(scanned), format);
}

absl::StatusOr<SurfaceFormat> SurfaceFormatOf(absl::string_view path) {
  std::string name = absl::AsciiStrToLower(path);
  if (absl::EndsWith(name, ".xz")) name.resize(name.size() - 3);
  if (absl::EndsWith(name, ".off")) return SurfaceFormat::kOff;
  if (absl::EndsWith(name, ".obj")) return SurfaceFormat::kObj;
  if (absl::EndsWith(name, ".ply")) return SurfaceFormat::kPly;
  if (absl::EndsWith(name, ".stl")) return SurfaceFormat::kStl;
  return absl::InvalidArgumentError(
      absl::StrCat(path, ": unknown extension; .off, .obj, .ply and .stl can be read, also with .xz"));
}

absl::StatusOr<SurfaceFile> ReadSurfaceFromBytes(absl::string_view bytes, SurfaceFormat format,
                                                 const ReadLimits& limits) {
  try {
    return ReadOrThrow(bytes, format, limits);
  } catch (const std::bad_alloc&) {
    return absl::ResourceExhaustedError(
        absl::StrCat("too large for this machine's memory: ", bytes.size(), " bytes"));
  } catch (const std::exception& e) {
    return absl::InvalidArgumentError(absl::StrCat("cannot be read: ", e.what()));
  }
}

absl::StatusOr<SurfaceFile> ReadSurface(const std::string& path, const ReadLimits& limits) {
  const auto bytes = internal::ReadFileBytes(path, limits.max_bytes);
  if (!bytes.ok()) return bytes.status();
  const auto format = SurfaceFormatOf(path);
  if (!format.ok()) return format.status();
  auto file = ReadSurfaceFromBytes(*bytes, *format, limits);
  if (!file.ok())
    return absl::Status(file.status().code(), absl::StrCat(path, ": ", file.status().message()));
  return file;
}

std::vector<std::string> WarnSmallComponents(const TriangleSurface& surface, double cell_size) {
  std::vector<std::string> warnings;
  const auto neighbours = internal::Neighbours(surface);
  if (!neighbours.ok()) return warnings;
  uint32_t count;
  const std::vector<uint32_t> component = internal::Components(*neighbours, &count);
  std::vector<Box3> boxes(count);
  std::vector<size_t> triangles(count, 0);
  for (size_t t = 0; t < component.size(); ++t) {
    Box3& box = boxes[component[t]];
    if (triangles[component[t]]++ == 0) box.lo = box.hi = surface.points[surface.triangles[t][0]];
    for (uint32_t corner : surface.triangles[t]) {
      for (int c = 0; c < 3; ++c) {
        box.lo[c] = std::min(box.lo[c], surface.points[corner][c]);
        box.hi[c] = std::max(box.hi[c], surface.points[corner][c]);
      }
    }
  }
  for (uint32_t i = 0; i < count; ++i) {
    double extent = 0;
    for (int c = 0; c < 3; ++c) extent = std::max(extent, boxes[i].hi[c] - boxes[i].lo[c]);
    if (!(extent < cell_size)) continue;
    warnings.push_back(absl::StrCat("component ", i, " of ", count, " (", triangles[i], " triangles near ",
                                    boxes[i].lo[0], " ", boxes[i].lo[1], " ", boxes[i].lo[2], ") is only ",
                                    extent, " across, smaller than a coarse cell of ", cell_size));
  }
  return warnings;
}

}  // namespace ndmap

// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/io/polygon_reader.h"

#include <exception>
#include <new>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/io/file_bytes.h"
#include "core/io/surface_soup.h"

namespace ndmap {
namespace {

absl::StatusOr<PolygonMesh> ReadOrThrow(absl::string_view bytes, SurfaceFormat format, uint64_t max_bytes) {
  if (bytes.size() > max_bytes) {
    return absl::ResourceExhaustedError(
        absl::StrCat("has ", bytes.size(), " bytes; at most ", max_bytes, " are read"));
  }
  auto soup = internal::ReadPolygonSoup(bytes, format);
  if (!soup.ok()) return soup.status();
  PolygonMesh mesh;
  mesh.points = std::move(soup->points);
  for (const auto& polygon : soup->polygons) mesh.AddFace(polygon);
  mesh.source.numbering = "counted from 0";
  return mesh;
}

}  // namespace

absl::StatusOr<PolygonMesh> ReadPolygonMeshFromBytes(absl::string_view bytes, SurfaceFormat format,
                                                     uint64_t max_bytes) {
  try {
    return ReadOrThrow(bytes, format, max_bytes);
  } catch (const std::bad_alloc&) {
    return absl::ResourceExhaustedError(
        absl::StrCat("too large for this machine's memory: ", bytes.size(), " bytes"));
  } catch (const std::exception& e) {
    return absl::InvalidArgumentError(absl::StrCat("cannot be read: ", e.what()));
  }
}

absl::StatusOr<PolygonMesh> ReadPolygonMesh(const std::string& path, uint64_t max_bytes) {
  const auto bytes = internal::ReadFileBytes(path, max_bytes);
  if (!bytes.ok()) return bytes.status();
  const auto format = SurfaceFormatOf(path);
  if (!format.ok()) return format.status();
  auto mesh = ReadPolygonMeshFromBytes(*bytes, *format, max_bytes);
  if (!mesh.ok())
    return absl::Status(mesh.status().code(), absl::StrCat(path, ": ", mesh.status().message()));
  mesh->source.file = path;
  return mesh;
}

absl::StatusOr<GluedPolygons> ReadGluedPolygons(const std::string& path, const GlueOptions& options,
                                                uint64_t max_bytes) {
  auto mesh = ReadPolygonMesh(path, max_bytes);
  if (!mesh.ok()) return mesh.status();
  return GluePolygons(*std::move(mesh), options);
}

}  // namespace ndmap

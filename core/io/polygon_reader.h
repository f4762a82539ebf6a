// SPDX-License-Identifier: GPL-3.0-or-later
// Surface files as they are: polygons of any size, with or without a boundary, not cut into triangles. For
// closed surfaces of triangles: surface_reader.h.
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/statusor.h"
#include "core/io/surface_reader.h"
#include "core/mesh/polygon_mesh.h"

namespace ndmap {

// Reads the polygons of an OFF, OBJ, PLY or STL file, also with .xz; nothing is mended. In STL, which has no
// shared points, equal ones are one. Errors as ReadSurface's.
absl::StatusOr<PolygonMesh> ReadPolygonMesh(const std::string& path,
                                            uint64_t max_bytes = ReadLimits().max_bytes);

// The same of a file's content; the error does not name a file.
absl::StatusOr<PolygonMesh> ReadPolygonMeshFromBytes(absl::string_view bytes, SurfaceFormat format,
                                                     uint64_t max_bytes = ReadLimits().max_bytes);

// Reads and glues.
absl::StatusOr<GluedPolygons> ReadGluedPolygons(const std::string& path, const GlueOptions& options = {},
                                                uint64_t max_bytes = ReadLimits().max_bytes);

}  // namespace ndmap

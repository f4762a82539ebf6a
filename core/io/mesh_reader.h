// SPDX-License-Identifier: GPL-3.0-or-later
// Volume mesh files in: VTU, Gmsh 2 and 4.1, Medit and MFEM, each also compressed with xz. What a file is,
// its content tells, not its name. docs/meshes.md says what is read of each format.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/mesh/volume_mesh.h"

namespace ndmap {

// 4 GiB: of the file, and of what it holds after decompression.
inline constexpr uint64_t kMostMeshBytes = uint64_t{4} << 30;

struct MeshFile {
  VolumeMesh mesh;                 // Indices in range and coordinates finite; for the rest see Glue.
  std::string format;              // "Gmsh 4.1, binary".
  std::vector<std::string> notes;  // What was left out or mended: one sentence each.
};

// Reads the tetrahedra, pyramids, prisms and hexahedra of a file. Cells of fewer dimensions are left out with
// a note. If all prisms of a file are inside out, they are listed in the other of the two orders that are in
// use, and are turned, with a note.
//
// The error is one sentence that begins with the path and names the line, byte or array: NOT_FOUND if there
// is no such file, RESOURCE_EXHAUSTED above max_bytes, INVALID_ARGUMENT for whatever is wrong in it. Memory
// is bounded by a multiple of max_bytes and of the file's size, whatever its header says.
absl::StatusOr<MeshFile> ReadVolumeMesh(const std::string& path, uint64_t max_bytes = kMostMeshBytes);

// The same of a file's content; the error does not name a file.
absl::StatusOr<MeshFile> ReadVolumeMeshFromBytes(absl::string_view bytes,
                                                 uint64_t max_bytes = kMostMeshBytes);

// Reads and glues; the notes of both.
absl::StatusOr<GluedMesh> ReadGluedMesh(const std::string& path, const GlueOptions& options = {},
                                        uint64_t max_bytes = kMostMeshBytes);

}  // namespace ndmap

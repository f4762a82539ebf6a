// SPDX-License-Identifier: GPL-3.0-or-later
// A mesh file on its way into a cluster: read, glued, cut into blocks, sent piece by piece.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "client/cli/progress.h"
#include "client/sdk/client.h"
#include "core/io/mesh_reader.h"
#include "core/mesh/volume_mesh.h"

namespace ndmap::cli {

struct CutMesh {
  VolumeMesh mesh;
  // Of each cell.
  std::vector<uint32_t> block_of;
  v1::MeshSummary summary;
};

// The file's cells, glued, with the block of each. Errors as ReadGluedMesh and AssignMesh have them.
absl::StatusOr<CutMesh> ReadAndCut(const std::string& path, const GlueOptions& glue, uint32_t blocks,
                                   absl::string_view partition, Progress& progress);

// Sends the pieces and starts the job that makes the map. `request` says the rest of it.
absl::StatusOr<JobHandle> SendMesh(const Client& client, v1::CreateMapRequest request, const CutMesh& mesh,
                                   Progress& progress);

}  // namespace ndmap::cli

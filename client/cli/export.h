// SPDX-License-Identifier: GPL-3.0-or-later
// A map as files: one VTU piece for each block, and the index that opens them all.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/cli/output_folder.h"
#include "client/cli/process.h"
#include "client/cli/progress.h"
#include "client/sdk/client.h"

namespace ndmap::cli {

struct Exported {
  std::string index;  // Path of mesh.pvtu.
  std::vector<std::string> pieces;
  uint64_t bytes = 0;
  uint64_t cells = 0;
};

// Checks "all", "none", or names of attributes separated by commas. Gives a note about each that "all" cannot
// have, for such files have values of vertices and hexahedra only: INVALID_ARGUMENT when one of them is
// named, NOT_FOUND when there is none of a name.
absl::StatusOr<std::vector<std::string>> CheckExportedAttributes(const v1::Map& map,
                                                                 const std::string& wanted);

// `attributes`: as checked above. Streams every block's piece from its server into `folder`/block_0000.vtu
// ..., several at a time, then writes mesh.pvtu. All files take their places when the last is complete, the
// index last; on an error those that were there stay as they were, and `made` takes back what was written
// beside them.
absl::StatusOr<Exported> ExportMap(const MapHandle& map, const std::string& cells,
                                   const std::string& attributes, const std::string& folder, MadeFiles& made,
                                   Progress& progress);

// Draws an export with ndmap-picture. FAILED_PRECONDITION says what to install when that is not possible.
absl::Status DrawPicture(const std::string& index, const std::string& png, ChildProcesses& children,
                         Progress& progress);

}  // namespace ndmap::cli

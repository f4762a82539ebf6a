// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "ndmap/v1/block_service.pb.h"
#include "server/block_host.h"
#include "server/piece.h"

namespace ndmap::server {

// The file that a request names below the data folder, whose folders are made. PERMISSION_DENIED when it
// would leave the data folder, by ".." or by a link; FAILED_PRECONDITION without a data folder.
absl::StatusOr<std::string> FileInDataFolder(const std::string& data_folder,
                                             const v1::ExportPieceRequest& request);

// Exports one block: streamed in chunks through `write` (false: the client has gone), or into the data
// folder. The last message is the summary. Blocking.
absl::Status ExportPiece(BlockHost& host, const PieceSource& source, const std::string& data_folder,
                         const v1::ExportPieceRequest& request, std::function<bool()> gone,
                         const std::function<bool(const v1::ExportPieceResponse&)>& write);

}  // namespace ndmap::server

// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/export.h"

#include <xxhash.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <memory>
#include <system_error>
#include <utility>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "service/names.h"
#include "service/surface_transfer.h"

namespace ndmap::server {
namespace {

namespace fs = std::filesystem;

absl::Status Unwritable(const fs::path& path, const std::error_code& error) {
  return absl::UnavailableError(absl::StrCat("cannot write ", path.string(), ": ", error.message()));
}

}  // namespace

absl::StatusOr<std::string> FileInDataFolder(const std::string& data_folder,
                                             const v1::ExportPieceRequest& request) {
  if (data_folder.empty()) {
    return absl::FailedPreconditionError(
        "the server has no data folder (--data-dir): let the piece be streamed");
  }
  const absl::Status denied = absl::PermissionDeniedError(absl::StrCat(
      "folder \"", absl::CHexEscape(request.folder()), "\" is not below the server's data folder"));
  if (request.folder().size() > 1024 || request.folder().find('\0') != std::string::npos) return denied;
  for (absl::string_view part : absl::StrSplit(request.folder(), '/')) {
    if (part.empty() || part == "..") return denied;
  }
  const std::string name =
      request.file().empty() ? absl::StrCat(request.map(), "_", request.block(), ".vtu") : request.file();
  if (absl::Status status = service::CheckName("file", name); !status.ok()) return status;
  std::error_code error;
  const fs::path root = fs::canonical(data_folder, error);
  if (error) return Unwritable(data_folder, error);
  // Links on the way are looked through before anything is made.
  const fs::path folder = fs::weakly_canonical(root / request.folder(), error);
  if (error) return Unwritable(request.folder(), error);
  const auto [end, unused] = std::mismatch(root.begin(), root.end(), folder.begin(), folder.end());
  if (end != root.end()) return denied;
  fs::create_directories(folder, error);
  if (error) return Unwritable(folder, error);
  if (fs::is_symlink(folder / name, error)) return denied;
  return (folder / name).string();
}

absl::Status ExportPiece(BlockHost& host, const PieceSource& source, const std::string& data_folder,
                         const v1::ExportPieceRequest& request, std::function<bool()> gone,
                         const std::function<bool(const v1::ExportPieceResponse&)>& write) {
  std::string file;
  if (!request.folder().empty()) {
    absl::StatusOr<std::string> path = FileInDataFolder(data_folder, request);
    if (!path.ok()) return path.status();
    file = *std::move(path);
  }
  absl::StatusOr<BlockHost::MapInfo> info = host.Info(request.map());
  if (!info.ok()) return info.status();
  PieceOrigin origin{info->grid, nullptr, info->mesh_cells.value_or(0)};
  if (!origin.grid) {
    absl::StatusOr<std::shared_ptr<const InitialCells>> mesh = host.Initial(request.map(), request.block());
    if (!mesh.ok()) return mesh.status();
    origin.mesh = *std::move(mesh);
  }
  const Parameters options(
      absl::btree_map<std::string, std::string>(request.options().begin(), request.options().end()));
  absl::StatusOr<std::unique_ptr<PieceBuilder>> builder = source(options, origin);
  if (!builder.ok()) return builder.status();
  auto step = [&](Block3& block, AttributeStore& attributes) { return (*builder)->Step(block, attributes); };
  if (absl::Status s = host.QuerySliced(request.map(), request.block(), step, gone); !s.ok()) return s;

  // The file appears under its name only when it is complete.
  const std::string part = file + ".part";
  std::ofstream out;
  if (!file.empty()) out.open(part, std::ios::binary | std::ios::trunc);
  std::unique_ptr<XXH3_state_t, decltype(&XXH3_freeState)> hash(XXH3_createState(), &XXH3_freeState);
  XXH3_64bits_reset(hash.get());
  uint64_t bytes = 0;
  bool stopped = false;
  auto sink = [&](absl::string_view data) {
    XXH3_64bits_update(hash.get(), data.data(), data.size());
    bytes += data.size();
    if (!file.empty()) {
      out.write(data.data(), static_cast<std::streamsize>(data.size()));
      stopped = !out;
    }
    for (size_t at = 0; file.empty() && at < data.size() && !stopped; at += service::kChunkBytes) {
      v1::ExportPieceResponse response;
      response.set_data(std::string(data.substr(at, service::kChunkBytes)));
      stopped = !write(response);
    }
    return !stopped;
  };
  absl::Status status = (*builder)->Write(sink);
  if (!file.empty()) {
    out.close();
    // What was still buffered may not have found room.
    stopped = stopped || !out;
  }
  std::error_code error;
  if (stopped) {
    status = file.empty() ? absl::CancelledError("the caller has gone")
                          : absl::UnavailableError(absl::StrCat("cannot write ", file));
  }
  if (!file.empty() && status.ok()) {
    fs::rename(part, file, error);
    if (error) status = Unwritable(file, error);
  }
  if (!status.ok()) {
    if (!file.empty()) fs::remove(part, error);
    return status;
  }
  v1::ExportPieceResponse last;
  v1::ExportSummary& summary = *last.mutable_summary();
  summary.set_bytes(bytes);
  summary.set_checksum(XXH3_64bits_digest(hash.get()));
  if (!file.empty()) summary.set_file(fs::relative(file, fs::canonical(data_folder, error), error).string());
  for (const auto& [name, count] : (*builder)->counts()) (*summary.mutable_counts())[name] = count;
  write(last);
  return absl::OkStatus();
}

}  // namespace ndmap::server

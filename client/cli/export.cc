// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/export.h"

#include <algorithm>
#include <filesystem>
#include <set>
#include <system_error>
#include <thread>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_split.h"
#include "absl/strings/strip.h"
#include "absl/synchronization/mutex.h"
#include "client/cli/attribute_text.h"
#include "client/cli/cell_arguments.h"
#include "client/cli/text.h"
#include "core/io/vtu_writer.h"

namespace ndmap::cli {
namespace {

constexpr uint32_t kAtOnce = 4;
constexpr int kPictureNeedsPackages = 3;

// What the threads that fetch pieces share.
struct Fetch {
  absl::Mutex mutex;
  uint32_t next ABSL_GUARDED_BY(mutex) = 0;
  uint32_t ready ABSL_GUARDED_BY(mutex) = 0;
  absl::Status status ABSL_GUARDED_BY(mutex);
  // Where it is until it is put in place.
  std::string first_piece ABSL_GUARDED_BY(mutex);
  Exported exported ABSL_GUARDED_BY(mutex);
};

std::string PieceName(uint32_t block) { return absl::StrFormat("block_%04d.vtu", block); }

// Whether an export may have left a file of this name: a piece, or one that was on its way to be one.
bool IsNameOfPiece(absl::string_view name) {
  if (!absl::ConsumePrefix(&name, "block_")) return false;
  const size_t digits = std::min(name.find_first_not_of("0123456789"), name.size());
  name.remove_prefix(digits);
  if (digits < 4 || !absl::ConsumePrefix(&name, ".vtu")) return false;
  return name.empty() || name == ".new" || name == ".new.part" || name == ".old";
}

// Pieces of an earlier export of more blocks, which the new index does not name, go when all is well.
void RemoveOtherPieces(const std::string& folder, const std::vector<std::string>& names, MadeFiles& made) {
  const std::set<std::string> named(names.begin(), names.end());
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    const std::string name = entry.path().filename().string();
    if (!named.contains(name) && IsNameOfPiece(name) && entry.is_regular_file(error))
      made.RemoveWhenKept(entry.path().string());
  }
}

}  // namespace

absl::StatusOr<std::vector<std::string>> CheckExportedAttributes(const v1::Map& map,
                                                                 const std::string& wanted) {
  const std::vector<v1::Attribute> there(map.attributes().begin(), map.attributes().end());
  const auto obstacle = [](const v1::Attribute& attribute) {
    return attribute.dimension() == 0 || attribute.dimension() == 3
               ? ""
               : absl::StrCat(attribute.name(), " is of ", CellWord(attribute.dimension(), true),
                              ", VTK files have values of vertices and hexahedra");
  };
  std::vector<std::string> notes;
  if (wanted == "all") {
    for (const v1::Attribute& attribute : there) {
      if (const std::string what = obstacle(attribute); !what.empty())
        notes.push_back(absl::StrCat("note: left out: ", what));
    }
  } else if (wanted != "none") {
    for (const std::string& name : std::vector<std::string>(absl::StrSplit(wanted, ','))) {
      absl::StatusOr<v1::Attribute> attribute = FindAttribute(there, map.map(), name);
      if (!attribute.ok()) return attribute.status();
      if (const std::string what = obstacle(*attribute); !what.empty())
        return absl::InvalidArgumentError(what);
    }
  }
  return notes;
}

absl::StatusOr<Exported> ExportMap(const MapHandle& map, const std::string& cells,
                                   const std::string& attributes, const std::string& folder, MadeFiles& made,
                                   Progress& progress) {
  progress.Begin("export");
  const uint32_t blocks = map.info().block_count();
  std::vector<std::string> names;
  for (uint32_t block = 0; block < blocks; ++block) names.push_back(PieceName(block));
  Fetch fetch;
  const auto work = [&] {
    for (;;) {
      uint32_t block = 0;
      {
        absl::MutexLock lock(&fetch.mutex);
        if (!fetch.status.ok() || fetch.next == blocks) return;
        block = fetch.next++;
      }
      const std::string path = made.Beside(absl::StrCat(folder, "/", names[block]));
      absl::StatusOr<v1::ExportSummary> summary =
          map.ExportPieceToFile(block, {{"cells", cells}, {"attributes", attributes}}, path);
      absl::MutexLock lock(&fetch.mutex);
      if (block == 0) fetch.first_piece = path;
      if (!summary.ok()) {
        fetch.status.Update(summary.status());
        return;
      }
      fetch.exported.bytes += summary->bytes();
      const auto found = summary->counts().find("cells");
      if (found != summary->counts().end()) fetch.exported.cells += static_cast<uint64_t>(found->second);
      ++fetch.ready;
      progress.Update(static_cast<double>(fetch.ready) / blocks,
                      absl::StrCat(fetch.ready, "/", blocks, " pieces, ", FormatBytes(fetch.exported.bytes)));
    }
  };
  std::vector<std::thread> threads;
  for (uint32_t i = 0; i < std::min(kAtOnce, blocks); ++i) threads.emplace_back(work);
  for (std::thread& thread : threads) thread.join();

  absl::MutexLock lock(&fetch.mutex);
  absl::Status status = fetch.status;
  const std::string index = absl::StrCat(folder, "/mesh.pvtu");
  if (status.ok()) {
    // The index last: until then the one that was there leads to the pieces that were.
    status = WritePvtuFileLike(fetch.first_piece, names, made.Beside(index));
    if (status.ok()) status = made.PutInPlace();
    if (status.ok()) RemoveOtherPieces(folder, names, made);
  }
  if (!status.ok()) {
    progress.Abandon();
    return status;
  }
  fetch.exported.index = index;
  for (const std::string& name : names) fetch.exported.pieces.push_back(absl::StrCat(folder, "/", name));
  progress.End(absl::StrCat(names.size(), names.size() == 1 ? " piece, " : " pieces, ",
                            FormatBytes(fetch.exported.bytes)));
  return std::move(fetch.exported);
}

absl::Status DrawPicture(const std::string& index, const std::string& png, ChildProcesses& children,
                         Progress& progress) {
  absl::StatusOr<std::string> tool = FindProgram("ndmap-picture");
  if (!tool.ok()) return tool.status();
  progress.Begin("picture");
  absl::StatusOr<pid_t> pid = children.Start({*tool, index, "-o", png});
  if (!pid.ok()) return pid.status();
  const int code = children.Wait(*pid);
  if (code == 0) {
    progress.End(png);
    return absl::OkStatus();
  }
  progress.Abandon();
  // The tool has said on standard error what is missing.
  return code == kPictureNeedsPackages
             ? absl::FailedPreconditionError(absl::StrCat("no ", png, ": packages are missing (see above)"))
             : absl::UnavailableError(
                   absl::StrCat("no ", png, ": ndmap-picture ended with exit code ", code));
}

}  // namespace ndmap::cli

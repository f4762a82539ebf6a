// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/output_folder.h"

#include <stdlib.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <system_error>

#include "absl/strings/str_cat.h"

namespace ndmap::cli {
namespace fs = std::filesystem;

namespace {

constexpr const char* kBeside = ".new";

}  // namespace

MadeFiles::~MadeFiles() { TakeBack(); }

absl::Status MadeFiles::MakeFolder(const std::string& path) {
  const auto refuse = [&](absl::string_view why) {
    return absl::InvalidArgumentError(absl::StrCat("cannot write into '", path, "': ", why));
  };
  if (path.empty()) return refuse("the name is empty");
  std::error_code error;
  std::vector<fs::path> missing;
  for (fs::path at = fs::absolute(path, error).lexically_normal(); !at.empty() && !fs::exists(at, error);
       at = at.parent_path()) {
    if (at.has_filename()) missing.push_back(at);
  }
  absl::MutexLock lock(&mutex_);
  for (auto it = missing.rbegin(); it != missing.rend(); ++it) {
    if (!fs::create_directory(*it, error)) return refuse(error ? error.message() : "it is a file");
    folders_.push_back(it->string());
  }
  if (!fs::is_directory(path, error)) return refuse("it is a file");
  std::string probe = absl::StrCat(path, "/.ndmap-XXXXXX");
  const int file = mkstemp(probe.data());
  if (file < 0) return refuse(std::strerror(errno));
  close(file);
  unlink(probe.c_str());
  return absl::OkStatus();
}

absl::StatusOr<std::string> MadeFiles::MakeTemporaryFolder() {
  std::error_code error;
  std::string path = (fs::temp_directory_path(error) / "ndmap-XXXXXX").string();
  if (error || mkdtemp(path.data()) == nullptr) {
    return absl::UnavailableError(absl::StrCat("no temporary folder: ", std::strerror(errno)));
  }
  absl::MutexLock lock(&mutex_);
  temporary_.push_back(path);
  return path;
}

void MadeFiles::Expect(const std::string& path) {
  absl::MutexLock lock(&mutex_);
  std::error_code error;
  (fs::exists(path, error) ? replaced_ : files_).push_back(path);
}

std::string MadeFiles::Beside(const std::string& path) {
  absl::MutexLock lock(&mutex_);
  beside_.push_back(path);
  return path + kBeside;
}

absl::Status MadeFiles::PutInPlace() {
  absl::MutexLock lock(&mutex_);
  std::error_code error;
  for (const std::string& path : beside_) {
    const bool replaces = fs::exists(path, error);
    fs::rename(path + kBeside, path, error);
    if (error) return absl::UnavailableError(absl::StrCat("cannot write '", path, "': ", error.message()));
    if (!replaces) files_.push_back(path);
  }
  beside_.clear();
  return absl::OkStatus();
}

void MadeFiles::Keep() {
  absl::MutexLock lock(&mutex_);
  files_.clear();
  replaced_.clear();
  folders_.clear();
}

void MadeFiles::TakeBack() {
  absl::MutexLock lock(&mutex_);
  std::error_code error;
  for (const std::string& file : files_) {
    fs::remove(file, error);
    fs::remove(file + ".part", error);
  }
  for (const std::string& file : replaced_) fs::remove(file + ".part", error);
  for (const std::string& file : beside_) {
    fs::remove(file + kBeside, error);
    fs::remove(file + kBeside + ".part", error);
  }
  for (auto it = folders_.rbegin(); it != folders_.rend(); ++it) fs::remove(*it, error);
  for (const std::string& folder : temporary_) fs::remove_all(folder, error);
  files_.clear();
  replaced_.clear();
  beside_.clear();
  folders_.clear();
  temporary_.clear();
}

absl::Status MakeParentFolder(const std::string& file) {
  const fs::path folder = fs::path(file).parent_path();
  std::error_code error;
  if (!folder.empty()) fs::create_directories(folder, error);
  if (!error) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("cannot write '", file, "': ", error.message()));
}

}  // namespace ndmap::cli

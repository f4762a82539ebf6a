// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/output_folder.h"

#include <fcntl.h>
#include <stdlib.h>
#include <sys/file.h>
#include <sys/stat.h>
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
constexpr const char* kBefore = ".old";
constexpr const char* kLockFile = "/.ndmap-lock";

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
    if (fs::create_directory(*it, error)) {
      folders_.push_back(it->string());
    } else if (error || !fs::is_directory(*it, error)) {
      // Somebody else may have made it meanwhile.
      return refuse(error ? error.message() : "it is a file");
    }
  }
  if (!fs::is_directory(path, error)) return refuse("it is a file");
  std::string probe = absl::StrCat(path, "/.ndmap-XXXXXX");
  const int file = mkstemp(probe.data());
  if (file < 0) return refuse(std::strerror(errno));
  close(file);
  unlink(probe.c_str());
  return absl::OkStatus();
}

absl::Status MadeFiles::LockFolder(const std::string& path) {
  absl::MutexLock lock(&mutex_);
  const std::string file = path + kLockFile;
  while (true) {
    const int descriptor = open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (descriptor < 0) {
      return absl::InvalidArgumentError(absl::StrCat("cannot write '", file, "': ", std::strerror(errno)));
    }
    if (flock(descriptor, LOCK_EX | LOCK_NB) != 0) {
      const int error = errno;
      close(descriptor);
      if (error == EINTR) continue;
      if (error != EWOULDBLOCK) {
        return absl::UnavailableError(absl::StrCat("cannot lock '", file, "': ", std::strerror(error)));
      }
      return absl::FailedPreconditionError(
          absl::StrCat("cannot write into '", path,
                       "': another ndmap is writing there: wait for it to end, or take another folder"));
    }
    // Who had it before may have removed it while this one was opening it.
    struct stat own {
    }, there{};
    if (fstat(descriptor, &own) == 0 && stat(file.c_str(), &there) == 0 && own.st_ino == there.st_ino &&
        own.st_dev == there.st_dev) {
      lock_ = descriptor;
      lock_file_ = file;
      return absl::OkStatus();
    }
    close(descriptor);
  }
}

void MadeFiles::Unlock() {
  if (lock_ < 0) return;
  // While it is locked: a file that others may have locked since is not removed.
  unlink(lock_file_.c_str());
  close(lock_);
  lock_ = -1;
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
  for (const std::string& path : beside_) {
    std::error_code error;
    const bool replaces = fs::exists(path, error);
    if (!error && replaces) fs::rename(path, path + kBefore, error);
    if (!error) {
      fs::rename(path + kBeside, path, error);
      if (!error) {
        placed_.push_back({path, replaces});
        continue;
      }
      std::error_code ignored;
      if (replaces) fs::rename(path + kBefore, path, ignored);
    }
    BringBack();
    return absl::UnavailableError(absl::StrCat("cannot write '", path, "': ", error.message()));
  }
  beside_.clear();
  return absl::OkStatus();
}

void MadeFiles::BringBack() {
  std::error_code error;
  for (auto it = placed_.rbegin(); it != placed_.rend(); ++it) {
    if (it->replaces) {
      fs::rename(it->path + kBefore, it->path, error);
    } else {
      fs::remove(it->path, error);
    }
  }
  placed_.clear();
}

void MadeFiles::RemoveWhenKept(const std::string& path) {
  absl::MutexLock lock(&mutex_);
  stale_.push_back(path);
}

void MadeFiles::Keep() {
  absl::MutexLock lock(&mutex_);
  std::error_code error;
  for (const Placed& placed : placed_) {
    if (placed.replaces) fs::remove(placed.path + kBefore, error);
  }
  for (const std::string& file : stale_) fs::remove(file, error);
  placed_.clear();
  stale_.clear();
  files_.clear();
  replaced_.clear();
  folders_.clear();
}

void MadeFiles::TakeBack() {
  absl::MutexLock lock(&mutex_);
  std::error_code error;
  BringBack();
  for (const std::string& file : files_) {
    fs::remove(file, error);
    fs::remove(file + ".part", error);
  }
  for (const std::string& file : replaced_) fs::remove(file + ".part", error);
  for (const std::string& file : beside_) {
    fs::remove(file + kBeside, error);
    fs::remove(file + kBeside + ".part", error);
  }
  Unlock();
  for (auto it = folders_.rbegin(); it != folders_.rend(); ++it) fs::remove(*it, error);
  for (const std::string& folder : temporary_) fs::remove_all(folder, error);
  stale_.clear();
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

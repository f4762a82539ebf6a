// SPDX-License-Identifier: GPL-3.0-or-later
// Folders and files that a command makes, taken back if it does not succeed.
#pragma once

#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"

namespace ndmap::cli {

// Thread-safe: an interrupt takes everything back while the main thread still writes.
class MadeFiles {
 public:
  MadeFiles() = default;
  // Takes everything back unless Keep() was called.
  ~MadeFiles();
  MadeFiles(const MadeFiles&) = delete;
  MadeFiles& operator=(const MadeFiles&) = delete;

  // Makes the folder, with those above it, and makes sure that files can be written there. One sentence that
  // names the path if it is a file or cannot be written.
  absl::Status MakeFolder(const std::string& path);
  // Keeps others of our kind from writing into the folder, which is there, until all is kept or taken back,
  // or this process ends, however it ends. FAILED_PRECONDITION names the folder if somebody else is at it.
  absl::Status LockFolder(const std::string& path);
  // A new folder of our own below the system's folder for temporary files; it goes away in any case.
  absl::StatusOr<std::string> MakeTemporaryFolder();
  // A file that is about to be written. One that is there already stays when everything is taken back.
  void Expect(const std::string& path);
  // Where to write a file that is to take its place beside others all at once: see PutInPlace().
  std::string Beside(const std::string& path);
  // Moves the files of Beside() to their places, in the order in which they were named. Those that were there
  // wait beside them until Keep(), and come back with TakeBack(). One sentence that names the file if that
  // fails; then all is as it was.
  absl::Status PutInPlace();
  // A file of an earlier time that is to go with Keep().
  void RemoveWhenKept(const std::string& path);
  void Keep();
  // Removes the files, brings back what they replaced, then removes the folders that were made and are empty.
  void TakeBack();

 private:
  // A file that was moved to its place.
  struct Placed {
    std::string path;
    bool replaces = false;
  };
  void BringBack() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Unlock() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  absl::Mutex mutex_;
  std::vector<std::string> folders_ ABSL_GUARDED_BY(mutex_);
  std::vector<std::string> files_ ABSL_GUARDED_BY(mutex_);
  // Places of files that wait beside them.
  std::vector<std::string> beside_ ABSL_GUARDED_BY(mutex_);
  std::vector<Placed> placed_ ABSL_GUARDED_BY(mutex_);
  std::vector<std::string> stale_ ABSL_GUARDED_BY(mutex_);
  std::string lock_file_ ABSL_GUARDED_BY(mutex_);
  int lock_ ABSL_GUARDED_BY(mutex_) = -1;
  // Files that were there before.
  std::vector<std::string> replaced_ ABSL_GUARDED_BY(mutex_);
  std::vector<std::string> temporary_ ABSL_GUARDED_BY(mutex_);
};

// The folder that a file will be in, made if it is missing. One sentence that names the file if that fails.
absl::Status MakeParentFolder(const std::string& file);

}  // namespace ndmap::cli

// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/output_folder.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

namespace ndmap::cli {
namespace {

bool Exists(const std::string& path) { return access(path.c_str(), F_OK) == 0; }

void Write(const std::string& path, const std::string& text) { std::ofstream(path) << text; }

std::string Read(const std::string& path) {
  std::ifstream in(path);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST(MadeFiles, TakesBackWhatItMadeAndNothingElse) {
  MadeFiles outer;
  const std::string root = *outer.MakeTemporaryFolder();
  {
    MadeFiles made;
    ASSERT_TRUE(made.MakeFolder(root + "/a/b").ok());
    made.Expect(root + "/a/b/file");
    Write(root + "/a/b/file", "x");
  }
  EXPECT_FALSE(Exists(root + "/a"));
  EXPECT_TRUE(Exists(root));
  {
    MadeFiles made;
    ASSERT_TRUE(made.MakeFolder(root + "/a/b").ok());
    made.Keep();
  }
  EXPECT_TRUE(Exists(root + "/a/b"));
}

TEST(MadeFiles, AFileThatWasThereStaysWhenEverythingIsTakenBack) {
  MadeFiles outer;
  const std::string root = *outer.MakeTemporaryFolder();
  Write(root + "/old", "old");
  {
    MadeFiles made;
    made.Expect(root + "/old");
    made.Expect(root + "/new");
    Write(root + "/old.part", "half");
    Write(root + "/new", "new");
  }
  EXPECT_EQ(Read(root + "/old"), "old");
  EXPECT_FALSE(Exists(root + "/old.part"));
  EXPECT_FALSE(Exists(root + "/new"));
}

TEST(MadeFiles, FilesBesideOthersTakeTheirPlacesAllAtOnceOrNotAtAll) {
  MadeFiles outer;
  const std::string root = *outer.MakeTemporaryFolder();
  Write(root + "/piece", "old");
  {
    MadeFiles made;
    Write(made.Beside(root + "/piece"), "new");
    Write(made.Beside(root + "/index") + ".part", "half");
    EXPECT_EQ(Read(root + "/piece"), "old");
  }
  EXPECT_EQ(Read(root + "/piece"), "old");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(root), {}), 1);
  {
    MadeFiles made;
    Write(made.Beside(root + "/piece"), "new");
    Write(made.Beside(root + "/index"), "index");
    ASSERT_TRUE(made.PutInPlace().ok());
    made.Keep();
  }
  EXPECT_EQ(Read(root + "/piece"), "new");
  EXPECT_EQ(Read(root + "/index"), "index");
  MadeFiles made;
  made.Beside(root + "/never written");
  EXPECT_NE(made.PutInPlace().message().find("never written"), std::string::npos);
}

TEST(MadeFiles, WhatWasReplacedComesBackUntilTheNewIsKept) {
  MadeFiles outer;
  const std::string root = *outer.MakeTemporaryFolder();
  Write(root + "/piece", "old");
  Write(root + "/stale", "old");
  const auto write = [&](MadeFiles& made) {
    for (const char* name : {"/piece", "/added", "/index"}) Write(made.Beside(root + name), "new");
    made.RemoveWhenKept(root + "/stale");
  };
  {
    // The last has no place: those before it are brought back at once.
    MadeFiles made;
    std::filesystem::create_directories(root + "/index.old/not empty");
    Write(root + "/index", "old");
    write(made);
    EXPECT_NE(made.PutInPlace().message().find(root + "/index"), std::string::npos);
    EXPECT_EQ(Read(root + "/piece"), "old");
    EXPECT_EQ(Read(root + "/index"), "old");
    EXPECT_FALSE(Exists(root + "/added"));
  }
  std::filesystem::remove_all(root + "/index.old");
  std::filesystem::remove(root + "/index");
  {
    // In place, but what comes after it fails.
    MadeFiles made;
    write(made);
    ASSERT_TRUE(made.PutInPlace().ok());
    EXPECT_EQ(Read(root + "/piece"), "new");
  }
  EXPECT_EQ(Read(root + "/piece"), "old");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(root), {}), 2);
  {
    MadeFiles made;
    write(made);
    ASSERT_TRUE(made.PutInPlace().ok());
    EXPECT_TRUE(Exists(root + "/stale"));
    made.Keep();
  }
  EXPECT_EQ(Read(root + "/piece"), "new");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(root), {}), 3);
  EXPECT_FALSE(Exists(root + "/stale"));
}

TEST(MadeFiles, AFolderIsLockedByOneAtATimeAndFreeWhenItHasEnded) {
  MadeFiles outer;
  const std::string root = *outer.MakeTemporaryFolder();
  for (bool keep : {true, false}) {
    MadeFiles second;
    {
      MadeFiles first;
      ASSERT_TRUE(first.LockFolder(root).ok());
      const absl::Status refused = second.LockFolder(root);
      EXPECT_EQ(refused.code(), absl::StatusCode::kFailedPrecondition);
      EXPECT_EQ(refused.message(),
                "cannot write into '" + root +
                    "': another ndmap is writing there: wait for it to end, or take another folder");
      if (keep) first.Keep();
    }
    EXPECT_TRUE(second.LockFolder(root).ok());
  }
  EXPECT_TRUE(std::filesystem::is_empty(root));
  // One that was killed leaves its file, and nothing else.
  Write(root + "/.ndmap-lock", "");
  MadeFiles next;
  EXPECT_TRUE(next.LockFolder(root).ok());
}

TEST(MadeFiles, RefusesAFileAsAFolder) {
  MadeFiles made;
  const std::string root = *made.MakeTemporaryFolder();
  Write(root + "/file", "");
  for (const char* path : {"/file", "/file/below"}) {
    const absl::Status status = made.MakeFolder(root + path);
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << path;
    EXPECT_NE(status.message().find(root + path), std::string::npos) << status;
  }
  EXPECT_FALSE(made.MakeFolder("/proc/nothing/here").ok());
}

}  // namespace
}  // namespace ndmap::cli

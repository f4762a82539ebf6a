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

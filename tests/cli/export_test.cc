// SPDX-License-Identifier: GPL-3.0-or-later
// Meshes as files: each block's server writes its piece, the client streams it into place.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>
#include <vector>

#include "tests/cli/command.h"

namespace ndmap::testing {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

class ExportTest : public ::testing::Test {
 protected:
  void SetUp() override {
    surface_ = folder_ / "torus.off";
    ASSERT_EQ(Ndmap({"sample", "bumpy-torus", "-o", surface_, "--triangles", "2000"}).code, 0);
  }
  // The sizes of the pieces that the index names, which must all be there, in one sum.
  uint64_t BytesOfPieces(const std::string& out, int blocks) {
    std::stringstream index;
    index << std::ifstream(out + "/mesh.pvtu").rdbuf();
    uint64_t bytes = 0;
    for (int block = 0; block < blocks; ++block) {
      const std::string name = "block_000" + std::to_string(block) + ".vtu";
      EXPECT_THAT(index.str(), HasSubstr(name));
      std::ifstream piece(out + "/" + name, std::ios::ate | std::ios::binary);
      EXPECT_TRUE(piece.good()) << name;
      bytes += static_cast<uint64_t>(piece.tellg());
      EXPECT_FALSE(Exists(out + "/" + name + ".part"));
    }
    return bytes;
  }

  TemporaryFolder folder_;
  std::string surface_;
};

TEST_F(ExportTest, ARunWritesAPieceForEachBlockAndAnIndex) {
  const std::string out = folder_ / "new/mesh";
  const Outcome outcome =
      Ndmap({"run", surface_, "--json", "--grid", "8x8x3", "--depth", "2", "--blocks", "3", "-o", out});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(outcome.json()["output"], out + "/mesh.pvtu");
  EXPECT_EQ(outcome.json()["output_bytes"], BytesOfPieces(out, 3));
}

TEST_F(ExportTest, AMapOfAClusterIsWrittenInEitherKindOfCells) {
  Command up({"up", "--processes", "2", "--json"});
  ASSERT_TRUE(up.WaitFor("use it with --coordinator"));
  ASSERT_TRUE(up.WaitFor("\n}\n"));
  const std::string coordinator = CoordinatorOf(up);
  const auto call = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"--json", "--coordinator", coordinator});
    const Outcome outcome = Ndmap(arguments);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return outcome.json();
  };
  call({"create", "torus", surface_, "--grid", "8x8x3", "--blocks", "2"});
  call({"refine", "torus", "--depth", "2"});
  const json trimmed = call({"trim", "torus"});
  uint64_t last = 0;
  for (const char* cells : {"hexahedron", "polyhedron"}) {
    const std::string out = folder_ / cells;
    const json exported = call({"export", "torus", "-o", out, "--cells", cells});
    EXPECT_EQ(exported["index"], out + "/mesh.pvtu");
    EXPECT_EQ(exported["pieces"].size(), 2u);
    EXPECT_EQ(exported["cells"], trimmed["phases"][1]["counts"]["hexahedra"]);
    EXPECT_EQ(exported["bytes"], BytesOfPieces(out, 2));
    // Polyhedra list every face.
    EXPECT_GT(exported["bytes"], last);
    last = exported["bytes"].get<uint64_t>();
  }
}

TEST_F(ExportTest, OneThatFailsLeavesTheFilesThatWereThere) {
  Command up({"up", "--processes", "2", "--json"});
  ASSERT_TRUE(up.WaitFor("use it with --coordinator"));
  ASSERT_TRUE(up.WaitFor("\n}\n"));
  const auto call = [&, coordinator = CoordinatorOf(up)](std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"--json", "--coordinator", coordinator});
    return Ndmap(arguments).code;
  };
  const auto read = [&](const std::string& name) {
    std::stringstream text;
    text << std::ifstream(folder_ / "out/" + name).rdbuf();
    return text.str();
  };
  ASSERT_EQ(call({"create", "torus", surface_, "--grid", "8x8x3", "--blocks", "2"}), 0);
  ASSERT_EQ(call({"export", "torus", "-o", folder_ / "out"}), 0);
  const std::string index = read("mesh.pvtu"), piece = read("block_0000.vtu");
  ASSERT_EQ(call({"refine", "torus", "--depth", "1"}), 0);
  // There is no place for the second piece.
  const std::string in_the_way = folder_ / "out/block_0001.vtu.new.part";
  std::filesystem::create_directories(in_the_way + "/not empty");
  EXPECT_EQ(call({"export", "torus", "-o", folder_ / "out"}), 1);
  EXPECT_EQ(read("mesh.pvtu"), index);
  EXPECT_EQ(read("block_0000.vtu"), piece);
  std::filesystem::remove_all(in_the_way);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder_ / "out"), {}), 3);
  ASSERT_EQ(call({"export", "torus", "-o", folder_ / "out"}), 0);
  EXPECT_NE(read("block_0000.vtu"), piece);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder_ / "out"), {}), 3);
}

TEST_F(ExportTest, TwoAtOnceIntoOneFolderAreOneAndARefusal) {
  const std::string out = folder_ / "out";
  std::filesystem::create_directories(out);
  Command first({"run", surface_, "--depth", "12", "--blocks", "2", "-o", out});
  ASSERT_TRUE(first.WaitFor("refine level 1"));
  const Outcome second = Ndmap({"run", surface_, "--depth", "1", "-o", out});
  EXPECT_EQ(second.code, 1);
  EXPECT_EQ(second.err,
            "ndmap run: cannot write into '" + out +
                "': another ndmap is writing there: wait for it to end, or take another folder\n");
  // Killed as by a machine that has no memory left, it is in nobody's way.
  first.Signal(SIGKILL);
  first.Finish();
  EXPECT_EQ(Ndmap({"run", surface_, "--depth", "1", "--grid", "8x8x3", "-o", out}).code, 0);
}

TEST_F(ExportTest, PiecesOfAnEarlierExportOfMoreBlocksGo) {
  const std::string out = folder_ / "out";
  const auto run = [&](const char* blocks) {
    return Ndmap({"run", surface_, "--grid", "8x8x3", "--depth", "1", "--blocks", blocks, "-o", out}).code;
  };
  ASSERT_EQ(run("3"), 0);
  // Of somebody else, though it looks alike.
  for (const char* name : {"block_1.vtu", "block_0007.vtu.bak", "block_abcd.vtu", "notes"})
    std::ofstream(out + "/" + name) << "mine";
  std::ofstream(out + "/block_0009.vtu.new.part") << "of one that was killed";
  ASSERT_EQ(run("1"), 0);
  EXPECT_TRUE(Exists(out + "/block_0000.vtu"));
  for (const char* gone : {"block_0001.vtu", "block_0002.vtu", "block_0009.vtu.new.part"})
    EXPECT_FALSE(Exists(out + "/" + gone)) << gone;
  for (const char* name : {"block_1.vtu", "block_0007.vtu.bak", "block_abcd.vtu", "notes"})
    EXPECT_TRUE(Exists(out + "/" + name)) << name;
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(out), {}), 6);
}

}  // namespace
}  // namespace ndmap::testing

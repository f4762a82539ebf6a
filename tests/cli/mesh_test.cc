// SPDX-License-Identifier: GPL-3.0-or-later
// `ndmap create --mesh`: a map made from a mesh file, asked, refined, exported and read again; and wrong use.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "tests/cli/command.h"

namespace ndmap::testing {
namespace {

using ::testing::HasSubstr;

// A cube, a prism beside it, a pyramid on the cube, a tetrahedron on the prism.
constexpr char kMixed[] =
    "MeshVersionFormatted 1\nDimension 3\nVertices 12\n"
    "0 0 0 0\n1 0 0 0\n1 1 0 0\n0 1 0 0\n0 0 1 0\n1 0 1 0\n1 1 1 0\n0 1 1 0\n"
    "2 0.5 0 0\n2 0.5 1 0\n0.5 0.5 2 0\n1.5 0.5 2 0\n"
    "Hexahedra 1\n1 2 3 4 5 6 7 8 0\nPrisms 1\n2 9 3 6 10 7 0\nPyramids 1\n5 6 7 8 11 0\n"
    "Tetrahedra 1\n6 10 7 12 0\nEnd\n";

class MeshCommandTest : public ::testing::Test {
 protected:
  MeshCommandTest() : up_({"up", "--processes", "2", "--json"}) {
    EXPECT_TRUE(up_.WaitFor("use it with --coordinator"));
    EXPECT_TRUE(up_.WaitFor("\n}\n"));
    coordinator_ = CoordinatorOf(up_);
    mesh_ = Write("mixed.mesh", kMixed);
  }

  std::string Write(const std::string& name, const std::string& content) {
    std::ofstream(folder_ / name) << content;
    return folder_ / name;
  }
  Outcome Call(std::vector<std::string> arguments) const {
    arguments.insert(arguments.end(), {"--coordinator", coordinator_});
    return Ndmap(arguments);
  }
  nlohmann::json Do(std::vector<std::string> arguments, int code = 0) const {
    arguments.push_back("--json");
    const Outcome outcome = Call(arguments);
    EXPECT_EQ(outcome.code, code) << arguments[0] << ": " << outcome.err;
    return outcome.json();
  }
  // Must not work; its last line.
  std::string Fails(std::vector<std::string> arguments, int code = 1) const {
    const Outcome outcome = Call(std::move(arguments));
    EXPECT_EQ(outcome.code, code) << outcome.err;
    EXPECT_EQ(outcome.out, "");
    EXPECT_EQ(outcome.error_lines(), 1) << outcome.err;
    return outcome.err;
  }

  TemporaryFolder folder_;
  Command up_;
  std::string coordinator_, mesh_;
};

TEST_F(MeshCommandTest, AMapOfAMeshIsAskedRefinedExportedAndMadeAgain) {
  std::string hash;
  for (const char* blocks : {"1", "2", "4"}) {
    const std::string map = std::string("m") + blocks;
    EXPECT_EQ(Do({"create", map, "--mesh", mesh_, "--blocks", blocks, "--partition", "metis"})["state"],
              "done");
    const std::string now = Do({"hash", map})["hash"];
    if (hash.empty()) hash = now;
    EXPECT_EQ(now, hash);
  }
  const auto maps = Do({"maps"})["maps"];
  ASSERT_EQ(maps.size(), 3u);
  EXPECT_EQ(maps[0]["mesh"]["name"], "mixed.mesh");
  EXPECT_EQ(maps[0]["mesh"]["prisms"], 1);
  EXPECT_EQ(maps[0]["grid"], "");
  const auto prism = Do({"cell", "m2", "h1"});
  EXPECT_EQ(prism["kind"], "prism");
  EXPECT_EQ(prism["vertices"].size(), 6u);
  EXPECT_THAT(Call({"cell", "m2", "h2"}).out, HasSubstr("h2: pyramid of level 0"));
  const auto located = Do({"locate", "m4", "1.4,0.5,0.5"});
  EXPECT_THAT(located.dump(), HasSubstr("\"h1\""));
  // In the prism's box, but not in the prism.
  EXPECT_EQ(Call({"locate", "m4", "1.9,0.05,0.5"}).code, 1);
  EXPECT_EQ(Do({"refine", "m4", "--oracle", "everything", "--depth", "2"})["state"], "done");
  EXPECT_EQ(Do({"check", "m4"})["valid"], true);
  const auto stats = Do({"stats", "m4"});
  EXPECT_EQ(stats["counts"]["hexahedra"], 64);
  EXPECT_EQ(stats["counts"]["tetrahedra"], 1);
  EXPECT_EQ(stats["mesh"]["points"], 12);
  EXPECT_THAT(Call({"stats", "m4"}).out, HasSubstr("1 pyramids"));

  const std::string out = folder_ / "out";
  EXPECT_EQ(Do({"export", "m1", "-o", out})["cells"], 4);
  EXPECT_EQ(Do({"create", "again", "--mesh", out + "/block_0000.vtu", "--blocks", "3"})["state"], "done");
  EXPECT_EQ(Do({"hash", "again"})["hash"], hash);
  EXPECT_EQ(Do({"export", "m4", "-o", folder_ / "fine", "--cells", "polyhedron"})["cells"], 67);
}

TEST_F(MeshCommandTest, ASurfaceMayGoWithIt) {
  const std::string surface = folder_ / "ball.off";
  ASSERT_EQ(Ndmap({"sample", "sphere", "-o", surface, "--triangles", "500", "--scale", "0.6"}).code, 0);
  EXPECT_EQ(Do({"create", "m", "--mesh", mesh_, "--blocks", "2", "--surface", surface})["state"], "done");
  EXPECT_EQ(Do({"refine", "m", "--depth", "2"})["state"], "done");
  const auto counts = Do({"stats", "m"})["counts"];
  EXPECT_GT(counts["cut"], 0);
  EXPECT_EQ(Do({"trim", "m", "--keep", "inside,cut"})["state"], "done");
  EXPECT_EQ(Do({"check", "m"})["valid"], true);
  EXPECT_LT(Do({"stats", "m"})["counts"]["hexahedra"], counts["hexahedra"]);
}

TEST_F(MeshCommandTest, WrongUseIsOneSentenceAndLeavesNothing) {
  EXPECT_THAT(Fails({"create", "m"}, 2), HasSubstr("SURFACE, or --mesh FILE, is required"));
  for (const char* flag : {"--grid=2x2x2", "--cubes=3", "--padding=0.1", "--depth=2"}) {
    EXPECT_THAT(Fails({"create", "m", "--mesh", mesh_, flag}, 2), HasSubstr("excludes --"));
  }
  EXPECT_THAT(Fails({"create", "m", "ball.off", "--merge-points"}, 2),
              HasSubstr("--merge-points requires --mesh"));
  EXPECT_THAT(Fails({"create", "m", "--mesh", mesh_, "--partition", "best"}, 2),
              HasSubstr("'best' is none of"));
  EXPECT_THAT(Fails({"create", "m", "--mesh", mesh_, "--partition", "slabs"}),
              HasSubstr("partition 'slabs' of a mesh, expected hilbert, morton or metis"));
  EXPECT_THAT(Fails({"create", "m", "--mesh", mesh_, "--blocks", "5"}),
              HasSubstr("5 blocks, expected 1 to 4, the number of cells of the mesh"));
  EXPECT_THAT(Fails({"create", "m", "--mesh", folder_ / "none.mesh"}), HasSubstr("none.mesh"));
  EXPECT_THAT(Fails({"create", "m/n", "--mesh", mesh_}), HasSubstr("m/n"));
  // Turned inside out: the cell is named as the file counts it.
  std::string turned = kMixed;
  turned.replace(turned.find("6 10 7 12"), 9, "10 6 7 12");
  EXPECT_THAT(Fails({"create", "m", "--mesh", Write("turned.mesh", turned)}), HasSubstr("tetrahedron 1"));
  EXPECT_EQ(Do({"maps"})["maps"].size(), 0u);
  Do({"create", "m", "--mesh", mesh_, "--blocks", "2"});
  EXPECT_THAT(Fails({"create", "m", "--mesh", mesh_, "--blocks", "2"}),
              HasSubstr("there is a map \"m\" already"));
  // The map has no surface, and says so.
  EXPECT_THAT(Call({"refine", "m"}).err, HasSubstr("the map has no surface"));
  EXPECT_EQ(Do({"check", "m"})["valid"], true);
}

}  // namespace
}  // namespace ndmap::testing

// SPDX-License-Identifier: GPL-3.0-or-later
// What a wrong command line, a wrong file and a cluster that is not there lead to: one line, no hang, nothing
// left.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdlib>
#include <fstream>
#include <string>
#include <vector>

#include "tests/cli/command.h"

namespace ndmap::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

std::string Surface() {
  static const TemporaryFolder folder;
  const std::string path = folder / "sphere.off";
  if (!Exists(path)) Ndmap({"sample", "sphere", "-o", path, "--triangles", "500"});
  return path;
}

struct WrongUse {
  const char* name;
  std::vector<std::string> arguments;
  std::string says;
};

class WrongUseTest : public ::testing::TestWithParam<WrongUse> {};

TEST_P(WrongUseTest, IsOneLineAndNotZero) {
  std::vector<std::string> arguments = GetParam().arguments;
  for (std::string& argument : arguments) {
    if (argument == "SURFACE") argument = Surface();
  }
  const Outcome outcome = Ndmap(arguments);
  EXPECT_NE(outcome.code, 0);
  EXPECT_LT(outcome.code, 128);
  EXPECT_EQ(outcome.error_lines(), 1 + (outcome.err.rfind("read ", 0) == 0)) << outcome.err;
  EXPECT_EQ(outcome.out, "");
  EXPECT_THAT(outcome.err, HasSubstr(GetParam().says));
  EXPECT_LT(outcome.seconds, 5);
}

INSTANTIATE_TEST_SUITE_P(
    All, WrongUseTest,
    ::testing::Values(
        WrongUse{"NoCommand", {}, "no command was given"}, WrongUse{"UnknownCommand", {"refnie"}, "refnie"},
        WrongUse{"UnknownFlag", {"run", "SURFACE", "--dept", "3"}, "--dept"},
        WrongUse{"NoSurface", {"run"}, "SURFACE is required"},
        WrongUse{"BadNumber", {"run", "SURFACE", "--depth", "three"}, "'three' is not a whole number"},
        WrongUse{
            "NegativeDepth", {"run", "SURFACE", "--depth", "-1"}, "'-1' is not a whole number from 0 to 29"},
        WrongUse{"DepthAboveLimit", {"run", "SURFACE", "--depth", "30"}, "ids of cells hold 29 levels"},
        WrongUse{"SizeAboveLimit", {"run", "SURFACE", "--size", "1e-30"}, "29 levels"},
        WrongUse{"DepthAboveTheGrids",
                 {"run", "SURFACE", "--grid", "10x11x9", "--depth", "18"},
                 "on a grid of 10x11x9 numbers in files reach level 17"},
        WrongUse{"DryDepthAboveTheGrids",
                 {"run", "SURFACE", "--grid", "10x11x9", "--depth", "18", "--dry-run"},
                 "on a grid of 10x11x9 numbers in files reach level 17"},
        WrongUse{"LptOfTooManyHexahedra",
                 {"run", "SURFACE", "--grid", "80x80x80", "--partition", "lpt"},
                 "partition lpt lists every hexahedron"},
        WrongUse{"DryLptOfTooManyHexahedra",
                 {"run", "SURFACE", "--grid", "80x80x80", "--partition", "lpt", "--dry-run"},
                 "partition lpt lists every hexahedron"},
        WrongUse{"BadSize", {"run", "SURFACE", "--size", "0"}, "'0' is not a number above 0"},
        WrongUse{
            "GridAndCubes", {"run", "SURFACE", "--grid", "2x2x2", "--cubes", "3"}, "--grid excludes --cubes"},
        WrongUse{
            "DepthAndSize", {"run", "SURFACE", "--depth", "2", "--size", "1"}, "--depth excludes --size"},
        WrongUse{"BadGrid", {"run", "SURFACE", "--grid", "2x2"}, "'2x2' is not AxBxC"},
        WrongUse{"ZeroGrid", {"run", "SURFACE", "--grid", "2x0x2"}, "'2x0x2' is not AxBxC"},
        WrongUse{"ZeroCubes", {"run", "SURFACE", "--cubes", "0"}, "--cubes"},
        WrongUse{"BadPadding", {"run", "SURFACE", "--padding", "-0.1"}, "'-0.1' is not a number from 0"},
        WrongUse{"ZeroBlocks", {"run", "SURFACE", "--blocks", "0"}, "--blocks: '0'"},
        WrongUse{"MoreBlocksThanCells",
                 {"run", "SURFACE", "--grid", "1x1x2", "--blocks", "3"},
                 "only 2 hexahedra"},
        WrongUse{"MoreProcessesThanBlocks",
                 {"run", "SURFACE", "--blocks", "2", "--processes", "3"},
                 "only 2 blocks"},
        WrongUse{"BadMemory", {"run", "SURFACE", "--memory-limit", "1XB"}, "'1XB' is not a size"},
        WrongUse{"BadRouting",
                 {"run", "SURFACE", "--routing", "psychic"},
                 "'psychic' is none of direct, broadcast"},
        WrongUse{"BadPartition", {"run", "SURFACE", "--partition", "fair"}, "'fair' is none of"},
        WrongUse{"BadKeep", {"run", "SURFACE", "--keep", "outside"}, "'outside' is none of"},
        WrongUse{"BadCells", {"run", "SURFACE", "--cells", "tetrahedron"}, "'tetrahedron' is none of"},
        WrongUse{"UnwritableOutput",
                 {"run", "SURFACE", "-o", "/proc/nothing"},
                 "cannot write into '/proc/nothing'"},
        WrongUse{"OutputIsAFile", {"run", "SURFACE", "-o", "/etc/passwd"}, "it is a file"},
        WrongUse{"NoSuchSurface", {"run", "/nonexistent/cow.off"}, "/nonexistent/cow.off: no such file"},
        WrongUse{"UnknownSample", {"sample", "teapot", "-o", "x.off"}, "'teapot' is none of"},
        WrongUse{
            "UnwritableSample", {"sample", "sphere", "-o", "/proc/nothing/x.off"}, "/proc/nothing/x.off"},
        WrongUse{"NoCoordinator", {"maps"}, "no coordinator: give --coordinator"},
        WrongUse{"BadCoordinator", {"maps", "--coordinator", "localhost"}, "'localhost' is not HOST:PORT"},
        WrongUse{"BadWord", {"beta", "m", "0:0", "1,4"}, "'1,4' is not a word of betas"},
        WrongUse{"BadDart", {"beta", "m", "zero", "1"}, "'zero' is not a dart"},
        WrongUse{"BadJob", {"watch", "last"}, "'last' is not a whole number"},
        WrongUse{"BadOracle", {"refine", "m", "--oracle", "delphi"}, "'delphi' is none of"},
        WrongUse{"OracleNeedsParameter",
                 {"refine", "m", "--oracle", "sphere", "--centre", "0,0,0"},
                 "needs --radius"},
        WrongUse{"ParameterOfAnotherOracle",
                 {"refine", "m", "--radius", "1"},
                 "--radius is not for --oracle surface"},
        WrongUse{"BadCell", {"cell", "m", "h1/9"}, "expected the id of a cell"},
        WrongUse{"BadCellOfARing", {"ring", "m", "12", "1"}, "'12'"},
        WrongUse{"BadPoint", {"locate", "m", "1,2"}, "'1,2' is not a point: three finite numbers"},
        WrongUse{"PointThatIsNaN", {"locate", "m", "0,0,0", "1,2,nan"}, "'1,2,nan' is not a point"},
        WrongUse{"HugePoint", {"nearest", "m", "1e999,0,0"}, "'1e999,0,0' is not a point"},
        WrongUse{"NegativePointWithoutADigit", {"locate", "m", "-.5,-.5,0"}, "no coordinator"},
        WrongUse{"NoPoint", {"locate", "m"}, "POINT is required"},
        WrongUse{"OneCorner", {"box", "m", "0,0,0"}, "POINT"},
        WrongUse{"BoxUpsideDown", {"box", "m", "0,1,0", "1,0,1"}, "must not be above the second"},
        WrongUse{"NegativeRing", {"ring", "m", "h1", "-1"}, "'-1' is not a whole number from 1 to 32"},
        WrongUse{"HugeRing", {"ring", "m", "h1", "99999999999"}, "'99999999999' is not a whole number"},
        WrongUse{"ThroughItself",
                 {"neighbors", "m", "h1", "--through", "3"},
                 "h1 is of dimension 3 itself, expected another one"},
        WrongUse{"BadThrough", {"neighbors", "m", "h1", "--through", "4"}, "'4' is not a whole number"},
        WrongUse{"BadDimension", {"incident", "m", "h1", "--dim", "-1"}, "'-1' is not a whole number"},
        WrongUse{"NoDimension", {"orbit", "m", "0:1"}, "--cell-dimension is required"},
        WrongUse{"BadOrbitDart", {"orbit", "m", "0:x", "-i", "0"}, "'0:x' is not a dart"},
        WrongUse{"NegativeDart", {"orbit", "m", "0:-1", "-i", "0"}, "'0:-1' is not a dart"},
        WrongUse{"BadForm", {"cell", "m", "h1", "-o", "xml"}, "'xml' is none of table, json, csv"},
        WrongUse{"TwoForms", {"cell", "m", "h1", "-o", "csv", "--json"}, "--json contradicts -o csv"},
        WrongUse{"BadStart", {"walk", "m", "nowhere"}, "'nowhere'"},
        WrongUse{"BadShell", {"completion", "fish"}, "'fish' is none of bash, zsh"},
        WrongUse{"BadPort", {"up", "--port", "70000"}, "'70000'"}),
    [](const auto& info) { return info.param.name; });

TEST(Usage, EveryCommandHasHelpWithAnExample) {
  for (const char* command :
       {"run",     "up",     "create",     "refine",   "trim",      "stats",  "check",   "hash",
        "export",  "delete", "maps",       "jobs",     "watch",     "cancel", "version", "beta",
        "sample",  "cell",   "orbit",      "incident", "neighbors", "ring",   "locate",  "box",
        "nearest", "walk",   "completion", "inspect",  "agg",       "attr"}) {
    const Outcome outcome = Ndmap({command, "--help"});
    EXPECT_EQ(outcome.code, 0) << command;
    EXPECT_THAT(outcome.out, HasSubstr(std::string("Example: ndmap ") + command)) << command;
    EXPECT_EQ(outcome.err, "") << command;
  }
  for (const char* command : {"define", "drop", "list", "read", "write", "set"}) {
    EXPECT_THAT(Ndmap({"attr", command, "--help"}).out,
                HasSubstr(std::string("Example: ndmap attr ") + command));
  }
  EXPECT_THAT(Ndmap({"--help"}).out, HasSubstr("Example: ndmap sample"));
}

TEST(Usage, VersionNeedsNoCluster) {
  const Outcome outcome = Ndmap({"version", "--json"});
  EXPECT_EQ(outcome.code, 0);
  EXPECT_EQ(outcome.json()["protocol"], 1);
}

TEST(Usage, AFullStandardOutputIsAFailure) {
  const TemporaryFolder folder;
  const std::string command =
      std::string(NDMAP_PROGRAM) + " version >/dev/full 2>" + (folder / "errors") + " </dev/null";
  const int status = std::system(command.c_str());
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 1);
  std::string said;
  std::getline(std::ifstream(folder / "errors"), said);
  EXPECT_EQ(said, "ndmap version: standard output cannot be written");
}

TEST(Usage, SampleIsASurfaceThatCanBeReadAgain) {
  const TemporaryFolder folder;
  const Outcome made = Ndmap({"sample", "bumpy-torus", "-o", folder / "deep/torus.off", "--json"});
  EXPECT_EQ(made.code, 0) << made.err;
  EXPECT_EQ(made.json()["triangles"], 10000);
  const Outcome dry = Ndmap({"run", folder / "deep/torus.off", "--dry-run", "--depth", "3", "--json"});
  EXPECT_EQ(dry.code, 0) << dry.err;
  EXPECT_GT(dry.json()["made"], 10000);
  EXPECT_EQ(dry.json()["levels"].size(), 4u);
  EXPECT_GT(dry.json()["memory_bytes"], 1e6);
}

TEST(Usage, ABadSurfaceLeavesNothingBehind) {
  const TemporaryFolder folder;
  std::ofstream(folder / "open.off") << "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
  Command command({"run", folder / "open.off", "-o", folder / "out"});
  const Outcome outcome = command.Finish();
  EXPECT_EQ(outcome.code, 1);
  EXPECT_EQ(outcome.error_lines(), 1) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("open.off"));
  EXPECT_TRUE(command.WaitForAllToEnd());
  EXPECT_FALSE(Exists(folder / "out"));
}

TEST(Unreachable, ACoordinatorThatIsNotThere) {
  for (const char* command : {"maps", "jobs", "version"}) {
    const Outcome outcome = Ndmap({command, "--coordinator", "127.0.0.1:" + std::to_string(FreePort())});
    EXPECT_EQ(outcome.code, 1);
    EXPECT_EQ(outcome.error_lines(), 1) << outcome.err;
    EXPECT_THAT(outcome.err, HasSubstr("cannot be reached: Connection refused"));
    EXPECT_LT(outcome.seconds, 5);
  }
}

TEST(Unreachable, ACoordinatorThatDoesNotAnswer) {
  const SilentListener listener;
  const Outcome outcome = Ndmap({"maps", "--coordinator", "127.0.0.1:" + std::to_string(listener.port())});
  EXPECT_EQ(outcome.code, 1);
  EXPECT_EQ(outcome.error_lines(), 1) << outcome.err;
  EXPECT_THAT(outcome.err, StartsWith("ndmap maps: the coordinator at 127.0.0.1:"));
  EXPECT_LT(outcome.seconds, 5);
}

TEST(Unreachable, APortInUse) {
  const SilentListener listener;
  Command command({"up", "--port", std::to_string(listener.port())});
  const Outcome outcome = command.Finish();
  EXPECT_EQ(outcome.code, 1);
  EXPECT_EQ(outcome.error_lines(), 1) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("port " + std::to_string(listener.port())));
  EXPECT_LT(outcome.seconds, 5);
  EXPECT_TRUE(command.WaitForAllToEnd());
}

}  // namespace
}  // namespace ndmap::testing

// SPDX-License-Identifier: GPL-3.0-or-later
// Attributes on the command line: attr and agg. Files of VTK: tests/vtk/attributes_round_trip_test.py.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>
#include <string>
#include <vector>

#include "tests/cli/map_cluster.h"

namespace ndmap::testing {
namespace {

using nlohmann::json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

class AttributesTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() { cluster_ = new MapCluster; }
  static void TearDownTestSuite() { delete cluster_; }
  static json Do(const std::vector<std::string>& arguments, int code = 0) {
    return cluster_->Do(arguments, code);
  }
  static std::string Text(const std::vector<std::string>& arguments) {
    const Outcome outcome = cluster_->Call(arguments);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return outcome.out;
  }
  static void Define(const std::string& name, std::vector<std::string> more) {
    more.insert(more.begin(), {"attr", "define", "m", name});
    Do(more);
  }
  static std::vector<std::string> SortedLines(const std::string& text) {
    std::istringstream in(text);
    std::vector<std::string> lines;
    for (std::string line; std::getline(in, line);) lines.push_back(line);
    if (lines.size() > 1) std::sort(lines.begin() + 1, lines.end());
    return lines;
  }

  static MapCluster* cluster_;
};
MapCluster* AttributesTest::cluster_ = nullptr;

TEST_F(AttributesTest, DefinedListedAndDropped) {
  Define("wind", {"--dim", "0", "--type", "vec3", "--split", "mean", "--fill", "1,0,-0.5"});
  Define("kind", {"--dim", "2", "--type", "category", "--fill", "a, b"});
  const json all = Do({"attr", "list", "m"})["attributes"];
  ASSERT_EQ(all.size(), 2u);
  EXPECT_EQ(all[0], (json{{"name", "wind"},
                          {"dimension", 0},
                          {"type", "vec3"},
                          {"split", "mean"},
                          {"fill", {1.0, 0.0, -0.5}}}));
  EXPECT_EQ(
      Text({"attr", "list", "m", "-o", "csv"}),
      "name,cells,type,split,fill\nwind,vertices,vec3,mean,\"1.0,0.0,-0.5\"\nkind,faces,category,copy,\"a, "
      "b\"\n");
  EXPECT_THAT(Text({"attr", "list", "m"}), HasSubstr("wind  vertices  vec3"));
  EXPECT_THAT(cluster_->Fails({"attr", "define", "m", "wind"}), HasSubstr("wind"));
  EXPECT_THAT(cluster_->Fails({"attr", "define", "m", "x", "--dim", "3", "--split", "mean"}),
              HasSubstr("mean"));
  EXPECT_THAT(cluster_->Fails({"attr", "define", "m", "x", "--fill", "y"}),
              HasSubstr("--fill: 'y' is no value, expected a number"));
  Do({"attr", "drop", "m", "wind"});
  Do({"attr", "drop", "m", "kind"});
  EXPECT_EQ(Text({"attr", "list", "m"}), "no attributes\n");
  EXPECT_THAT(cluster_->Fails({"attr", "drop", "m", "wind"}), HasSubstr("wind"));
}

TEST_F(AttributesTest, ReadByIdsBoxLevelAndAll) {
  Define("t", {"--fill", "1.5"});
  const json two = Do({"attr", "read", "m", "t", "@level", "--ids", "h50", "h3"});
  EXPECT_EQ(two["count"], 2);
  EXPECT_EQ(two["cells"], (json::array({{{"cell", "h50"}, {"t", 1.5}, {"@level", 0}},
                                        {{"cell", "h3"}, {"t", 1.5}, {"@level", 0}}})));
  EXPECT_EQ(Do({"attr", "read", "m", "t", "--all"})["count"], 108);
  EXPECT_EQ(Do({"attr", "read", "m", "t", "--level", "0"})["count"], 108);
  EXPECT_EQ(Do({"attr", "read", "m", "t", "--level", "1-29"})["count"], 0);
  EXPECT_EQ(Do({"attr", "read", "m", "t", "--box", "0.1,0.1,0.1", "0.2,0.2,0.1"})["count"], 1);
  // Vertices of the hexahedron that the box meets.
  Do({"attr", "define", "m", "v", "--dim", "0"});
  EXPECT_EQ(Do({"attr", "read", "m", "@point", "--dim", "0", "--box", "0.1,0.1,0.1", "0.2,0.2,0.1"})["count"],
            8);
  EXPECT_THAT(SortedLines(Text({"attr", "read", "m", "t", "--ids", "h1", "h0", "-o", "csv"})),
              ElementsAre("id,t", "h0,1.5", "h1,1.5"));
  EXPECT_EQ(Text({"attr", "read", "m", "t", "--ids", "h1"}),
            "cell    t\n---------\nh1    1.5\n1 hexahedron\n");
  EXPECT_THAT(
      SortedLines(Text({"attr", "read", "m", "@point", "--dim", "0", "--ids", "v0:7", "-o", "csv"}))[0],
      "id,@point:0,@point:1,@point:2");
  Do({"attr", "drop", "m", "t"});
  Do({"attr", "drop", "m", "v"});
}

TEST_F(AttributesTest, IdsThatAreNotThereAreSaidAndTheOthersDone) {
  Define("n", {"--type", "int64"});
  Outcome outcome = cluster_->Call({"attr", "set", "m", "n", "-5", "--cell", "h1", "h1/3", "h2"});
  EXPECT_EQ(outcome.code, 1);
  EXPECT_EQ(outcome.out, "2 hexahedra written\n");
  EXPECT_EQ(outcome.err, "ndmap attr set: map 'm' lacks 1 of the cells: h1/3\n");
  outcome = cluster_->Call({"attr", "read", "m", "n", "--ids", "h1", "h1/3", "h2", "-o", "csv"});
  EXPECT_EQ(outcome.code, 1);
  EXPECT_EQ(outcome.out, "id,n\nh1,-5\nh2,-5\n");
  EXPECT_EQ(outcome.err, "ndmap attr read: map 'm' lacks 1 of the cells: h1/3\n");
  Do({"attr", "drop", "m", "n"});
}

TEST_F(AttributesTest, CsvOutIsCsvIn) {
  Define("a", {"--dim", "1", "--type", "category"});
  Define("b", {"--dim", "1", "--type", "category"});
  Do({"attr", "set", "m", "a", "say \"x\", twice", "--box", "0,0,0", "1,1,1"});
  const std::string csv = Text({"attr", "read", "m", "a", "--all", "-o", "csv"});
  const Outcome wrote = NdmapWithInput(cluster_->With({"attr", "write", "m", "b", "--array", "a"}), csv);
  EXPECT_EQ(wrote.code, 0) << wrote.err;
  EXPECT_THAT(wrote.out, HasSubstr(" edges written\n"));
  const std::vector<std::string> a = SortedLines(csv),
                                 b = SortedLines(Text({"attr", "read", "m", "b", "--all", "-o", "csv"}));
  ASSERT_EQ(a.size(), b.size());
  EXPECT_TRUE(std::equal(a.begin() + 1, a.end(), b.begin() + 1));
  EXPECT_THAT(csv, HasSubstr("\"say \"\"x\"\", twice\""));
  Do({"attr", "drop", "m", "a"});
  Do({"attr", "drop", "m", "b"});
}

TEST_F(AttributesTest, WrongCsvIsRefusedWithItsLineAndNothingIsWritten) {
  Define("n", {"--type", "int64"});
  const auto refused = [&](const std::string& text) {
    const Outcome outcome = NdmapWithInput(cluster_->With({"attr", "write", "m", "n"}), text);
    EXPECT_EQ(outcome.code, 1);
    EXPECT_EQ(outcome.error_lines(), 1) << outcome.err;
    return outcome.err;
  };
  EXPECT_THAT(refused(""), HasSubstr("standard input, line 1: is empty"));
  EXPECT_THAT(refused("a,b\n"), HasSubstr("line 1: titles a,b, expected id,n"));
  EXPECT_THAT(refused("id,n\nh1,2\nh2,x\n"), HasSubstr("line 3: 'x' is no value, expected a whole number"));
  EXPECT_THAT(refused("id,n\nh1,2\nh2\n"), HasSubstr("line 3: 1 cells in this row, there are 2 titles"));
  EXPECT_THAT(refused("id,n\nz,2\n"), HasSubstr("line 2: 'z', expected the id of a cell"));
  EXPECT_THAT(refused("id,n\nv1:2,2\n"), HasSubstr("v1:2 is of dimension 0, n is of hexahedra"));
  EXPECT_EQ(Do({"agg", "m", "n"})["groups"][0]["integer_sum"], 0);
  EXPECT_THAT(cluster_->Fails({"attr", "write", "m", "n", "--from", "/nowhere/x.csv"}),
              HasSubstr("/nowhere/x.csv"));
  EXPECT_THAT(cluster_->Fails({"attr", "write", "m", "none"}),
              HasSubstr("has no attribute 'none', it has n"));
  Do({"attr", "drop", "m", "n"});
}

TEST_F(AttributesTest, Aggregates) {
  Define("n", {"--type", "int64"});
  Define("rock", {"--type", "category", "--fill", "chalk"});
  Do({"attr", "set", "m", "n", "4", "--ids", "h0", "h1", "h2"});
  Do({"attr", "set", "m", "rock", "granite", "--ids", "h0"});
  const json all = Do({"agg", "m", "n", "--histogram", "2:0:4", "--integral"})["groups"][0];
  EXPECT_EQ(all["count"], 108);
  EXPECT_EQ(all["integer_sum"], 12);
  EXPECT_EQ(all["min"], json::array({0.0}));
  EXPECT_EQ(all["max"], json::array({4.0}));
  EXPECT_EQ(all["histogram"], json::array({105, 3}));
  const double volume = all["volume"];
  EXPECT_NEAR(all["integral"][0].get<double>(), volume * 12 / 108, 1e-9 * volume);
  EXPECT_EQ(Text({"agg", "m", "n", "--by", "category:rock", "-o", "csv"}),
            "group,count,sum,mean,min,max,not_finite\nchalk,107,8," + json(8.0 / 107).dump() +
                ",0.0,4.0,0\ngranite,1,4,4.0,4.0,4.0,0\n");
  Do({"attr", "define", "m", "v", "--dim", "0"});
  EXPECT_EQ(Text({"agg", "m", "--dim", "0"}), "group  count\n------------\nall      196\n");
  EXPECT_EQ(Do({"agg", "m", "n", "--by", "block"})["groups"].size(), 2u);
  EXPECT_THAT(Text({"agg", "m", "n", "--histogram", "2:0:4", "-o", "csv"}),
              StartsWith("group,from,to,count\n,-inf,0.0,0\n,0.0,2.0,105\n,2.0,4.0,3\n,4.0,inf,0\n"));
  EXPECT_THAT(cluster_->Fails({"agg", "m", "none"}), HasSubstr("has no attribute 'none'"));
  Do({"attr", "drop", "m", "n"});
  Do({"attr", "drop", "m", "rock"});
  Do({"attr", "drop", "m", "v"});
}

TEST_F(AttributesTest, WrongCommandLinesAreSaid) {
  const auto refused = [](const std::vector<std::string>& arguments) {
    const Outcome outcome = Ndmap(arguments);
    EXPECT_EQ(outcome.code, 2) << arguments[1];
    EXPECT_EQ(outcome.error_lines(), 1);
    return outcome.err;
  };
  EXPECT_THAT(refused({"attr"}), StartsWith("ndmap attr: "));
  refused({"attr", "read", "m", "t"});
  refused({"attr", "read", "m", "t", "--all", "--level", "1"});
  EXPECT_THAT(refused({"attr", "read", "m", "t", "--ids", "x"}), HasSubstr("expected the id of a cell"));
  EXPECT_THAT(refused({"attr", "define", "m", "t", "--type", "float"}), HasSubstr("float"));
  EXPECT_THAT(refused({"agg", "m", "t", "--by", "size"}),
              HasSubstr("expected level, block or category:NAME"));
  EXPECT_THAT(refused({"agg", "m", "t", "--histogram", "0:1:2"}), HasSubstr("BINS:LO:HI"));
}

}  // namespace
}  // namespace ndmap::testing

// SPDX-License-Identifier: GPL-3.0-or-later
// Questions about cells on the command line, against a map whose neighbourhoods are known.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "tests/cli/map_cluster.h"

namespace ndmap::testing {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::StartsWith;
using Ids = std::set<std::string>;

// In the middle of the grid: (2, 2, 1) of 6 x 6 x 3.
constexpr char kInner[] = "h50";

class CellsTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() { cluster_ = new MapCluster; }
  static void TearDownTestSuite() { delete cluster_; }
  static json Do(const std::vector<std::string>& arguments, int code = 0) {
    return cluster_->Do(arguments, code);
  }
  static Ids IdsOf(const json& cells) {
    Ids ids;
    for (const json& cell : cells) ids.insert(cell["cell"].get<std::string>());
    EXPECT_EQ(ids.size(), cells.size());
    return ids;
  }
  static Ids Cells(const std::vector<std::string>& arguments) { return IdsOf(Do(arguments)["cells"]); }
  static std::string Text(const json& point) {
    return point[0].dump() + "," + point[1].dump() + "," + point[2].dump();
  }

  static MapCluster* cluster_;
};
MapCluster* CellsTest::cluster_ = nullptr;

TEST_F(CellsTest, ACellTellsAboutItself) {
  const json cell = Do({"cell", "m", kInner});
  EXPECT_EQ(cell["cell"], kInner);
  EXPECT_EQ(cell["dimension"], 3);
  EXPECT_EQ(cell["level"], 0);
  EXPECT_EQ(cell["state"], "unknown");
  EXPECT_EQ(cell["darts"], 24);
  EXPECT_EQ(cell["boundary"], false);
  EXPECT_EQ(cell["blocks"].size(), 1u);
  ASSERT_EQ(cell["vertices"].size(), 8u);
  EXPECT_EQ(Do({"cell", "m", "h0"})["boundary"], true);
  const json vertex = Do({"cell", "m", cell["vertices"][0]["vertex"]});
  EXPECT_EQ(vertex["dimension"], 0);
  EXPECT_TRUE(vertex["state"].is_null());
  EXPECT_EQ(vertex["vertices"], json::array({cell["vertices"][0]}));

  const std::string text = cluster_->Call({"cell", "m", kInner}).out;
  EXPECT_THAT(text, StartsWith("h50: hexahedron of level 0, unknown\ndart      "));
  EXPECT_THAT(text, HasSubstr("boundary  no\n"));
  EXPECT_EQ(cluster_->Call({"cell", "m", kInner, "-o", "json"}).json(), cell);
}

TEST_F(CellsTest, NeighboursOfAnInnerHexahedronAreThoseOfTheGrid) {
  const Ids faces = {"h49", "h51", "h44", "h56", "h14", "h86"};
  EXPECT_EQ(Cells({"neighbors", "m", kInner}), faces);
  EXPECT_EQ(Cells({"ring", "m", kInner, "1"}), faces);
  EXPECT_EQ(Cells({"ring", "m", kInner, "1", "--through", "1"}).size(), 18u);
  const Ids around = Cells({"ring", "m", kInner, "1", "--through", "0"});
  EXPECT_EQ(around.size(), 26u);
  EXPECT_EQ(around.count(kInner), 0u);
  // Five by five by the three layers of the grid, without itself.
  EXPECT_EQ(Cells({"ring", "m", kInner, "2", "--through", "0"}).size(), 74u);
  EXPECT_EQ(Cells({"ring", "m", kInner, "32", "--through", "0"}).size(), 107u);
  EXPECT_EQ(Cells({"neighbors", "m", "h0"}).size(), 3u);
  // An inner vertex has six edges.
  const std::string vertex = Do({"cell", "m", kInner})["vertices"][0]["vertex"];
  EXPECT_EQ(Cells({"neighbors", "m", vertex}).size(), 6u);
}

TEST_F(CellsTest, WalkingToNeighboursFindsWhatTheBoxHolds) {
  const json cell = Do({"cell", "m", kInner});
  const std::string lo = Text(cell["vertices"][0]["point"]), hi = Text(cell["vertices"][7]["point"]);
  Ids around = Cells({"neighbors", "m", kInner, "--through", "0"});
  around.insert(kInner);
  EXPECT_EQ(Cells({"box", "m", lo, hi}), around);
  const json ids = Do({"box", "m", lo, hi, "--ids"});
  EXPECT_EQ(ids["count"], 27);
  EXPECT_EQ(Ids(ids["ids"].begin(), ids["ids"].end()), around);
  EXPECT_EQ(Do({"box", "m", "-100,-100,-100", "100,100,100", "--ids"})["count"], 108);
  EXPECT_EQ(Do({"box", "m", "50,50,50", "100,100,100"})["count"], 0);
}

TEST_F(CellsTest, PointsAreLocated) {
  const json cell = Do({"cell", "m", kInner});
  json centre = {0.0, 0.0, 0.0};
  for (const json& vertex : cell["vertices"]) {
    for (size_t i = 0; i < 3; ++i) centre[i] = centre[i].get<double>() + vertex["point"][i].get<double>() / 8;
  }
  const std::string corner = Text(cell["vertices"][3]["point"]);
  const json found = Do({"locate", "m", Text(centre), corner});
  ASSERT_EQ(found["points"].size(), 2u);
  EXPECT_EQ(IdsOf(found["points"][0]["cells"]), Ids{kInner});
  EXPECT_EQ(IdsOf(found["points"][1]["cells"]).size(), 8u);
  // The answer is no.
  EXPECT_EQ(Do({"locate", "m", "-100,-100,-100"}, 1)["points"][0]["count"], 0);
  const Outcome table = cluster_->Call({"locate", "m", Text(centre), "-100,0,0"});
  EXPECT_EQ(table.code, 1);
  EXPECT_EQ(table.err, "");
  EXPECT_THAT(table.out, HasSubstr("-100,0,0"));
  EXPECT_THAT(table.out, HasSubstr("none\n"));
  EXPECT_THAT(table.out, HasSubstr("1 hexahedron\n"));

  const json nearest = Do({"nearest", "m", corner});
  EXPECT_EQ(nearest["cell"], cell["vertices"][3]["vertex"]);
  EXPECT_EQ(nearest["distance"], 0.0);
}

TEST_F(CellsTest, IncidentCellsAndOrbits) {
  EXPECT_EQ(Cells({"incident", "m", kInner, "--dim", "0"}).size(), 8u);
  EXPECT_EQ(Cells({"incident", "m", kInner, "--dim", "1"}).size(), 12u);
  EXPECT_EQ(Cells({"incident", "m", kInner, "--dim", "2"}).size(), 6u);
  EXPECT_EQ(Cells({"incident", "m", kInner, "--dim", "3"}), Ids{kInner});
  const json cell = Do({"cell", "m", kInner});
  const std::string vertex = cell["vertices"][0]["vertex"], dart = cell["dart"];
  EXPECT_EQ(Cells({"incident", "m", vertex, "--dim", "3"}).size(), 8u);

  EXPECT_EQ(Do({"orbit", "m", kInner, "-i", "3"})["count"], 24);
  const json orbit = Do({"orbit", "m", dart, "-i", "0"});
  EXPECT_EQ(orbit["count"], 24);
  size_t darts = 0;
  for (const json& block : orbit["blocks"]) {
    EXPECT_GT(block["version"], 0);
    darts += block["darts"].size();
  }
  EXPECT_EQ(darts, 24u);
  EXPECT_EQ(Do({"orbit", "m", dart, "-i", "1"})["count"], 8);
  EXPECT_EQ(Do({"orbit", "m", "1:any", "-i", "3"})["blocks"][0]["block"], 1);
  EXPECT_THAT(cluster_->Call({"orbit", "m", dart, "-i", "2"}).out, HasSubstr("8 darts\n"));
}

TEST_F(CellsTest, CsvHasARowForEachCell) {
  const auto lines = [](const std::string& text) { return std::count(text.begin(), text.end(), '\n'); };
  const std::string cells = cluster_->Call({"neighbors", "m", kInner, "-o", "csv"}).out;
  EXPECT_THAT(
      cells,
      StartsWith("cell,dimension,level,state,dart,version,darts,blocks,boundary,vertices,x,y,z\nh14,3,"));
  EXPECT_EQ(lines(cells), 7);
  EXPECT_EQ(lines(cluster_->Call({"cell", "m", kInner, "-o", "csv"}).out), 2);
  EXPECT_EQ(lines(cluster_->Call({"orbit", "m", kInner, "-i", "3", "-o", "csv"}).out), 25);
  EXPECT_THAT(cluster_->Call({"locate", "m", "-100,0,0", "-o", "csv"}).out, StartsWith("point,cell,"));
  EXPECT_EQ(cluster_->Call({"ring", "m", "h0", "1", "--ids", "-o", "csv"}).out, "cell\nh1\nh6\nh36\n");
  EXPECT_THAT(cluster_->Call({"ring", "m", "h0", "1"}).out, HasSubstr("\n3 hexahedra\n"));
}

TEST_F(CellsTest, NeighboursOfRefinedHexahedra) {
  cluster_->Create("refined");
  Do({"refine", "refined", "--depth", "1", "--oracle", "list", "--cells", kInner});
  EXPECT_THAT(cluster_->Fails({"cell", "refined", kInner}), HasSubstr("the map has no cell h50"));
  // The four children at the common face, and five others.
  const Ids beside = Cells({"neighbors", "refined", "h49"});
  EXPECT_EQ(beside.size(), 9u);
  EXPECT_EQ(beside.count("h50/2"), 1u);
  EXPECT_EQ(Do({"cell", "refined", "h50/2"})["level"], 1);
  Do({"delete", "refined"});
}

TEST_F(CellsTest, ErrorsOfTheServiceAreOneLine) {
  EXPECT_THAT(cluster_->Fails({"cell", "none", "h1"}), HasSubstr("none"));
  EXPECT_THAT(cluster_->Fails({"cell", "m", "h4000"}), HasSubstr("h4000"));
  EXPECT_THAT(cluster_->Fails({"orbit", "m", "7:0", "-i", "0"}), HasSubstr("no block 7"));
  EXPECT_THAT(cluster_->Fails({"orbit", "m", "0:4000000000", "-i", "0"}), HasSubstr("4000000000"));
}

}  // namespace
}  // namespace ndmap::testing

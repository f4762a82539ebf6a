// SPDX-License-Identifier: GPL-3.0-or-later
// Texts of the commands about cells.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/cli/cell_arguments.h"
#include "client/cli/cell_report.h"
#include "client/cli/completion.h"

namespace ndmap::cli {
namespace {

using ::testing::HasSubstr;

TEST(CellArguments, Points) {
  EXPECT_EQ(ParsePoint("1,2.5,-3e2").value(), (Point{1, 2.5, -300}));
  for (const char* text :
       {"", "1,2", "1,2,3,4", "1,2,nan", "inf,0,0", "1,2,1e999", "1,2,x", "1,,2", "1 2 3"}) {
    EXPECT_EQ(ParsePoint(text).status().code(), absl::StatusCode::kInvalidArgument) << text;
  }
}

TEST(CellArguments, DimensionsOfIds) {
  EXPECT_EQ(DimensionOf("v12/0.3:5").value(), 0u);
  EXPECT_EQ(DimensionOf("e0:11").value(), 1u);
  EXPECT_EQ(DimensionOf("f0/7:2").value(), 2u);
  EXPECT_EQ(DimensionOf("h3").value(), 3u);
  for (const char* text : {"", "h", "h-1", "h1/8", "x3", "v1", "h99999999999999999999"})
    EXPECT_FALSE(DimensionOf(text).ok()) << text;
}

v1::CellDetails Edge() {
  v1::CellDetails cell;
  cell.set_text("e0:4");
  cell.set_dimension(1);
  cell.mutable_dart()->set_block(2);
  cell.mutable_dart()->set_dart(17);
  cell.mutable_dart()->set_version(9);
  cell.add_blocks(1);
  cell.add_blocks(2);
  cell.set_darts(8);
  cell.set_boundary(true);
  cell.add_points()->set_x(0.1);
  cell.add_points()->set_x(0.2);
  return cell;
}

TEST(CellReport, RowsOfCells) {
  CellRows csv(true, 1);
  csv.Add(Edge());
  EXPECT_EQ(csv.Text(),
            "cell,dimension,level,state,dart,version,darts,blocks,boundary,vertices,x,y,z\n"
            "e0:4,1,0,,2:17,9,8,1 2,yes,,0.15000000000000002,0.0,0.0\n");
  CellRows table(false, 1);
  EXPECT_EQ(table.Text(), "0 edges\n");
  table.Add(Edge());
  EXPECT_THAT(table.Text(), HasSubstr("e0:4      0  2:17      8     1 2       yes  0.15  0  0\n1 edge\n"));
}

TEST(CellReport, TheStateIsOfHexahedraOnly) {
  EXPECT_TRUE(CellAsJson(Edge())["state"].is_null());
  v1::CellDetails cell = Edge();
  cell.set_state("cut");
  EXPECT_EQ(CellAsJson(cell)["state"], "cut");
}

TEST(CellReport, CsvQuotesWhatHoldsCommas) {
  EXPECT_EQ(CsvText({{"point", "cell"}, {"1,2,3", "a\"b"}}), "point,cell\n\"1,2,3\",\"a\"\"b\"\n");
}

TEST(Completion, OptionsWithValuesAreNotCommands) {
  CLI::App app("", "prog");
  std::string text;
  app.add_option("--where", text);
  CLI::App* command = app.add_subcommand("go", "it's [a] command: go");
  command->add_flag("-f,--fast");
  const std::string bash = BashCompletion(app);
  EXPECT_THAT(bash, HasSubstr("--where) ((++i))"));
  EXPECT_THAT(bash, HasSubstr("go) words='-h --help -f --fast"));
  EXPECT_THAT(ZshCompletion(app), HasSubstr("'go:it'\\''s \\[a\\] command\\: go'"));
}

}  // namespace
}  // namespace ndmap::cli

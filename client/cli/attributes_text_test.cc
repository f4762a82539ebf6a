// SPDX-License-Identifier: GPL-3.0-or-later
// Values as text, CSV in.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "client/cli/attribute_text.h"
#include "client/cli/cell_choice.h"
#include "client/cli/cell_report.h"
#include "client/cli/csv_reader.h"

namespace ndmap::cli {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(AttributeTextTest, NamesOfTypesAndRulesThereAndBack) {
  for (const std::string& name : ValueTypeNames()) EXPECT_EQ(NameOf(ValueTypeOf(name)), name);
  for (const std::string& name : SplitRuleNames()) EXPECT_EQ(NameOf(SplitRuleOf(name)), name);
  EXPECT_EQ(NameOf(v1::SPLIT_RULE_UNSPECIFIED), "copy");
}

TEST(AttributeTextTest, ValuesThereAndBack) {
  const auto back = [](v1::ValueType type, const char* text) {
    const absl::StatusOr<AttributeColumn> column = OneValue(type, text);
    return column.ok() ? ValueText(*column, 0) : std::string(column.status().message());
  };
  for (const char* text : {"0.1", "nan", "-inf", "1e+300", "-0.0"})
    EXPECT_EQ(back(v1::VALUE_TYPE_DOUBLE, text), text);
  EXPECT_EQ(back(v1::VALUE_TYPE_INT64, "-9223372036854775808"), "-9223372036854775808");
  EXPECT_EQ(back(v1::VALUE_TYPE_VEC3, "1.5,-2.0,inf"), "1.5,-2.0,inf");
  EXPECT_EQ(back(v1::VALUE_TYPE_CATEGORY, "a, \"b\""), "a, \"b\"");
  EXPECT_EQ(back(v1::VALUE_TYPE_CATEGORY, ""), "");
  EXPECT_EQ(back(v1::VALUE_TYPE_DOUBLE, "x"), "'x' is no value, expected a number");
  EXPECT_THAT(back(v1::VALUE_TYPE_INT64, "1.5"), HasSubstr("a whole number of 64 bits"));
  EXPECT_THAT(back(v1::VALUE_TYPE_INT64, "9223372036854775808"), HasSubstr("a whole number of 64 bits"));
  EXPECT_THAT(back(v1::VALUE_TYPE_VEC3, "1,2"), HasSubstr("three numbers"));
  EXPECT_THAT(back(v1::VALUE_TYPE_CATEGORY, std::string(65, 'x').c_str()), HasSubstr("at most 64 bytes"));
}

TEST(AttributeTextTest, TextsThatAreThereAlreadyHaveTheirCode) {
  ColumnBuilder builder(v1::VALUE_TYPE_CATEGORY);
  for (const char* text : {"b", "a", "b"}) ASSERT_TRUE(builder.Add(text).ok());
  const AttributeColumn column = builder.Take();
  EXPECT_THAT(column.codes, ElementsAre(0, 1, 0));
  EXPECT_THAT(column.categories, ElementsAre("b", "a"));
}

TEST(AttributeTextTest, MissingCellsAreNamed) {
  EXPECT_EQ(MissingError("m", 1, {"h7"}).message(), "map 'm' lacks 1 of the cells: h7");
  EXPECT_EQ(MissingError("m", 1234, {"h7", "h8"}).message(),
            "map 'm' lacks 1,234 of the cells: h7, h8 and others");
}

TEST(CellChoiceTest, Levels) {
  EXPECT_THAT(*ParseLevels("2"), ::testing::Pair(2, 2));
  EXPECT_THAT(*ParseLevels("0-29"), ::testing::Pair(0, 29));
  for (const char* text : {"", "-1", "3-2", "30", "1-", "x"})
    EXPECT_EQ(ParseLevels(text).status().code(), absl::StatusCode::kInvalidArgument) << text;
}

TEST(CellChoiceTest, IdsMustBeOfTheDimension) {
  CellChoice choice;
  choice.ids = {"h1", "v1:2"};
  EXPECT_EQ(SelectionOf(choice, 3).status().message(), "v1:2 is of dimension 0, the values are of hexahedra");
  choice.ids = {"h1", "h2/3"};
  EXPECT_EQ(SelectionOf(choice, 3)->ids().hi_size(), 2);
}

class CsvReaderTest : public ::testing::Test {
 protected:
  ~CsvReaderTest() override {
    if (file_ != nullptr) std::fclose(file_);
  }
  CsvReader Reader(const std::string& text) {
    file_ = std::tmpfile();
    std::fwrite(text.data(), 1, text.size(), file_);
    std::rewind(file_);
    return CsvReader(file_, "a.csv");
  }
  std::FILE* file_ = nullptr;
};

TEST_F(CsvReaderTest, ReadsWhatIsWritten) {
  const std::vector<std::vector<std::string>> rows = {
      {"id", "text"}, {"h1", "a,b"}, {"h2", "say \"x\"\nand go"}, {"", ""}, {"h3", ""}};
  CsvReader reader = Reader(CsvText(rows));
  std::vector<std::string> row;
  for (const auto& expected : rows) {
    ASSERT_TRUE(reader.Next(&row).value());
    EXPECT_EQ(row, expected);
  }
  EXPECT_FALSE(reader.Next(&row).value());
}

TEST_F(CsvReaderTest, OtherProgramsLineEndsAndEmptyLines) {
  CsvReader reader = Reader("id,x\r\n\n\"h1\",2\r\n\r\nh2,3");
  std::vector<std::string> row;
  ASSERT_TRUE(reader.Next(&row).value());
  EXPECT_THAT(row, ElementsAre("id", "x"));
  ASSERT_TRUE(reader.Next(&row).value());
  EXPECT_THAT(row, ElementsAre("h1", "2"));
  EXPECT_EQ(reader.Wrong("so").message(), "a.csv, line 3: so");
  ASSERT_TRUE(reader.Next(&row).value());
  EXPECT_THAT(row, ElementsAre("h2", "3"));
  EXPECT_FALSE(reader.Next(&row).value());
}

TEST_F(CsvReaderTest, QuotesMustEnd) {
  CsvReader reader = Reader("id,\"x\n\n");
  std::vector<std::string> row;
  EXPECT_EQ(reader.Next(&row).status().message(), "a.csv, line 1: the quotes do not end");
}

}  // namespace
}  // namespace ndmap::cli

// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/cli/progress.h"
#include "client/cli/table.h"

namespace ndmap::cli {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(ParseBytes, UnitsAreBinaryOrDecimal) {
  EXPECT_EQ(ParseBytes("4096").value(), 4096u);
  EXPECT_EQ(ParseBytes("256MiB").value(), 256u << 20);
  EXPECT_EQ(ParseBytes("1 GiB").value(), 1u << 30);
  EXPECT_EQ(ParseBytes("1.5kB").value(), 1500u);
  EXPECT_EQ(ParseBytes("0.5KiB").value(), 512u);
}

TEST(ParseBytes, RefusesWhatIsNoSizeAndNamesIt) {
  for (const char* text : {"", "0", "-1", "1XB", "GiB", "1GiBs", "1.2.3", "1e30", "nan", "99999999999TiB"}) {
    const auto bytes = ParseBytes(text);
    EXPECT_FALSE(bytes.ok()) << text;
    EXPECT_THAT(bytes.status().message(), HasSubstr(text));
  }
}

TEST(ParseGridCells, ThreeNumbers) {
  EXPECT_THAT(ParseGridCells("10x11x9").value(), ElementsAre(10, 11, 9));
  for (const char* text : {"", "3x3", "1x2x3x4", "0x1x1", "-1x1x1", "axbxc", "1x1x99999999999"}) {
    EXPECT_FALSE(ParseGridCells(text).ok()) << text;
  }
}

TEST(ParseWord, LettersWithOrWithoutCommas) {
  EXPECT_THAT(ParseWord("1,2,3").value(), ElementsAre(1, 2, 3));
  EXPECT_THAT(ParseWord("0123").value(), ElementsAre(0, 1, 2, 3));
  for (const char* text : {"", "4", "1,,2", ",1", "1,", "1;2"}) EXPECT_FALSE(ParseWord(text).ok()) << text;
}

TEST(ParseDart, BlockAndIndex) {
  EXPECT_EQ(ParseDart("3:12")->block, 3u);
  EXPECT_EQ(ParseDart("3:12")->dart, 12u);
  EXPECT_TRUE(ParseDart("0:any")->any);
  for (const char* text : {"", "3", "3:", ":3", "a:b", "-1:2", "1:2:3"})
    EXPECT_FALSE(ParseDart(text).ok()) << text;
}

TEST(Format, NumbersForPeople) {
  EXPECT_EQ(FormatCount(0), "0");
  EXPECT_EQ(FormatCount(999), "999");
  EXPECT_EQ(FormatCount(1000), "1,000");
  EXPECT_EQ(FormatCount(-1234567), "-1,234,567");
  EXPECT_EQ(FormatBytes(512), "512 B");
  EXPECT_EQ(FormatBytes(3u << 20), "3.0 MiB");
  EXPECT_EQ(FormatSeconds(0.421), "0.42 s");
  EXPECT_EQ(FormatSeconds(123), "2 min 3 s");
  EXPECT_EQ(FormatSeconds(7300), "2 h 1 min");
}

TEST(Table, AlignsAndRulesOffTheTotal) {
  Table table({"<name", "count"});
  table.Add({"a", "1"});
  table.Add({"all", "1,000"});
  EXPECT_EQ(table.Text(true),
            "name  count\n"
            "-----------\n"
            "a         1\n"
            "-----------\n"
            "all   1,000\n");
}

TEST(Bar, FillsWithTheFraction) {
  EXPECT_EQ(Bar(0, 6), "[....]");
  EXPECT_EQ(Bar(0.5, 6), "[##..]");
  EXPECT_EQ(Bar(7, 6), "[####]");
}

// What a Progress writes to a file.
std::string Written(bool terminal, bool quiet) {
  std::FILE* file = std::tmpfile();
  Progress progress(file, terminal, quiet);
  progress.Begin("refine");
  progress.Update(0.5, "half");
  progress.Note("note: hello");
  progress.End("done", 1.5);
  std::rewind(file);
  std::string text(1000, '\0');
  text.resize(std::fread(text.data(), 1, text.size(), file));
  std::fclose(file);
  return text;
}

TEST(Progress, OneLineAStepWithoutATerminal) {
  EXPECT_EQ(Written(false, false), "note: hello\nrefine             1.50 s  done\n");
}

TEST(Progress, QuietSaysOnlyNotes) { EXPECT_EQ(Written(false, true), "note: hello\n"); }

TEST(Progress, ATerminalIsRedrawn) {
  const std::string text = Written(true, false);
  EXPECT_THAT(text, HasSubstr("\r"));
  EXPECT_THAT(text, HasSubstr("half"));
  EXPECT_THAT(text, ::testing::EndsWith("refine             1.50 s  done\n"));
}

}  // namespace
}  // namespace ndmap::cli

// SPDX-License-Identifier: GPL-3.0-or-later
// Completion scripts, read by the shells that they are for.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>

#include "tests/cli/command.h"
#include "tests/cli/map_cluster.h"

namespace ndmap::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

class CompletionTest : public ::testing::Test {
 protected:
  std::string Script(const std::string& shell) {
    const Outcome outcome = Ndmap({"completion", shell});
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    const std::string path = folder_ / shell;
    std::ofstream(path) << outcome.out;
    return path;
  }
  // What a shell command prints.
  static std::string Shell(const std::string& command) {
    std::FILE* pipe = popen(command.c_str(), "r");
    std::string text;
    for (int c = 0; (c = std::fgetc(pipe)) != EOF;) text.push_back(static_cast<char>(c));
    EXPECT_EQ(pclose(pipe), 0) << command;
    return text;
  }
  // What bash proposes after these words.
  std::string Proposed(const std::string& words, int last) {
    return Shell("bash -c '. " + Script("bash") + "; COMP_WORDS=(" + words +
                 "); COMP_CWORD=" + std::to_string(last) + "; _ndmap; echo \" ${COMPREPLY[*]} \"'");
  }

  TemporaryFolder folder_;
};

TEST_F(CompletionTest, BashReadsIts) {
  EXPECT_EQ(Shell("bash -n " + Script("bash") + " 2>&1"), "");
  EXPECT_EQ(Proposed("ndmap nei", 1), " neighbors \n");
  EXPECT_THAT(Proposed("ndmap r", 1), HasSubstr(" run "));
  EXPECT_THAT(Proposed("ndmap r", 1), HasSubstr(" ring "));
  EXPECT_EQ(Proposed("ndmap --coordinator there ring m h1 1 --thr", 7), " --through \n");
  EXPECT_THAT(Proposed("ndmap refine --", 2), HasSubstr(" --oracle "));
  EXPECT_THAT(Proposed("ndmap refine --", 2), HasSubstr(" --json "));
  EXPECT_THAT(Proposed("ndmap refine --", 2), Not(HasSubstr(" --through ")));
  EXPECT_EQ(Proposed("ndmap run tor", 2), "  \n");
  // Commands below a command.
  EXPECT_EQ(Proposed("ndmap attr wr", 2), " write \n");
  EXPECT_EQ(Proposed("ndmap attr --json dro", 3), " drop \n");
  EXPECT_EQ(Proposed("ndmap attr read m t --le", 5), " --level \n");
  EXPECT_THAT(Proposed("ndmap attr define --", 3), Not(HasSubstr(" --level ")));
  EXPECT_EQ(Proposed("ndmap attr read dro", 3), "  \n");
  EXPECT_EQ(Proposed("ndmap agg m --hist", 3), " --histogram \n");
}

// Where a map is to be named, those of the cluster are proposed.
TEST_F(CompletionTest, BashAsksTheClusterForItsMaps) {
  const MapCluster cluster;
  cluster.Create("mountain");
  cluster.Create("torus");
  const std::string program = NDMAP_PROGRAM;
  const std::string at = " --coordinator " + cluster.coordinator();
  EXPECT_EQ(Proposed(program + at + " hash m", 4), " m mountain \n");
  EXPECT_EQ(Proposed(program + at + " attr read mo", 5), " mountain \n");
  EXPECT_EQ(Proposed(program + " agg" + at + " --json t", 5), " torus \n");
  // As bash cuts it.
  const size_t colon = cluster.coordinator().find(':');
  const std::string cut =
      cluster.coordinator().substr(0, colon) + " : " + cluster.coordinator().substr(colon + 1);
  EXPECT_EQ(Proposed(program + " --coordinator " + cut + " cell t", 6), " torus \n");
  EXPECT_EQ(Proposed(program + " cell --coordinator " + cut + " t", 6), " torus \n");
  // The map was named; it is no map that is wanted; nobody answers.
  EXPECT_EQ(Proposed(program + at + " cell m t", 5), "  \n");
  EXPECT_EQ(Proposed(program + at + " create t", 4), "  \n");
  EXPECT_EQ(Proposed(program + at + " run t", 4), "  \n");
  EXPECT_EQ(Proposed(program + " --coordinator 127.0.0.1:1 hash t", 4), "  \n");
  const Outcome names = cluster.Call({"maps", "--names"});
  EXPECT_EQ(names.out, "m\nmountain\ntorus\n");
}

TEST_F(CompletionTest, ZshReadsIts) {
  const std::string script = Script("zsh");
  EXPECT_THAT(Shell("cat " + script), HasSubstr("'ring:the cells at most K steps away from a cell'"));
  EXPECT_THAT(Shell("cat " + script), HasSubstr("'1:map:_ndmap_maps'"));
  EXPECT_THAT(Shell("cat " + script), HasSubstr("'drop:forget an attribute and its values'"));
  // Its quotes and brackets are of the kind that bash reads, too, where there is no zsh.
  EXPECT_EQ(Shell("bash -n " + script + " 2>&1"), "");
  EXPECT_EQ(Shell("if command -v zsh >/dev/null; then zsh -n " + script + " 2>&1; fi"), "");
}

}  // namespace
}  // namespace ndmap::testing

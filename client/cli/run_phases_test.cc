// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/run_phases.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "client/cli/report.h"

namespace ndmap::cli {
namespace {

using testing::ElementsAre;

std::vector<std::string> Names(const std::vector<v1::Phase>& phases) {
  std::vector<std::string> names;
  for (const v1::Phase& phase : phases) {
    names.push_back(phase.algorithm());
    for (const char* parameter : {"level", "children", "keep"}) {
      const auto it = phase.parameters().find(parameter);
      if (it != phase.parameters().end()) absl::StrAppend(&names.back(), " ", it->second);
    }
  }
  return names;
}

TEST(RunPhases, WhatIsKeptToTheEndOrMadeInOnePhaseIsNotErasedEarly) {
  EXPECT_TRUE(ErasesEarly(false, 2, "inside,cut"));
  EXPECT_TRUE(ErasesEarly(false, 5, "inside"));
  EXPECT_FALSE(ErasesEarly(true, 5, "inside,cut"));
  EXPECT_FALSE(ErasesEarly(false, 5, "all"));
  EXPECT_FALSE(ErasesEarly(false, 1, "inside,cut"));
}

TEST(RunPhases, HexahedraOnTheSurfaceStayWhileTheyAreToBeRefined) {
  EXPECT_THAT(Names(ErasingPhases(3, "inside", 1, {})),
              ElementsAre("classify", "trim inside,cut", "refine 2", "classify", "trim inside"));
  EXPECT_THAT(Names(ErasingPhases(2, "cut", 1, {})),
              ElementsAre("classify", "trim cut", "refine 1", "classify", "trim cut"));
}

TEST(RunPhases, APartHasEveryPartsThChild) {
  EXPECT_THAT(
      Names(ErasingPhases(2, "inside", 3, {})),
      ElementsAre("classify", "trim inside,cut", "refine 1 036", "classify", "trim inside,cut",
                  "refine 1 147", "classify", "trim inside,cut", "refine 1 25", "classify", "trim inside"));
  EXPECT_EQ(ErasingPhases(4, "cut", kMostParts, {{"oracle", "surface"}}).size(), 2 + 3 * kMostParts);
  EXPECT_EQ(PartsFor(1e4), 0u);
  EXPECT_EQ(PartsFor(1e7), kMostParts);
}

// What classify and trim report of 100 cells made in two steps, 60 of them on the surface.
TEST(RunReport, WhatWasErasedOnTheWayCounts) {
  RunReport report;
  const auto add = [&](const char* algorithm, const char* keep,
                       std::vector<std::pair<const char*, int64_t>> counts) {
    v1::PhaseResult result;
    result.mutable_phase()->set_algorithm(algorithm);
    if (*keep != '\0') (*result.mutable_phase()->mutable_parameters())["keep"] = keep;
    for (const auto& [name, count] : counts) (*result.mutable_report()->mutable_counts())[name] = count;
    report.phases.push_back(result);
  };
  add("classify", "", {{"cut", 10}, {"inside", 5}, {"outside", 15}});
  add("trim", "cut", {{"removed", 20}, {"hexahedra", 10}});
  add("classify", "", {{"cut", 60}, {"inside", 8}, {"outside", 12}});
  EXPECT_EQ(report.InState("cut"), 60);
  add("trim", "inside", {{"removed", 72}, {"hexahedra", 8}});
  EXPECT_EQ(report.removed(), 92);
  EXPECT_EQ(report.made(), 100);
  EXPECT_EQ(report.InState("cut"), 60);
  EXPECT_EQ(report.InState("inside"), 13);
  EXPECT_EQ(report.InState("outside"), 27);
}

}  // namespace
}  // namespace ndmap::cli

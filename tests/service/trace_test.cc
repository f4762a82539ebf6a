// SPDX-License-Identifier: GPL-3.0-or-later
// Walks that a program asks for step by step while blocks change under them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "client/sdk/client.h"
#include "tests/service/cluster.h"

namespace ndmap {
namespace {

using ::testing::HasSubstr;

// Words that lead out through each face of a hexahedron that a dart's strip of four reaches, and back.
const std::vector<std::vector<uint8_t>> kThereAndBack = {
    {3, 3}, {2, 3, 3, 2}, {1, 2, 3, 3, 2, 0}, {1, 1, 2, 3, 3, 2, 0, 0}};

v1::BetaStart AnyDart() {
  v1::BetaStart start;
  start.set_any_dart(true);
  return start;
}

class TraceTest : public ::testing::TestWithParam<v1::Routing> {
 protected:
  TraceTest() : cluster_(2) {
    v1::CreateMapRequest request = Cluster::GridRequest("m", 4);
    request.set_routing(GetParam());
    EXPECT_EQ(cluster_.Create(request).state(), v1::JOB_STATE_DONE);
    client_ = std::make_unique<Client>(Client::Connect(cluster_.coordinator().address()).value());
    map_ = std::make_unique<MapHandle>(client_->OpenMap("m").value());
  }
  // All words from a dart of each block lead back to it, or end at the boundary; how many crossed.
  int WalkEverywhere() {
    int crossed = 0;
    for (uint32_t block = 0; block < 4; ++block) {
      for (const std::vector<uint8_t>& word : kThereAndBack) {
        const absl::StatusOr<Traced> traced = map_->Trace(block, AnyDart(), word);
        if (!traced.ok()) {
          ADD_FAILURE() << traced.status();
          continue;
        }
        if (traced->free) {
          EXPECT_LT(traced->steps.size(), word.size());
          continue;
        }
        EXPECT_EQ(traced->steps.size(), word.size());
        const v1::DartRef& first = traced->start.dart();
        const v1::DartRef& last = traced->steps.back().at.dart();
        EXPECT_EQ(first.block(), block);
        EXPECT_EQ(last.block(), block);
        EXPECT_EQ(last.dart(), first.dart());
        uint32_t at = block;
        uint64_t version = first.version();
        for (const Traced::Step& step : traced->steps) {
          EXPECT_EQ(step.crossed_block, step.at.dart().block() != at);
          if (!step.crossed_block) {
            EXPECT_EQ(step.at.dart().version(), version);
          }
          version = step.at.dart().version();
          at = step.at.dart().block();
          crossed += step.crossed_block ? 1 : 0;
        }
      }
    }
    return crossed;
  }

  Cluster cluster_;
  std::unique_ptr<Client> client_;
  std::unique_ptr<MapHandle> map_;
};

TEST_P(TraceTest, TellsEveryDartOnTheWayAsTheWalkInOneStepEnds) {
  EXPECT_GT(WalkEverywhere(), 0);
  const absl::StatusOr<v1::DartInfo> first = map_->AnyDart(0);
  ASSERT_TRUE(first.ok()) << first.status();
  const std::vector<uint8_t> word = {1, 2, 1, 1, 2, 3, 2, 1, 3, 1};
  v1::BetaStart start;
  *start.mutable_dart() = first->dart();
  const absl::StatusOr<Traced> traced = map_->Trace(0, start, word);
  ASSERT_TRUE(traced.ok()) << traced.status();
  EXPECT_EQ(traced->start.dart().dart(), first->dart().dart());
  for (size_t letters = 1; letters <= traced->steps.size(); ++letters) {
    const auto walked = map_->Beta({first->dart()}, absl::MakeSpan(word).first(letters));
    ASSERT_TRUE(walked.ok()) << walked.status();
    EXPECT_EQ((*walked)[0].at.DebugString(), traced->steps[letters - 1].at.DebugString());
  }
}

TEST_P(TraceTest, IsAnsweredWhileAJobChangesTheMap) {
  uint64_t job = 0;
  ASSERT_TRUE(cluster_.Start("m", {{"token", {{"endless", "1"}}}}, &job).ok());
  cluster_.AwaitWork(job);
  // What is asked step by step meets another version of the block sooner or later.
  absl::Status stale;
  while (stale.ok()) {
    const absl::StatusOr<v1::DartInfo> dart = map_->AnyDart(0);
    ASSERT_TRUE(dart.ok()) << dart.status();
    stale = map_->Beta({dart->dart()}, {1}).status();
  }
  EXPECT_THAT(std::string(stale.message()), HasSubstr("changed since"));
  for (int i = 0; i < 5; ++i) EXPECT_GT(WalkEverywhere(), 0);
  cluster_.Cancel(job);
  EXPECT_EQ(cluster_.Await(job).state(), v1::JOB_STATE_CANCELLED);
}

TEST_P(TraceTest, WordsThatAreTooLongAreRefused) {
  const absl::Status status = map_->Trace(0, AnyDart(), std::vector<uint8_t>(5000, 1)).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()), HasSubstr("5000 letters"));
  EXPECT_EQ(map_->Trace(0, AnyDart(), std::vector<uint8_t>{4}).status().code(),
            absl::StatusCode::kInvalidArgument);
}

INSTANTIATE_TEST_SUITE_P(Routings, TraceTest, ::testing::Values(v1::ROUTING_DIRECT, v1::ROUTING_BROADCAST),
                         [](const auto& info) {
                           return info.param == v1::ROUTING_DIRECT ? "Direct" : "Broadcast";
                         });

}  // namespace
}  // namespace ndmap

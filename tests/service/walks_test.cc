// SPDX-License-Identifier: GPL-3.0-or-later
// Many walks at once, in columns, against walks one by one.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "client/sdk/client.h"
#include "client/sdk/explore.h"
#include "tests/service/cluster.h"

namespace ndmap {
namespace {

using ::testing::Each;
using ::testing::HasSubstr;

constexpr uint64_t kMostStarts = 5000;

const std::vector<std::vector<uint8_t>> kWords = {{},
                                                  {0},
                                                  {1},
                                                  {2},
                                                  {3},
                                                  {3, 3},
                                                  {2, 3, 2, 1, 1, 2, 3, 2, 0, 2, 3, 1},
                                                  {1, 2, 3, 2, 1, 2, 3, 2, 1, 2, 3, 2}};

class WalksTest : public ::testing::TestWithParam<v1::Routing> {
 protected:
  WalksTest()
      : cluster_(3, {}, {}, Limits()), client_(Client::Connect(cluster_.coordinator().address()).value()) {}

  static server::ServiceOptions Limits() {
    server::ServiceOptions options;
    options.max_query_darts = kMostStarts;
    return options;
  }
  MapHandle Make(uint32_t blocks, int depth) {
    v1::CreateMapRequest request = Cluster::GridRequest("m", blocks, 3);
    request.set_routing(GetParam());
    EXPECT_EQ(cluster_.Create(request).state(), v1::JOB_STATE_DONE);
    if (depth > 0) Refine(depth);
    return client_.OpenMap("m").value();
  }
  void Refine(int depth) {
    const v1::Job job = cluster_.Run("m", {{"refine",
                                            {{"oracle", "sphere"},
                                             {"centre", "0.3,0.2,0.1"},
                                             {"radius", "1"},
                                             {"depth", absl::StrCat(depth)}}}});
    ASSERT_EQ(job.state(), v1::JOB_STATE_DONE) << job.error();
  }
  // The darts of the vertices around a dart of each block, and whoever they are with: of many blocks, mixed.
  DartColumns SomeDarts(const MapHandle& map) {
    DartColumns darts;
    for (uint32_t block = 0; block < map.info().block_count(); ++block) {
      v1::ExploreRequest question = Orbit(DartAnchor(map.AnyDart(block)->dart()), 3);
      question.add_close(0);
      const absl::StatusOr<v1::ExploreResponse> orbit = map.Explore(question);
      EXPECT_TRUE(orbit.ok()) << orbit.status();
      for (int i = 0; i < orbit->darts_size(); i += 1 + static_cast<int>(block % 3)) {
        darts.blocks.push_back(orbit->dart_blocks(i));
        darts.darts.push_back(orbit->darts(i));
      }
    }
    return darts;
  }
  // The server's own answer to a request that the SDK would not send.
  grpc::Status Ask(const std::function<void(v1::WalkRequest&)>& spoil) {
    v1::WalkRequest request;
    request.set_map("m");
    *request.mutable_blocks() = std::string(8, '\0');
    *request.mutable_darts() = std::string("\1\0\0\0\2\0\0\0", 8);
    request.mutable_word()->push_back('\1');
    spoil(request);
    grpc::ClientContext context;
    v1::WalkResponse response;
    return cluster_.ServerOf("m", 0)->Walk(&context, request, &response);
  }

  Cluster cluster_;
  Client client_;
};

TEST_P(WalksTest, EndWhereWalksOneByOneEnd) {
  const MapHandle map = Make(7, 2);
  const DartColumns starts = SomeDarts(map);
  ASSERT_GT(starts.size(), 500u);
  std::vector<v1::DartRef> references(starts.size());
  for (size_t i = 0; i < starts.size(); ++i) {
    references[i].set_block(starts.blocks[i]);
    references[i].set_dart(starts.darts[i]);
  }
  uint32_t crossings = 0, free = 0;
  for (const std::vector<uint8_t>& word : kWords) {
    const absl::StatusOr<std::vector<Walked>> expected = map.Beta(references, word);
    ASSERT_TRUE(expected.ok()) << expected.status();
    const absl::StatusOr<WalkedColumns> walked = map.Walk(starts, word);
    ASSERT_TRUE(walked.ok()) << walked.status();
    ASSERT_EQ(walked->at.size(), starts.size());
    for (size_t i = 0; i < starts.size(); ++i) {
      const Walked& one = (*expected)[i];
      ASSERT_EQ(walked->at.blocks[i], one.at.dart().block()) << i;
      ASSERT_EQ(walked->at.darts[i], one.at.dart().dart()) << i;
      ASSERT_EQ(walked->used[i], one.used) << i;
      ASSERT_EQ(walked->used[i] < word.size(), one.free) << i;
      ASSERT_EQ(walked->at.versions.at(walked->at.blocks[i]), one.at.dart().version());
      crossings += one.block_crossings;
      free += one.free ? 1 : 0;
    }
  }
  EXPECT_GT(crossings, 100u);
  EXPECT_GT(free, 100u);
}

TEST_P(WalksTest, GoOnFromWhereOthersEnded) {
  const MapHandle map = Make(4, 1);
  DartColumns at = SomeDarts(map);
  const std::vector<uint8_t> word = {1, 2, 1, 1, 2, 0};
  const absl::StatusOr<WalkedColumns> whole = map.Walk(at, word);
  ASSERT_TRUE(whole.ok()) << whole.status();
  for (uint8_t letter : word) {
    absl::StatusOr<WalkedColumns> step = map.Walk(at, {letter});
    ASSERT_TRUE(step.ok()) << step.status();
    EXPECT_THAT(step->used, Each(1));
    at = std::move(step->at);
  }
  EXPECT_EQ(at.blocks, whole->at.blocks);
  EXPECT_EQ(at.darts, whole->at.darts);
  // Nothing to do is no error.
  EXPECT_EQ(map.Walk({}, word)->at.size(), 0u);
}

TEST_P(WalksTest, StaleAndUnknownDartsAreRefused) {
  const MapHandle map = Make(2, 0);
  DartColumns start{{1, 0}, {map.AnyDart(1)->dart().dart(), map.AnyDart(0)->dart().dart()}, {}};
  const absl::StatusOr<WalkedColumns> there = map.Walk(start, {1});
  ASSERT_TRUE(there.ok()) << there.status();
  Refine(1);
  const absl::Status stale = map.Walk(there->at, {0}).status();
  EXPECT_EQ(stale.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(stale.message()), HasSubstr("has changed since version"));
  EXPECT_TRUE(map.Walk(start, {1}).ok());
  start.darts[0] = 4000000000u;
  EXPECT_EQ(map.Walk(start, {1}).status().code(), absl::StatusCode::kNotFound);
  start.darts[0] = 0xffffffff;
  EXPECT_EQ(map.Walk(start, {}).status().code(), absl::StatusCode::kNotFound);
  start.blocks[0] = 2;
  EXPECT_EQ(map.Walk(start, {1}).status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(map.Walk({{0}, {1, 2}, {}}, {1}).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(map.Walk({{0}, {1}, {}}, {4}).status().code(), absl::StatusCode::kInvalidArgument);
}

TEST_P(WalksTest, WrongRequestsAreRefused) {
  Make(2, 0);
  using Code = grpc::StatusCode;
  EXPECT_EQ(Ask([](v1::WalkRequest&) {}).error_code(), Code::OK);
  EXPECT_EQ(Ask([](auto& r) { r.mutable_darts()->pop_back(); }).error_code(), Code::INVALID_ARGUMENT);
  EXPECT_EQ(Ask([](auto& r) { r.mutable_blocks()->resize(4); }).error_code(), Code::INVALID_ARGUMENT);
  EXPECT_EQ(Ask([](auto& r) { r.add_versions(1); }).error_code(), Code::INVALID_ARGUMENT);
  EXPECT_EQ(Ask([](auto& r) { r.set_map("other"); }).error_code(), Code::NOT_FOUND);
  EXPECT_EQ(Ask([](auto& r) { r.mutable_blocks()->assign(8, '\7'); }).error_code(), Code::NOT_FOUND);
  for (char letter : {'\4', '\x80', '\xff'}) {
    const grpc::Status status = Ask([&](auto& r) { r.set_word(std::string(1, letter)); });
    EXPECT_EQ(status.error_code(), Code::INVALID_ARGUMENT);
    EXPECT_THAT(status.error_message(), HasSubstr(absl::StrCat("beta ", int{uint8_t(letter)})));
  }
  const auto starts = [](size_t n) {
    return [n](v1::WalkRequest& r) {
      r.mutable_darts()->clear();
      for (size_t i = 0; i < n; ++i) r.mutable_darts()->append("\1\0\0\0", 4);
      r.set_blocks(std::string(4 * n, '\0'));
    };
  };
  EXPECT_EQ(Ask(starts(kMostStarts)).error_code(), Code::OK);
  const grpc::Status many = Ask(starts(kMostStarts + 1));
  EXPECT_EQ(many.error_code(), Code::RESOURCE_EXHAUSTED);
  EXPECT_THAT(many.error_message(), HasSubstr("--max-query-darts"));
  const auto letters = [](size_t n) { return [n](v1::WalkRequest& r) { r.set_word(std::string(n, '\1')); }; };
  EXPECT_EQ(Ask(letters(65536)).error_code(), Code::OK);
  EXPECT_EQ(Ask(letters(65537)).error_code(), Code::INVALID_ARGUMENT);
  const grpc::Status long_words = Ask([&](v1::WalkRequest& r) {
    starts(kMostStarts)(r);
    letters(65536)(r);
  });
  EXPECT_EQ(long_words.error_code(), Code::INVALID_ARGUMENT);
  EXPECT_THAT(long_words.error_message(), HasSubstr("16777216 for all starts"));
}

// A block that changes between two rounds makes the walks begin again, and gives up in the end; what is
// answered is right.
TEST_P(WalksTest, AreOfOneVersionOfEachBlockWhileAJobChangesTheMap) {
  const MapHandle map = Make(4, 0);
  const DartColumns starts = SomeDarts(map);
  uint64_t job = 0;
  ASSERT_TRUE(cluster_.Start("m", {{"token", {{"endless", "1"}}}}, &job).ok());
  cluster_.AwaitWork(job);
  int given_up = 0, answered = 0;
  while (given_up == 0 || answered == 0) {
    // Within a block one step is enough.
    const absl::StatusOr<WalkedColumns> near = map.Walk(starts, {1, 0});
    ASSERT_TRUE(near.ok()) << near.status();
    EXPECT_EQ(near->at.darts, starts.darts);
    ++answered;
    const absl::StatusOr<WalkedColumns> far = map.Walk(starts, {3, 3, 3, 3});
    if (!far.ok()) {
      ASSERT_EQ(far.status().code(), absl::StatusCode::kAborted) << far.status();
      ++given_up;
      continue;
    }
    EXPECT_EQ(far->at.darts, starts.darts);
    EXPECT_EQ(far->at.blocks, starts.blocks);
  }
  cluster_.Cancel(job);
  EXPECT_EQ(cluster_.Await(job).state(), v1::JOB_STATE_CANCELLED);
}

INSTANTIATE_TEST_SUITE_P(Routings, WalksTest, ::testing::Values(v1::ROUTING_DIRECT, v1::ROUTING_BROADCAST),
                         [](const auto& info) {
                           return info.param == v1::ROUTING_DIRECT ? "Direct" : "Broadcast";
                         });

}  // namespace
}  // namespace ndmap

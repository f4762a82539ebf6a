// SPDX-License-Identifier: GPL-3.0-or-later
// Cells of dimensions that have no attribute, through real services: counted, added up and read as if there
// were one, the same for any number of blocks and whichever server is asked.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/service/attribute_cluster.h"

namespace ndmap {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class NoAttributesTest : public ::testing::Test {
 protected:
  NoAttributesTest() : cluster_(3) {}

  // Also removed from, so that parts of the mesh touch in an edge or a vertex only.
  void Make(const std::string& map, uint32_t blocks) {
    ASSERT_EQ(cluster_.Create(Cluster::GridRequest(map, blocks)).state(), v1::JOB_STATE_DONE);
    ASSERT_EQ(
        cluster_.Run(map, {{"refine", {{"oracle", "list"}, {"cells", kRefined}, {"depth", "4"}}}}).state(),
        v1::JOB_STATE_DONE);
    ASSERT_EQ(cluster_.Run(map, {{"trim", {{"keep", "all"}, {"cells", "h1 h2 h3 h4 h0/7.1"}}}}).state(),
              v1::JOB_STATE_DONE);
  }
  static v1::AggregateRequest Question(const std::string& map, uint32_t dimension, const std::string& name,
                                       v1::GroupBy by) {
    v1::AggregateRequest question;
    question.set_map(map);
    question.set_dimension(dimension);
    question.set_name(name);
    question.set_group_by(by);
    return question;
  }
  // Everything that can be asked without an attribute.
  std::vector<v1::AggregateRequest> Questions(const std::string& map, uint32_t dimension) {
    std::vector<v1::AggregateRequest> all;
    std::vector<std::string> names = {"", "@point", "@level", "@block"};
    if (dimension == 3) names.insert(names.end(), {"@volume", "@state"});
    for (const std::string& name : names) {
      for (v1::GroupBy by : {v1::GROUP_BY_NOTHING, v1::GROUP_BY_LEVEL, v1::GROUP_BY_BLOCK}) {
        all.push_back(Question(map, dimension, name, by));
        if (name.empty() || name == "@state") continue;
        all.back().set_bins(5);
        all.back().set_histogram_hi(2);
        all.back().set_integral(name != "@block" && dimension % 3 == 0);
      }
      all.push_back(Question(map, dimension, name, v1::GROUP_BY_LEVEL));
      all.back().set_by_level(true);
      all.back().set_lowest_level(1);
      all.back().set_highest_level(2);
    }
    if (dimension == 3) {
      all.push_back(Question(map, 3, "@volume", v1::GROUP_BY_CATEGORY));
      all.back().set_category("@state");
    }
    return all;
  }
  static std::vector<std::string> Names(uint32_t dimension) {
    std::vector<std::string> names = {"@point", "@level", "@block", "@point"};
    if (dimension == 3) names.insert(names.end(), {"@volume", "@state"});
    return names;
  }

  AttributeCluster cluster_;
};

// To define an attribute gives cells rows; nothing else may change.
TEST_F(NoAttributesTest, AnswersAreThoseThatAnAttributeWouldGive) {
  for (uint32_t blocks : {1u, 8u}) {
    const std::string map = absl::StrCat("m", blocks);
    Make(map, blocks);
    for (uint32_t i = 0; i < 4; ++i) {
      SCOPED_TRACE(absl::StrCat(blocks, " blocks, dimension ", i));
      std::vector<std::string> without;
      for (const v1::AggregateRequest& question : Questions(map, i)) {
        without.push_back(cluster_.MustAggregate(question).DebugString());
        EXPECT_EQ(cluster_.MustAggregate(question, blocks / 2).DebugString(), without.back());
      }
      v1::ReadAttributesRequest all = AttributeCluster::All(map, i, Names(i));
      const Table table = cluster_.ReadTable(all);
      EXPECT_EQ(cluster_.ReadTable(all, blocks - 1), table);
      v1::ReadAttributesRequest fine = all;
      fine.mutable_select()->set_by_level(true);
      fine.mutable_select()->set_lowest_level(2);
      fine.mutable_select()->set_highest_level(3);
      const Table of_levels = cluster_.ReadTable(fine);
      EXPECT_LT(of_levels.size(), table.size());
      ASSERT_EQ(
          cluster_.Define(map, AttributeCluster::Attribute(absl::StrCat("a", i), i, v1::VALUE_TYPE_INT64))
              .state(),
          v1::JOB_STATE_DONE);
      std::vector<std::string> with;
      for (const v1::AggregateRequest& question : Questions(map, i))
        with.push_back(cluster_.MustAggregate(question).DebugString());
      EXPECT_EQ(without, with);
      EXPECT_EQ(cluster_.ReadTable(all), table);
      EXPECT_EQ(cluster_.ReadTable(fine), of_levels);
    }
  }
}

TEST_F(NoAttributesTest, CountsAreThoseOfTheMeshForAnyNumberOfBlocks) {
  const auto count = [&](const std::string& map, uint32_t dimension) {
    return cluster_.MustAggregate(Question(map, dimension, "", v1::GROUP_BY_NOTHING)).groups(0).count();
  };
  for (uint32_t blocks : {1u, 2u, 8u}) {
    const std::string map = absl::StrCat("m", blocks);
    ASSERT_EQ(cluster_.Create(Cluster::GridRequest(map, blocks)).state(), v1::JOB_STATE_DONE);
    EXPECT_THAT((std::vector<uint64_t>{count(map, 0), count(map, 1), count(map, 2), count(map, 3)}),
                ElementsAre(27u, 54u, 36u, 8u));
    ASSERT_EQ(cluster_.Run(map, {{"refine", {{"oracle", "everything"}, {"depth", "2"}}}}).state(),
              v1::JOB_STATE_DONE);
    EXPECT_THAT((std::vector<uint64_t>{count(map, 0), count(map, 1), count(map, 2), count(map, 3)}),
                ElementsAre(729u, 1944u, 1728u, 512u));
  }
}

TEST_F(NoAttributesTest, IdsAndQueriesInTheOrderAsked) {
  Make("m", 8);
  const auto id = [](const char* text) { return CellId::Parse(text).value(); };
  for (uint32_t i = 0; i < 4; ++i) {
    const Table all = cluster_.ReadTable(AttributeCluster::All("m", i, Names(i)));
    std::vector<CellId> asked = IdsOf(all);
    std::shuffle(asked.begin(), asked.end(), std::mt19937(1));
    // Split, of another dimension, never there, and another name of v0:0.
    asked.insert(asked.begin() + 3, {id("h0"), id("e77:1"), id("v0/0:0")});
    v1::ReadAttributesRequest request = AttributeCluster::All("m", i, Names(i));
    AttributeCluster::AddIds(asked, request.mutable_select()->mutable_ids());
    for (uint32_t block : {0u, 1u, 5u}) {
      std::vector<std::pair<CellId, std::vector<std::string>>> rows;
      const grpc::Status status = cluster_.Read(request, block, &rows);
      ASSERT_TRUE(status.ok()) << status.error_message();
      ASSERT_EQ(rows.size(), asked.size());
      for (size_t k = 0; k < rows.size(); ++k) {
        ASSERT_EQ(rows[k].first, asked[k]);
        const auto there = all.find(asked[k]);
        EXPECT_EQ(rows[k].second, there == all.end() ? std::vector<std::string>() : there->second)
            << asked[k].ToString();
      }
    }
    request.mutable_select()->mutable_query()->add_anchors()->set_text("h7");
    request.mutable_select()->mutable_query()->add_close(3);
    std::vector<std::pair<CellId, std::vector<std::string>>> rows;
    ASSERT_TRUE(cluster_.Read(request, 2, &rows).ok());
    ASSERT_GE(rows.size(), i == 3 ? 1u : 6u);
    for (const auto& [cell, values] : rows) EXPECT_EQ(values, all.at(cell)) << cell.ToString();
  }
}

// What is there while a job changes the map is of no state of it.
TEST_F(NoAttributesTest, NothingIsCountedWhileAJobChangesTheMap) {
  Make("m", 8);
  const auto status = [&] {
    v1::AggregateResponse response;
    return cluster_.Aggregate(Question("m", 1, "", v1::GROUP_BY_NOTHING), &response, 3);
  };
  uint64_t job = 0;
  ASSERT_TRUE(cluster_.Start("m", {{"token", {{"tokens", "1"}, {"endless", "1"}}}}, &job).ok());
  cluster_.AwaitWork(job);
  EXPECT_EQ(status().error_code(), grpc::StatusCode::ABORTED);
  EXPECT_THAT(status().error_message(), HasSubstr(absl::StrCat("is being changed by job ", job)));
  std::vector<std::pair<CellId, std::vector<std::string>>> rows;
  EXPECT_EQ(cluster_.Read(AttributeCluster::All("m", 1, {"@point"}), 0, &rows).error_code(),
            grpc::StatusCode::ABORTED);
  cluster_.Cancel(job);
  cluster_.Await(job);
  EXPECT_TRUE(status().ok()) << status().error_message();
  // A job that only reads keeps nobody out.
  ASSERT_TRUE(
      cluster_.Start("m", {{"token", {{"tokens", "1"}, {"endless", "1"}, {"read_only", "1"}}}}, &job).ok());
  cluster_.AwaitWork(job);
  EXPECT_TRUE(status().ok()) << status().error_message();
  cluster_.Cancel(job);
  cluster_.Await(job);
}

}  // namespace
}  // namespace ndmap

// SPDX-License-Identifier: GPL-3.0-or-later
// Values of cells through real services: the same for any number of blocks, one in all blocks that share a
// cell, through jobs that change the map, end, fail or are cancelled.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "core/attributes/exact_sum.h"
#include "tests/service/attribute_cluster.h"

namespace ndmap {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class AttributesServiceTest : public ::testing::Test {
 protected:
  AttributesServiceTest() : cluster_(3) {}

  struct Kind {
    std::string name;
    uint32_t dimension;
    v1::ValueType type;
    v1::SplitRule split;
  };
  static std::vector<Kind> Kinds() {
    return {{"place", 0, v1::VALUE_TYPE_VEC3, v1::SPLIT_RULE_MEAN},
            {"heat", 0, v1::VALUE_TYPE_DOUBLE, v1::SPLIT_RULE_MIDPOINT},
            {"seam", 1, v1::VALUE_TYPE_INT64, v1::SPLIT_RULE_COPY},
            {"side", 2, v1::VALUE_TYPE_CATEGORY, v1::SPLIT_RULE_COPY},
            {"mass", 3, v1::VALUE_TYPE_DOUBLE, v1::SPLIT_RULE_DIVIDE},
            {"zone", 3, v1::VALUE_TYPE_CATEGORY, v1::SPLIT_RULE_COPY}};
  }

  void Make(const std::string& map, uint32_t blocks) {
    ASSERT_EQ(cluster_.Create(Cluster::GridRequest(map, blocks)).state(), v1::JOB_STATE_DONE);
  }
  void Define(const std::string& map, const Kind& kind) {
    const v1::Job job =
        cluster_.Define(map, AttributeCluster::Attribute(kind.name, kind.dimension, kind.type, kind.split));
    ASSERT_EQ(job.state(), v1::JOB_STATE_DONE) << job.error();
  }
  // Every cell of the dimension, in two parts.
  void WriteAll(const std::string& map, const Kind& kind, uint64_t salt) {
    const std::vector<CellId> ids =
        IdsOf(cluster_.ReadTable(AttributeCluster::All(map, kind.dimension, {kind.name})));
    const auto middle = ids.begin() + static_cast<std::ptrdiff_t>(ids.size() / 2);
    std::vector<v1::WriteAttributeRequest> parts = {
        AttributeCluster::Part(map, kind.name, {ids.begin(), middle}),
        AttributeCluster::Part("", "", {middle, ids.end()})};
    *parts[0].mutable_values() = ValuesFor({ids.begin(), middle}, kind.type, salt);
    *parts[1].mutable_values() = ValuesFor({middle, ids.end()}, kind.type, salt);
    v1::WriteAttributeResponse response;
    const grpc::Status status = cluster_.Write(parts, &response);
    ASSERT_TRUE(status.ok()) << status.error_message();
    EXPECT_EQ(response.written(), ids.size());
    EXPECT_EQ(response.missing(), 0u);
  }
  void Refine(const std::string& map, const std::string& cells) {
    const v1::Job job =
        cluster_.Run(map, {{"refine", {{"oracle", "list"}, {"cells", cells}, {"depth", "4"}}}});
    ASSERT_EQ(job.state(), v1::JOB_STATE_DONE) << job.error();
    EXPECT_EQ(job.phases_size(), 2);
    EXPECT_EQ(job.results_size(), 2);
  }

  AttributeCluster cluster_;
};

TEST_F(AttributesServiceTest, ValuesAreTheSameForAnyNumberOfBlocks) {
  std::map<uint32_t, std::vector<Table>> tables;
  for (uint32_t blocks : {1u, 2u, 8u}) {
    const std::string map = absl::StrCat("m", blocks);
    Make(map, blocks);
    for (const Kind& kind : Kinds()) Define(map, kind);
    EXPECT_EQ(cluster_.Get(map).attributes_size(), 6);
    for (const Kind& kind : Kinds()) WriteAll(map, kind, 1);
    Refine(map, kRefined);
    for (const Kind& kind : Kinds()) WriteAll(map, kind, 2);
    Refine(map, "h1 h2 h3/0");
    const v1::Job trim = cluster_.Run(map, {{"trim", {{"keep", "all"}, {"cells", "h5/2.1 h2/3"}}}});
    ASSERT_EQ(trim.state(), v1::JOB_STATE_DONE) << trim.error();
    for (const Kind& kind : Kinds()) {
      const v1::ReadAttributesRequest all = AttributeCluster::All(map, kind.dimension, {kind.name, "@level"});
      tables[blocks].push_back(cluster_.ReadTable(all));
      EXPECT_EQ(cluster_.ReadTable(all, blocks - 1), tables[blocks].back());
      const size_t most = cluster_.ExpectOneValueEverywhere(map, kind.dimension, kind.name);
      // The vertex in the middle belongs to all.
      if (kind.dimension == 0) {
        EXPECT_EQ(most, blocks);
      }
    }
  }
  EXPECT_GT(tables[1][0].size(), 150u);
  EXPECT_EQ(tables[2], tables[1]);
  EXPECT_EQ(tables[8], tables[1]);
}

TEST_F(AttributesServiceTest, WhatTheMapKnowsIsReadLikeAnAttribute) {
  Table first[4];
  for (uint32_t blocks : {1u, 8u}) {
    const std::string map = absl::StrCat("m", blocks);
    Make(map, blocks);
    for (uint32_t i = 0; i < 4; ++i)
      Define(map, {absl::StrCat("a", i), i, v1::VALUE_TYPE_INT64, v1::SPLIT_RULE_COPY});
    Refine(map, kRefined);
    for (uint32_t i = 0; i < 4; ++i) {
      std::vector<std::string> names = {"@point", "@level"};
      if (i == 3) names.insert(names.end(), {"@volume", "@state"});
      const Table table = cluster_.ReadTable(AttributeCluster::All(map, i, names));
      if (blocks == 1) first[i] = table;
      EXPECT_EQ(table, first[i]) << "dimension " << i;
    }
  }
  const auto text = [](double value) { return absl::StrCat(absl::Hex(std::bit_cast<uint64_t>(value))); };
  EXPECT_THAT(first[3][CellId::Parse("h0/1").value()],
              ElementsAre(text(0.75), text(0.25), text(0.25), "1", text(0.125), "unknown"));
  EXPECT_THAT(first[0][CellId::Parse("v0:7").value()], ElementsAre(text(1), text(1), text(1), "0"));
  EXPECT_THAT(first[2][CellId::Parse("f2:5").value()], ElementsAre(text(1), text(1.5), text(0.5), "0"));
  EXPECT_THAT(first[1][CellId::Parse("e2:11").value()], ElementsAre(text(1), text(2), text(0.5), "0"));
}

TEST_F(AttributesServiceTest, IdsAndQueriesInTheOrderAsked) {
  Make("m", 8);
  Define("m", {"heat", 0, v1::VALUE_TYPE_DOUBLE, v1::SPLIT_RULE_MEAN});
  Define("m", {"zone", 0, v1::VALUE_TYPE_CATEGORY, v1::SPLIT_RULE_COPY});
  WriteAll("m", {"heat", 0, v1::VALUE_TYPE_DOUBLE, v1::SPLIT_RULE_MEAN}, 3);
  WriteAll("m", {"zone", 0, v1::VALUE_TYPE_CATEGORY, v1::SPLIT_RULE_COPY}, 3);
  const Table all = cluster_.ReadTable(AttributeCluster::All("m", 0, {"heat", "zone"}));
  ASSERT_EQ(all.size(), 27u);
  std::vector<CellId> asked = IdsOf(all);
  std::shuffle(asked.begin(), asked.end(), std::mt19937(1));
  asked.push_back(asked.front());
  const CellId gone = CellId::Parse("v0/1:1").value(), edge = CellId::Parse("e0:1").value();
  asked.insert(asked.begin() + 5, {gone, edge});
  v1::ReadAttributesRequest request = AttributeCluster::All("m", 0, {"heat", "zone"});
  AttributeCluster::AddIds(asked, request.mutable_select()->mutable_ids());
  for (uint32_t block = 0; block < 3; ++block) {
    std::vector<std::pair<CellId, std::vector<std::string>>> rows;
    ASSERT_TRUE(cluster_.Read(request, block, &rows).ok());
    ASSERT_EQ(rows.size(), asked.size());
    for (size_t k = 0; k < rows.size(); ++k) {
      EXPECT_EQ(rows[k].first, asked[k]);
      const bool missing = asked[k] == gone || asked[k] == edge;
      EXPECT_EQ(rows[k].second, missing ? std::vector<std::string>() : all.at(asked[k]));
    }
  }
  request.mutable_select()->mutable_query()->add_anchors()->set_text("h7");
  request.mutable_select()->mutable_query()->add_close(3);
  std::vector<std::pair<CellId, std::vector<std::string>>> rows;
  const grpc::Status status = cluster_.Read(request, 1, &rows);
  ASSERT_TRUE(status.ok()) << status.error_message();
  ASSERT_EQ(rows.size(), 8u);
  for (size_t k = 0; k < rows.size(); ++k) {
    EXPECT_EQ(rows[k].second, all.at(rows[k].first));
    if (k > 0) {
      EXPECT_LT(rows[k - 1].first, rows[k].first);
    }
  }
}

TEST_F(AttributesServiceTest, AnswersOfManyPartsAreWhole) {
  Make("m", 2);
  Define("m", {"n", 3, v1::VALUE_TYPE_INT64, v1::SPLIT_RULE_COPY});
  ASSERT_EQ(cluster_.Run("m", {{"refine", {{"oracle", "everything"}, {"depth", "5"}}}}).state(),
            v1::JOB_STATE_DONE);
  constexpr size_t kCells = 8 << 15;
  const Table all = cluster_.ReadTable(AttributeCluster::All("m", 3, {"n", "@level"}));
  ASSERT_EQ(all.size(), kCells);
  const std::vector<CellId> ids = IdsOf(all);
  const std::vector<CellId> asked(ids.begin(), ids.begin() + 65536);
  v1::WriteAttributeRequest part = AttributeCluster::Part("m", "n", asked);
  *part.mutable_values() = ValuesFor(asked, v1::VALUE_TYPE_INT64, 1);
  v1::WriteAttributeResponse written;
  ASSERT_TRUE(cluster_.Write({part}, &written).ok());
  EXPECT_EQ(written.written(), asked.size());
  v1::ReadAttributesRequest request = AttributeCluster::All("m", 3, {"n"});
  *request.mutable_select()->mutable_ids() = part.ids();
  std::vector<std::pair<CellId, std::vector<std::string>>> rows;
  ASSERT_TRUE(cluster_.Read(request, 1, &rows).ok());
  ASSERT_EQ(rows.size(), asked.size());
  for (size_t k = 0; k < rows.size(); ++k) {
    ASSERT_EQ(rows[k].first, asked[k]);
    ASSERT_EQ(rows[k].second,
              std::vector<std::string>{absl::StrCat(part.values().integers(static_cast<int>(k)))});
  }
}

TEST_F(AttributesServiceTest, OneValueForSelectedCells) {
  Make("m", 8);
  Define("m", {"mark", 3, v1::VALUE_TYPE_CATEGORY, v1::SPLIT_RULE_COPY});
  Refine("m", "h0 h0/7 h3");
  const auto write = [&](const std::string& text, const std::function<void(v1::CellSelection&)>& select) {
    v1::WriteAttributeRequest request = AttributeCluster::Part("m", "mark", {});
    request.clear_ids();
    request.mutable_values()->add_categories("unused");
    request.mutable_values()->add_categories(text);
    request.mutable_values()->add_codes(1);
    select(*request.mutable_select());
    v1::WriteAttributeResponse response;
    const grpc::Status status = cluster_.Write({request}, &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return response.written();
  };
  EXPECT_EQ(write("any", [](v1::CellSelection& s) { s.mutable_all(); }), 29u);
  EXPECT_EQ(write("fine",
                  [](v1::CellSelection& s) {
                    s.mutable_all();
                    s.set_by_level(true);
                    s.set_lowest_level(1);
                    s.set_highest_level(5);
                  }),
            23u);
  // The eight around the vertex in the middle.
  EXPECT_EQ(write("near",
                  [](v1::CellSelection& s) {
                    s.mutable_query()->add_anchors()->set_text("v0:7");
                    s.mutable_query()->add_close(0);
                  }),
            8u);
  EXPECT_EQ(write("one",
                  [](v1::CellSelection& s) {
                    AttributeCluster::AddIds({CellId::Parse("h7").value(), CellId::Parse("h0").value()},
                                             s.mutable_ids());
                  }),
            1u);
  v1::AggregateRequest question;
  question.set_map("m");
  question.set_dimension(3);
  question.set_group_by(v1::GROUP_BY_CATEGORY);
  question.set_category("mark");
  std::map<std::string, uint64_t> counts;
  const v1::AggregateResponse groups = cluster_.MustAggregate(question, 2);
  for (const v1::Aggregate& group : groups.groups()) counts[group.group()] = group.count();
  EXPECT_EQ(counts, (std::map<std::string, uint64_t>{{"fine", 21}, {"near", 7}, {"one", 1}}));
}

TEST_F(AttributesServiceTest, TwoWritersAtOnceEndWithOneValueEverywhere) {
  Make("m", 8);
  const Kind kind{"heat", 0, v1::VALUE_TYPE_DOUBLE, v1::SPLIT_RULE_MEAN};
  Define("m", kind);
  Refine("m", kRefined);
  const std::vector<CellId> ids = IdsOf(cluster_.ReadTable(AttributeCluster::All("m", 0, {})));
  const auto writer = [&](uint64_t salt) {
    for (uint64_t round = 0; round < 20; ++round) {
      v1::WriteAttributeRequest part = AttributeCluster::Part("m", "heat", ids);
      *part.mutable_values() = ValuesFor(ids, kind.type, 2 * round + salt);
      v1::WriteAttributeResponse response;
      const grpc::Status status = cluster_.Write({part}, &response);
      EXPECT_TRUE(status.ok()) << status.error_message();
    }
  };
  std::thread other(writer, 1);
  writer(0);
  other.join();
  EXPECT_EQ(cluster_.ExpectOneValueEverywhere("m", 0, "heat"), 8u);
  const Table end = cluster_.ReadTable(AttributeCluster::All("m", 0, {"heat"}));
  for (uint32_t block : {1u, 2u}) {
    EXPECT_EQ(cluster_.ReadTable(AttributeCluster::All("m", 0, {"heat"}), block), end);
  }
  // Parts are done as a whole: all values are of one and the same part, the last.
  const auto written = [&](uint64_t salt) {
    const v1::Values values = ValuesFor(ids, kind.type, salt);
    Table table;
    for (size_t k = 0; k < ids.size(); ++k) table[ids[k]] = {ValueText(values, static_cast<int>(k))};
    return table;
  };
  EXPECT_TRUE(end == written(38) || end == written(39));
}

// Whatever part of a write the phase comes after, it is the same part in all blocks: new vertices, which
// nobody writes, have one value in all of them.
TEST_F(AttributesServiceTest, WritersDuringJobsLeaveNoBlockBehind) {
  Make("m", 8);
  const Kind kind{"heat", 0, v1::VALUE_TYPE_DOUBLE, v1::SPLIT_RULE_MEAN};
  Define("m", kind);
  uint64_t salt = 0;
  for (const char* cells :
       {"h0 h1", "h0/7 h2", "h3 h4 h5/0 h5", "h6 h7 h7/0", "h7/0.0 h0/7.7", "h1/6 h2/5 h4/3"}) {
    const std::vector<CellId> ids = IdsOf(cluster_.ReadTable(AttributeCluster::All("m", 0, {})));
    std::atomic<bool> over = false;
    std::atomic<int> done = 0;
    std::thread writer([&] {
      while (!over) {
        v1::WriteAttributeRequest part = AttributeCluster::Part("m", "heat", ids);
        *part.mutable_values() = ValuesFor(ids, kind.type, ++salt);
        v1::WriteAttributeResponse response;
        const grpc::Status status = cluster_.Write({part}, &response);
        EXPECT_TRUE(status.ok() || status.error_code() == grpc::StatusCode::ABORTED)
            << status.error_message();
        if (status.ok()) ++done;
      }
    });
    while (done == 0 && !HasFailure()) std::this_thread::yield();
    Refine("m", cells);
    over = true;
    writer.join();
    EXPECT_EQ(cluster_.ExpectOneValueEverywhere("m", 0, "heat"), 8u);
  }
}

TEST_F(AttributesServiceTest, ACancelledJobGivesNewCellsTheirValues) {
  Make("m", 8);
  Define("m", {"mass", 3, v1::VALUE_TYPE_DOUBLE, v1::SPLIT_RULE_DIVIDE});
  v1::WriteAttributeRequest one = AttributeCluster::Part("m", "mass", {});
  one.clear_ids();
  one.mutable_select()->mutable_all();
  one.mutable_values()->add_doubles(1);
  v1::WriteAttributeResponse response;
  ASSERT_TRUE(cluster_.Write({one}, &response).ok());
  uint64_t number = 0;
  ASSERT_TRUE(
      cluster_.Start("m", {{"refine", {{"oracle", "everything"}, {"depth", "8"}}}, {"classify", {}}}, &number)
          .ok());
  cluster_.AwaitWork(number);
  cluster_.Cancel(number);
  const v1::Job job = cluster_.Await(number);
  EXPECT_EQ(job.state(), v1::JOB_STATE_CANCELLED) << job.error();
  ASSERT_EQ(job.phases_size(), 3);
  ASSERT_EQ(job.results_size(), 2);
  EXPECT_TRUE(job.results(0).cancelled());
  EXPECT_EQ(job.results(1).phase().algorithm(), "attributes");
  EXPECT_FALSE(job.results(1).cancelled());
  const v1::JobProgress progress = cluster_.Watch(number, [](const v1::JobProgress&) { return true; });
  EXPECT_EQ(progress.phase_count(), 3u);
  EXPECT_EQ(progress.phase_index(), 3u);
  v1::AggregateRequest question;
  question.set_map("m");
  question.set_dimension(3);
  question.set_name("mass");
  const v1::AggregateResponse sum = cluster_.MustAggregate(question);
  ASSERT_EQ(sum.groups_size(), 1);
  EXPECT_GT(sum.groups(0).count(), 8u);
  EXPECT_THAT(sum.groups(0).sum(), ElementsAre(8.0));
  question.set_name("@volume");
  EXPECT_THAT(cluster_.MustAggregate(question).groups(0).sum(), ElementsAre(8.0));
}

TEST_F(AttributesServiceTest, AFailedJobLeavesValuesAsTheyWere) {
  Make("m", 8);
  const Kind kind{"heat", 0, v1::VALUE_TYPE_DOUBLE, v1::SPLIT_RULE_MEAN};
  Define("m", kind);
  WriteAll("m", kind, 1);
  const v1::ReadAttributesRequest all = AttributeCluster::All("m", 0, {"heat"});
  const Table before = cluster_.ReadTable(all);
  const v1::Job job = cluster_.Run("m", {{"token", {{"tokens", "20"}, {"hops", "3"}, {"fail_block", "1"}}}});
  EXPECT_EQ(job.state(), v1::JOB_STATE_FAILED);
  EXPECT_EQ(job.results_size(), 0);
  EXPECT_EQ(cluster_.Get("m").state(), v1::MAP_STATE_FAILED);
  EXPECT_EQ(cluster_.ReadTable(all), before);
  uint64_t number = 0;
  EXPECT_EQ(cluster_.StartDefine("m", AttributeCluster::Attribute("b", 0, v1::VALUE_TYPE_INT64), &number)
                .error_code(),
            grpc::StatusCode::FAILED_PRECONDITION);
}

// A definition counts when its job is done: not when it was cancelled before it began.
TEST_F(AttributesServiceTest, NamesComeAndGo) {
  Make("m", 8);
  v1::Attribute heat = AttributeCluster::Attribute("heat", 0, v1::VALUE_TYPE_DOUBLE, v1::SPLIT_RULE_MEAN);
  heat.mutable_fill()->add_doubles(20);
  ASSERT_EQ(cluster_.Define("m", heat).state(), v1::JOB_STATE_DONE);
  ASSERT_EQ(cluster_.Get("m").attributes_size(), 1);
  EXPECT_EQ(cluster_.Get("m").attributes(0).fill().doubles(0), 20);
  const uint64_t number = cluster_.Get("m").attributes(0).number();
  const std::string twenty = absl::StrCat(absl::Hex(std::bit_cast<uint64_t>(20.0)));
  for (const auto& [id, values] : cluster_.ReadTable(AttributeCluster::All("m", 0, {"heat"})))
    EXPECT_THAT(values, ElementsAre(twenty));

  uint64_t job = 0;
  EXPECT_EQ(cluster_.StartDefine("m", heat, &job).error_code(), grpc::StatusCode::ALREADY_EXISTS);
  ASSERT_TRUE(cluster_.StartDrop("m", "heat", &job).ok());
  EXPECT_EQ(cluster_.Await(job).state(), v1::JOB_STATE_DONE);
  EXPECT_EQ(cluster_.Await(job).kind(), "drop attribute");
  EXPECT_EQ(cluster_.Get("m").attributes_size(), 0);
  const grpc::Status dropped = cluster_.StartDrop("m", "heat", &job);
  EXPECT_EQ(dropped.error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_THAT(dropped.error_message(), HasSubstr("it has none"));
  // Without attributes no phase is added.
  EXPECT_EQ(
      cluster_.Run("m", {{"refine", {{"oracle", "list"}, {"cells", "h0"}, {"depth", "1"}}}}).phases_size(),
      1);

  ASSERT_EQ(cluster_.Define("m", AttributeCluster::Attribute("heat", 0, v1::VALUE_TYPE_CATEGORY)).state(),
            v1::JOB_STATE_DONE);
  EXPECT_GT(cluster_.Get("m").attributes(0).number(), number);
  const Table again = cluster_.ReadTable(AttributeCluster::All("m", 0, {"heat"}));
  EXPECT_EQ(again.size(), 27u + 19u);
  for (const auto& [id, values] : again) EXPECT_THAT(values, ElementsAre(""));

  v1::GetBlockStatsResponse stats;
  grpc::ClientContext context;
  v1::GetBlockStatsRequest request;
  request.set_map("m");
  ASSERT_TRUE(cluster_.ServerOf("m", 0)->GetBlockStats(&context, request, &stats).ok());
  for (const v1::BlockStats& block : stats.blocks()) EXPECT_GT(block.attribute_bytes(), 8 * 21u);
}

}  // namespace
}  // namespace ndmap

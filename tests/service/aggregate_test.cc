// SPDX-License-Identifier: GPL-3.0-or-later
// Aggregates through real services: exact, and the same bits whatever the blocks; and wrong use of all that
// attributes offer.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "core/attributes/aggregate.h"
#include "tests/service/attribute_cluster.h"

namespace ndmap {
namespace {

using ::testing::DoubleEq;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class AggregateServiceTest : public ::testing::Test {
 protected:
  AggregateServiceTest() : cluster_(3) {}

  // Heat on vertices, mass, spin (vec3), count and zone on hexahedra, all of values that follow from the ids.
  void Make(const std::string& map, uint32_t blocks) {
    ASSERT_EQ(cluster_.Create(Cluster::GridRequest(map, blocks)).state(), v1::JOB_STATE_DONE);
    ASSERT_EQ(
        cluster_.Run(map, {{"refine", {{"oracle", "list"}, {"cells", kRefined}, {"depth", "4"}}}}).state(),
        v1::JOB_STATE_DONE);
    for (const auto& [name, dimension, type] : kColumns) {
      ASSERT_EQ(cluster_.Define(map, AttributeCluster::Attribute(name, dimension, type)).state(),
                v1::JOB_STATE_DONE);
      const std::vector<CellId> ids = IdsOf(cluster_.ReadTable(AttributeCluster::All(map, dimension, {})));
      v1::WriteAttributeRequest part = AttributeCluster::Part(map, name, ids);
      *part.mutable_values() = ValuesFor(ids, type, 5);
      v1::WriteAttributeResponse response;
      ASSERT_TRUE(cluster_.Write({part}, &response).ok());
    }
  }
  static v1::AggregateRequest Question(const std::string& map, uint32_t dimension, const std::string& name) {
    v1::AggregateRequest question;
    question.set_map(map);
    question.set_dimension(dimension);
    question.set_name(name);
    return question;
  }

  std::vector<v1::Aggregate> Groups(const v1::AggregateRequest& question) {
    const v1::AggregateResponse response = cluster_.MustAggregate(question);
    return {response.groups().begin(), response.groups().end()};
  }

  struct ColumnKind {
    const char* name;
    uint32_t dimension;
    v1::ValueType type;
  };
  static constexpr ColumnKind kColumns[] = {{"heat", 0, v1::VALUE_TYPE_DOUBLE},
                                            {"mass", 3, v1::VALUE_TYPE_DOUBLE},
                                            {"spin", 3, v1::VALUE_TYPE_VEC3},
                                            {"count", 3, v1::VALUE_TYPE_INT64},
                                            {"zone", 3, v1::VALUE_TYPE_CATEGORY}};
  AttributeCluster cluster_;
};

TEST_F(AggregateServiceTest, TheSameBitsForAnyNumberOfBlocks) {
  std::map<uint32_t, std::vector<std::string>> answers;
  for (uint32_t blocks : {1u, 2u, 8u}) {
    const std::string map = absl::StrCat("m", blocks);
    Make(map, blocks);
    for (const char* name : {"heat", "mass", "spin", "count", "@volume", "@point", ""}) {
      for (v1::GroupBy by : {v1::GROUP_BY_NOTHING, v1::GROUP_BY_LEVEL, v1::GROUP_BY_CATEGORY}) {
        const uint32_t dimension = name == std::string("heat") ? 0 : 3;
        if (dimension == 0 && by == v1::GROUP_BY_CATEGORY) continue;
        v1::AggregateRequest question = Question(map, dimension, name);
        question.set_group_by(by);
        if (by == v1::GROUP_BY_CATEGORY) question.set_category("zone");
        if (*name != '\0') {
          question.set_bins(7);
          question.set_histogram_lo(-50);
          question.set_histogram_hi(100);
          question.set_integral(by != v1::GROUP_BY_CATEGORY);
        }
        answers[blocks].push_back(cluster_.MustAggregate(question).DebugString());
        EXPECT_EQ(cluster_.MustAggregate(question, blocks - 1).DebugString(), answers[blocks].back());
      }
    }
  }
  EXPECT_EQ(answers[2], answers[1]);
  EXPECT_EQ(answers[8], answers[1]);
}

// Against values that were read and added up here.
TEST_F(AggregateServiceTest, SumsExtremesAndHistogramsAreThoseOfTheValues) {
  Make("m", 8);
  const std::vector<CellId> ids = IdsOf(cluster_.ReadTable(AttributeCluster::All("m", 3, {})));
  const v1::Values masses = ValuesFor(ids, v1::VALUE_TYPE_DOUBLE, 5);
  const v1::Values counts = ValuesFor(ids, v1::VALUE_TYPE_INT64, 5);
  ExactSum mass;
  int64_t count = 0;
  std::vector<uint64_t> histogram(4, 0);
  for (double v : masses.doubles()) {
    mass.Add(v);
    if (v >= -100 && v <= 100) ++histogram[static_cast<size_t>(std::min((v + 100) / 50, 3.0))];
  }
  for (int64_t v : counts.integers()) count += v;
  v1::AggregateRequest question = Question("m", 3, "mass");
  question.set_bins(4);
  question.set_histogram_lo(-100);
  question.set_histogram_hi(100);
  const v1::AggregateResponse answer = cluster_.MustAggregate(question);
  ASSERT_EQ(answer.groups_size(), 1);
  const v1::Aggregate& all = answer.groups(0);
  EXPECT_EQ(all.group(), "");
  EXPECT_EQ(all.count(), ids.size());
  EXPECT_THAT(all.sum(), ElementsAre(mass.Rounded()));
  EXPECT_THAT(all.min(), ElementsAre(*std::min_element(masses.doubles().begin(), masses.doubles().end())));
  EXPECT_THAT(all.max(), ElementsAre(*std::max_element(masses.doubles().begin(), masses.doubles().end())));
  EXPECT_THAT(all.histogram(), ::testing::ElementsAreArray(histogram));
  uint64_t inside = 0;
  for (uint64_t n : histogram) inside += n;
  EXPECT_EQ(all.below(0) + all.above(0) + inside, ids.size());
  EXPECT_EQ(all.integral_size(), 0);
  EXPECT_FALSE(all.has_integer_sum());
  EXPECT_EQ(cluster_.MustAggregate(Question("m", 3, "count")).groups(0).integer_sum(), count);

  question = Question("m", 0, "");
  question.set_group_by(v1::GROUP_BY_BLOCK);
  uint64_t vertices = 0;
  for (const v1::Aggregate& group : Groups(question)) vertices += group.count();
  EXPECT_EQ(vertices, cluster_.ReadTable(AttributeCluster::All("m", 0, {})).size());
  question.set_by_level(true);
  question.set_lowest_level(0);
  question.set_highest_level(0);
  vertices = 0;
  for (const v1::Aggregate& group : Groups(question)) vertices += group.count();
  EXPECT_EQ(vertices, 27u);
  question.set_lowest_level(20);
  question.set_highest_level(29);
  EXPECT_EQ(cluster_.MustAggregate(question).groups_size(), 0);
}

TEST_F(AggregateServiceTest, TheIntegralOfOneIsTheVolume) {
  v1::CreateMapRequest request = Cluster::GridRequest("m", 8);
  std::string corners;
  for (int k = 0; k < 27; ++k) {
    const double x = k % 3, y = k / 3 % 3, z = k / 9;
    absl::StrAppend(&corners, k > 0 ? " " : "", x + 0.0625 * y * z, ",", y - 0.125 * x * z, ",",
                    z + 0.25 * x);
  }
  (*request.mutable_parameters())["corners"] = corners;
  ASSERT_EQ(cluster_.Create(request).state(), v1::JOB_STATE_DONE);
  v1::Attribute one = AttributeCluster::Attribute("one", 0, v1::VALUE_TYPE_DOUBLE);
  one.mutable_fill()->add_doubles(1);
  ASSERT_EQ(cluster_.Define("m", one).state(), v1::JOB_STATE_DONE);
  one.set_name("unit");
  one.set_dimension(3);
  ASSERT_EQ(cluster_.Define("m", one).state(), v1::JOB_STATE_DONE);
  ASSERT_EQ(
      cluster_.Run("m", {{"refine", {{"oracle", "list"}, {"cells", kRefined}, {"depth", "4"}}}}).state(),
      v1::JOB_STATE_DONE);
  const double volume = cluster_.MustAggregate(Question("m", 3, "@volume")).groups(0).sum(0);
  EXPECT_GT(volume, 7);
  for (const auto& [name, dimension] : {std::pair("one", 0u), std::pair("unit", 3u)}) {
    v1::AggregateRequest question = Question("m", dimension, name);
    question.set_integral(true);
    const v1::AggregateResponse answer = cluster_.MustAggregate(question);
    EXPECT_THAT(answer.groups(0).integral(), ElementsAre(volume));
    EXPECT_EQ(answer.groups(0).volume(), volume);
    question.set_group_by(v1::GROUP_BY_LEVEL);
    double parts = 0;
    for (const v1::Aggregate& level : Groups(question)) parts += level.volume();
    EXPECT_THAT(parts, DoubleEq(volume));
  }
}

TEST_F(AggregateServiceTest, ValuesThatAreNoNumbersAreCountedAndLeftOut) {
  Make("m", 2);
  v1::WriteAttributeRequest part =
      AttributeCluster::Part("m", "mass", {CellId::Parse("h1").value(), CellId::Parse("h2").value()});
  part.mutable_values()->add_doubles(std::numeric_limits<double>::quiet_NaN());
  part.mutable_values()->add_doubles(std::numeric_limits<double>::infinity());
  v1::WriteAttributeResponse response;
  ASSERT_TRUE(cluster_.Write({part}, &response).ok());
  ASSERT_EQ(response.written(), 2u);
  v1::AggregateRequest question = Question("m", 3, "mass");
  question.set_integral(true);
  const v1::Aggregate all = cluster_.MustAggregate(question).groups(0);
  EXPECT_THAT(all.not_finite(), ElementsAre(2u));
  EXPECT_TRUE(std::isfinite(all.sum(0)) && std::isfinite(all.integral(0)));
  EXPECT_EQ(all.volume(), 6);
  EXPECT_EQ(all.count(), cluster_.ReadTable(AttributeCluster::All("m", 3, {})).size());
}

TEST_F(AggregateServiceTest, WrongQuestionsAreTypedErrors) {
  Make("m", 8);
  const auto expect = [&](const std::function<void(v1::AggregateRequest&)>& spoil, grpc::StatusCode code,
                          const std::string& text) {
    v1::AggregateRequest question = Question("m", 3, "mass");
    spoil(question);
    v1::AggregateResponse response;
    grpc::ClientContext context;
    const grpc::Status status = cluster_.ServerOf("m", 1)->Aggregate(&context, question, &response);
    EXPECT_EQ(status.error_code(), code) << status.error_message();
    EXPECT_THAT(status.error_message(), HasSubstr(text));
  };
  using Q = v1::AggregateRequest;
  constexpr auto kInvalid = grpc::StatusCode::INVALID_ARGUMENT;
  expect([](Q& q) { q.set_map("other"); }, grpc::StatusCode::NOT_FOUND, "no map \"other\"");
  expect([](Q& q) { q.set_name("moss"); }, grpc::StatusCode::NOT_FOUND, "mass, spin, count, zone");
  expect([](Q& q) { q.set_dimension(4); }, kInvalid, "dimension 4");
  expect([](Q& q) { q.set_dimension(1); }, grpc::StatusCode::NOT_FOUND, "there are @point, @level, @block");
  expect([](Q& q) { q.set_bins(70000); }, kInvalid, "70000 bins");
  expect([](Q& q) { q.set_bins(2); }, kInvalid, "histogram from 0 to 0");
  expect(
      [](Q& q) {
        q.set_name("zone");
        q.set_bins(2);
        q.set_histogram_hi(1);
      },
      kInvalid, "needs an attribute of numbers");
  expect([](Q& q) { q.set_group_by(v1::GROUP_BY_CATEGORY); }, kInvalid, "category");
  expect([](Q& q) { q.set_category("zone"); }, kInvalid, "category");
  expect([](Q& q) { q.set_group_by(static_cast<v1::GroupBy>(9)); }, kInvalid, "group_by 9");
  expect(
      [](Q& q) {
        q.set_group_by(v1::GROUP_BY_CATEGORY);
        q.set_category("mass");
      },
      kInvalid, "is no category");
  expect(
      [](Q& q) {
        q.set_name("zone");
        q.set_integral(true);
      },
      kInvalid, "numbers");
  expect(
      [](Q& q) {
        q.set_name("@volume");
        q.set_dimension(0);
      },
      kInvalid, "of hexahedra");
  expect(
      [](Q& q) {
        q.set_integral(true);
        q.set_group_by(v1::GROUP_BY_CATEGORY);
        q.set_category("zone");
      },
      kInvalid, "by category");
  expect(
      [](Q& q) {
        q.set_by_level(true);
        q.set_lowest_level(3);
      },
      kInvalid, "levels 3 to 0");
}

TEST_F(AggregateServiceTest, TooManyGroupsOrBinsAreRefused) {
  Make("m", 2);
  ASSERT_EQ(cluster_.Run("m", {{"refine", {{"oracle", "everything"}, {"depth", "4"}}}}).state(),
            v1::JOB_STATE_DONE);
  const std::vector<CellId> ids = IdsOf(cluster_.ReadTable(AttributeCluster::All("m", 3, {})));
  ASSERT_GT(ids.size(), 9000u);
  v1::WriteAttributeRequest part = AttributeCluster::Part("m", "zone", ids);
  for (uint32_t k = 0; k < ids.size(); ++k) {
    part.mutable_values()->add_categories(absl::StrCat("z", k));
    part.mutable_values()->add_codes(k);
  }
  v1::WriteAttributeResponse written;
  ASSERT_TRUE(cluster_.Write({part}, &written).ok());
  v1::AggregateRequest question = Question("m", 3, "mass");
  question.set_group_by(v1::GROUP_BY_CATEGORY);
  question.set_category("zone");
  v1::AggregateResponse response;
  grpc::Status status = cluster_.Aggregate(question, &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_THAT(status.error_message(), HasSubstr("8192 groups"));
  question.set_bins(60000);
  question.set_histogram_hi(1);
  status = cluster_.Aggregate(question, &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_THAT(status.error_message(), HasSubstr("60000 bins"));
}

}  // namespace
}  // namespace ndmap

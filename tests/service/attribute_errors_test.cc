// SPDX-License-Identifier: GPL-3.0-or-later
// Wrong use of attributes, and servers that go in the middle: typed errors in one sentence, and nothing done
// by halves.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "server/attribute_gates.h"
#include "tests/service/attribute_cluster.h"

namespace ndmap {
namespace {

using grpc::StatusCode;
using ::testing::HasSubstr;

class AttributeErrorsTest : public ::testing::Test {
 protected:
  AttributeErrorsTest() : cluster_(3) {
    EXPECT_EQ(cluster_.Create(Cluster::GridRequest("m", 8)).state(), v1::JOB_STATE_DONE);
    for (const auto& [name, type] :
         {std::pair("heat", v1::VALUE_TYPE_DOUBLE), std::pair("flow", v1::VALUE_TYPE_VEC3),
          std::pair("kind", v1::VALUE_TYPE_CATEGORY)}) {
      EXPECT_EQ(cluster_.Define("m", AttributeCluster::Attribute(name, 0, type)).state(), v1::JOB_STATE_DONE);
    }
  }

  void ExpectStatus(const grpc::Status& status, StatusCode code, const std::string& text) {
    EXPECT_EQ(status.error_code(), code) << status.error_message();
    EXPECT_THAT(status.error_message(), HasSubstr(text));
    EXPECT_EQ(status.error_message().find('\n'), std::string::npos);
  }
  void ExpectRead(const std::function<void(v1::ReadAttributesRequest&)>& spoil, StatusCode code,
                  const std::string& text) {
    v1::ReadAttributesRequest request = AttributeCluster::All("m", 0, {"heat"});
    spoil(request);
    grpc::ClientContext context;
    auto server = cluster_.ServerOf("m", 1);
    auto reader = server->ReadAttributes(&context, request);
    v1::ReadAttributesResponse part;
    while (reader->Read(&part)) {
    }
    ExpectStatus(reader->Finish(), code, text);
  }
  // Two values for two vertices, spoilt; nothing must be written.
  void ExpectWrite(const std::string& name, const std::function<void(v1::WriteAttributeRequest&)>& spoil,
                   StatusCode code, const std::string& text, uint32_t block = 0) {
    const std::vector<CellId> ids = {CellId::Parse("v0:7").value(), CellId::Parse("v0:1").value()};
    v1::WriteAttributeRequest part = AttributeCluster::Part("m", name, ids);
    *part.mutable_values() = ValuesFor(ids,
                                       name == "kind"   ? v1::VALUE_TYPE_CATEGORY
                                       : name == "flow" ? v1::VALUE_TYPE_VEC3
                                                        : v1::VALUE_TYPE_DOUBLE,
                                       1);
    spoil(part);
    v1::WriteAttributeResponse response;
    auto server = cluster_.ServerOf("m", block);
    grpc::ClientContext context;
    auto writer = server->WriteAttribute(&context, &response);
    writer->Write(part);
    writer->WritesDone();
    ExpectStatus(writer->Finish(), code, text);
  }
  Table Values() { return cluster_.ReadTable(AttributeCluster::All("m", 0, {"heat", "flow", "kind"})); }

  AttributeCluster cluster_;
};

TEST_F(AttributeErrorsTest, WrongReads) {
  using R = v1::ReadAttributesRequest;
  ExpectRead([](R& r) { r.set_map("other"); }, StatusCode::NOT_FOUND, "no map \"other\"");
  ExpectRead([](R& r) { r.set_map("../x"); }, StatusCode::INVALID_ARGUMENT, "map");
  ExpectRead([](R& r) { r.set_dimension(4); }, StatusCode::INVALID_ARGUMENT, "dimension 4");
  ExpectRead([](R& r) { r.set_dimension(2); }, StatusCode::NOT_FOUND, "there are @point, @level, @block");
  ExpectRead([](R& r) { r.set_names(0, "hat"); }, StatusCode::NOT_FOUND, "heat, flow, kind");
  ExpectRead([](R& r) { r.set_names(0, "@moon"); }, StatusCode::NOT_FOUND, "@point");
  ExpectRead([](R& r) { r.set_names(0, "@state"); }, StatusCode::INVALID_ARGUMENT, "of hexahedra");
  ExpectRead(
      [](R& r) {
        for (int k = 0; k < 64; ++k) r.add_names("heat");
      },
      StatusCode::INVALID_ARGUMENT, "65 names");
  ExpectRead([](R& r) { r.clear_select(); }, StatusCode::INVALID_ARGUMENT, "expected ids, all or a query");
  ExpectRead([](R& r) { r.mutable_select()->mutable_ids()->add_hi(1); }, StatusCode::INVALID_ARGUMENT,
             "1 upper and 0 lower words");
  ExpectRead(
      [](R& r) {
        for (int k = 0; k < 65537; ++k)
          AttributeCluster::AddIds({CellId::Initial(0)}, r.mutable_select()->mutable_ids());
      },
      StatusCode::INVALID_ARGUMENT, "at most 65536");
  ExpectRead(
      [](R& r) {
        r.mutable_select()->mutable_ids()->add_hi(0);
        r.mutable_select()->mutable_ids()->add_lo(0);
      },
      StatusCode::INVALID_ARGUMENT, "no id of a cell");
  ExpectRead(
      [](R& r) {
        r.mutable_select()->mutable_ids();
        r.mutable_select()->set_by_level(true);
      },
      StatusCode::INVALID_ARGUMENT, "all cells only");
  ExpectRead(
      [](R& r) {
        r.mutable_select()->set_by_level(true);
        r.mutable_select()->set_lowest_level(2);
      },
      StatusCode::INVALID_ARGUMENT, "levels 2 to 0");
  ExpectRead([](R& r) { r.mutable_select()->mutable_query()->add_anchors()->set_text("h99"); },
             StatusCode::NOT_FOUND, "h99");
}

TEST_F(AttributeErrorsTest, WrongWritesWriteNothing) {
  using W = v1::WriteAttributeRequest;
  const Table before = Values();
  const auto invalid = StatusCode::INVALID_ARGUMENT;
  ExpectWrite(
      "heat", [](W& w) { w.set_map("other"); }, StatusCode::NOT_FOUND, "no map \"other\"");
  ExpectWrite(
      "hat", [](W&) {}, StatusCode::NOT_FOUND, "it has heat, flow, kind");
  ExpectWrite(
      "heat", [](W&) {}, StatusCode::FAILED_PRECONDITION, cluster_.Get("m").blocks(0).address(), 1);
  ExpectWrite(
      "heat", [](W& w) { w.mutable_values()->add_doubles(1); }, invalid, "given 3 doubles");
  ExpectWrite(
      "heat", [](W& w) { w.mutable_values()->add_integers(1); }, invalid, "1 integers");
  ExpectWrite(
      "flow", [](W& w) { w.mutable_values()->mutable_doubles()->Truncate(2); }, invalid, "type vec3");
  ExpectWrite(
      "heat", [](W& w) { w.mutable_ids()->add_hi(7); }, invalid, "3 upper and 2 lower");
  ExpectWrite(
      "heat", [](W& w) { w.mutable_ids()->set_lo(1, 0), w.mutable_ids()->set_hi(1, 0); }, invalid,
      "at place 1 are no id");
  ExpectWrite(
      "kind", [](W& w) { w.mutable_values()->set_codes(1, 5); }, invalid, "code 5 of 5");
  ExpectWrite(
      "kind", [](W& w) { w.mutable_values()->set_categories(4, std::string(65, 'x')); }, invalid, "65 bytes");
  ExpectWrite(
      "heat", [](W& w) { w.mutable_select()->mutable_all(); }, invalid, "given both");
  ExpectWrite(
      "heat", [](W& w) { w.clear_ids(), w.mutable_select()->mutable_all(); }, invalid, "expected 1 values");
  ExpectWrite(
      "heat",
      [](W& w) {
        for (int k = 0; k < 65535; ++k) {
          AttributeCluster::AddIds({CellId::Initial(0)}, w.mutable_ids());
          w.mutable_values()->add_doubles(1);
        }
      },
      invalid, "at most 65536");
  EXPECT_EQ(Values(), before);
  // Nobody says anything, or goes on after a selection.
  grpc::ClientContext context;
  v1::WriteAttributeResponse response;
  auto server = cluster_.ServerOf("m", 0);
  auto writer = server->WriteAttribute(&context, &response);
  writer->WritesDone();
  ExpectStatus(writer->Finish(), invalid, "begins with the names");
}

// The part that would be too much changes no block, and others still fit.
TEST_F(AttributeErrorsTest, TooManyCategoriesWriteNothing) {
  const std::vector<CellId> ids = IdsOf(cluster_.ReadTable(AttributeCluster::All("m", 0, {})));
  const auto part = [&](int first, int count) {
    std::vector<CellId> cells;
    v1::WriteAttributeRequest request = AttributeCluster::Part("m", "kind", {});
    for (int k = 0; k < count; ++k) {
      cells.push_back(ids[static_cast<size_t>(k) % ids.size()]);
      request.mutable_values()->add_categories(absl::StrCat("c", first + k));
      request.mutable_values()->add_codes(static_cast<uint32_t>(k));
    }
    AttributeCluster::AddIds(cells, request.mutable_ids());
    return request;
  };
  v1::WriteAttributeResponse response;
  ASSERT_TRUE(cluster_.Write({part(0, 65000)}, &response).ok());
  const auto before = cluster_.InEveryBlock("m", 0, "kind");
  ExpectStatus(cluster_.Write({part(65000, 600)}, &response), StatusCode::RESOURCE_EXHAUSTED,
               "65001 different categories, 600 more are given, and 65536 are possible");
  EXPECT_EQ(cluster_.InEveryBlock("m", 0, "kind"), before);
  EXPECT_TRUE(cluster_.Write({part(64900, 600)}, &response).ok());
  EXPECT_EQ(cluster_.ExpectOneValueEverywhere("m", 0, "kind"), 8u);
}

TEST_F(AttributeErrorsTest, CellsThatAreNotThereAreCounted) {
  std::vector<CellId> ids = {CellId::Parse("v0:7").value()};
  for (int k = 0; k < 12; ++k) ids.push_back(CellId::Parse(absl::StrCat("h", 20 + k)).value());
  ids.push_back(CellId::Parse("e0:1").value());
  v1::WriteAttributeRequest part = AttributeCluster::Part("m", "heat", ids);
  *part.mutable_values() = ValuesFor(ids, v1::VALUE_TYPE_DOUBLE, 1);
  v1::WriteAttributeResponse response;
  ASSERT_TRUE(cluster_.Write({part}, &response).ok());
  EXPECT_EQ(response.written(), 1u);
  EXPECT_EQ(response.missing(), 13u);
  ASSERT_EQ(response.missing_ids_size(), 10);
  EXPECT_EQ(response.missing_ids(0), "h20");
}

TEST_F(AttributeErrorsTest, WrongDefinitions) {
  const auto expect = [&](const std::string& map, const v1::Attribute& attribute, StatusCode code,
                          const std::string& text) {
    uint64_t job = 0;
    ExpectStatus(cluster_.StartDefine(map, attribute, &job), code, text);
  };
  const auto invalid = StatusCode::INVALID_ARGUMENT;
  const v1::Attribute good = AttributeCluster::Attribute("a", 3, v1::VALUE_TYPE_DOUBLE);
  expect("other", good, StatusCode::NOT_FOUND, "no map \"other\"");
  expect("m", AttributeCluster::Attribute("a b", 3, v1::VALUE_TYPE_DOUBLE), invalid, "is no name");
  expect("m", AttributeCluster::Attribute("@a", 3, v1::VALUE_TYPE_DOUBLE), invalid, "is no name");
  expect("m", AttributeCluster::Attribute("a", 4, v1::VALUE_TYPE_DOUBLE), invalid, "dimension 4");
  expect("m", AttributeCluster::Attribute("a", 3, v1::VALUE_TYPE_UNSPECIFIED), invalid, "type 0");
  expect("m", AttributeCluster::Attribute("a", 3, static_cast<v1::ValueType>(9)), invalid, "type 9");
  expect("m", AttributeCluster::Attribute("a", 3, v1::VALUE_TYPE_DOUBLE, v1::SPLIT_RULE_MEAN), invalid,
         "on vertices");
  expect("m", AttributeCluster::Attribute("a", 3, v1::VALUE_TYPE_DOUBLE, static_cast<v1::SplitRule>(9)),
         invalid, "rule 9");
  v1::Attribute filled = good;
  filled.mutable_fill()->add_integers(1);
  expect("m", filled, invalid, "fill of attribute a");
  expect("m", AttributeCluster::Attribute("heat", 3, v1::VALUE_TYPE_DOUBLE), StatusCode::ALREADY_EXISTS,
         "has an attribute heat already");
  uint64_t job = 0;
  ExpectStatus(cluster_.StartDrop("m", "hat", &job), StatusCode::NOT_FOUND, "it has heat, flow, kind");
  ExpectStatus(cluster_.Start("m", {{"attributes", {{"definitions", ""}}}}, &job), invalid,
               "DefineAttribute");
  EXPECT_EQ(cluster_.Get("m").attributes_size(), 3);
  // One job at a time, as always.
  ASSERT_TRUE(cluster_.Start("m", {{"peek", {{"endless", "1"}}}}, &job).ok());
  uint64_t other = 0;
  ExpectStatus(cluster_.StartDefine("m", good, &other), StatusCode::FAILED_PRECONDITION, "is running on map");
  cluster_.Cancel(job);
  EXPECT_EQ(cluster_.Await(job).state(), v1::JOB_STATE_CANCELLED);
}

TEST_F(AttributeErrorsTest, SixtyFourAndNoMore) {
  for (int k = 3; k < 64; ++k) {
    const v1::Job job =
        cluster_.Define("m", AttributeCluster::Attribute(absl::StrCat("a", k), 3, v1::VALUE_TYPE_INT64));
    ASSERT_EQ(job.state(), v1::JOB_STATE_DONE) << job.error();
  }
  uint64_t job = 0;
  ExpectStatus(cluster_.StartDefine("m", AttributeCluster::Attribute("more", 3, v1::VALUE_TYPE_INT64), &job),
               StatusCode::RESOURCE_EXHAUSTED, "64 attributes");
}

// While a job changes the map, values are those of before, and what is of the map itself cannot be told.
TEST_F(AttributeErrorsTest, DuringAJobValuesAreOfBefore) {
  const Table before = Values();
  uint64_t job = 0;
  ASSERT_TRUE(cluster_.Start("m", {{"token", {{"endless", "1"}}}}, &job).ok());
  cluster_.AwaitWork(job);
  EXPECT_EQ(Values(), before);
  ExpectRead([](v1::ReadAttributesRequest& r) { r.set_names(0, "@point"); }, StatusCode::ABORTED,
             "until the job that changes the map has ended");
  cluster_.Cancel(job);
  EXPECT_EQ(cluster_.Await(job).state(), v1::JOB_STATE_CANCELLED);
  EXPECT_EQ(Values(), before);
  EXPECT_EQ(cluster_.ReadTable(AttributeCluster::All("m", 0, {"@point"})).size(), 27u);
}

TEST_F(AttributeErrorsTest, AServerThatIsGone) {
  const std::string address = cluster_.Get("m").blocks(1).address();
  auto home = cluster_.ServerOf("m", 0);
  for (size_t s = 0; s < cluster_.size(); ++s) {
    if (cluster_.server(s).address() == address) cluster_.server(s).Stop();
  }
  v1::ReadAttributesResponse part;
  for (int kind = 0; kind < 2; ++kind) {
    v1::ReadAttributesRequest request = AttributeCluster::All("m", 0, {"heat"});
    if (kind == 1)
      AttributeCluster::AddIds({CellId::Parse("v0:7").value()}, request.mutable_select()->mutable_ids());
    grpc::ClientContext context;
    auto reader = home->ReadAttributes(&context, request);
    while (reader->Read(&part)) {
    }
    ExpectStatus(reader->Finish(), StatusCode::UNAVAILABLE, address);
  }
  v1::AggregateRequest question;
  question.set_map("m");
  question.set_name("heat");
  v1::AggregateResponse aggregate;
  grpc::ClientContext asking;
  ExpectStatus(home->Aggregate(&asking, question, &aggregate), StatusCode::UNAVAILABLE, address);
  const std::vector<CellId> ids = {CellId::Parse("v0:7").value()};
  for (const char* text : {"write again", "could not be brought to all blocks"}) {
    grpc::ClientContext context;
    v1::WriteAttributeResponse response;
    auto writer = home->WriteAttribute(&context, &response);
    v1::WriteAttributeRequest request = AttributeCluster::Part("m", "heat", ids);
    *request.mutable_values() = ValuesFor(ids, v1::VALUE_TYPE_DOUBLE, 1);
    writer->Write(request);
    writer->WritesDone();
    const grpc::Status status = writer->Finish();
    ExpectStatus(status, StatusCode::UNAVAILABLE, text);
    EXPECT_THAT(status.error_message(), HasSubstr(address));
  }
}

// --- The gates by themselves. ---

TEST(AttributeGatesTest, WhatIsNotSettledComesFirst) {
  server::AttributeGates gates;
  ASSERT_TRUE(gates.BeginPart().ok());
  bool reachable = false;
  int tried = 0;
  gates.SetUnsettled([&] {
    ++tried;
    return reachable ? absl::OkStatus() : absl::UnavailableError("still gone");
  });
  gates.EndPart();
  EXPECT_EQ(gates.BeginPart().message(), "still gone");
  EXPECT_EQ(gates.BeginPhase().message(), "still gone");
  gates.EndPhase(0);
  reachable = true;
  EXPECT_TRUE(gates.BeginPart().ok());
  gates.EndPart();
  EXPECT_TRUE(gates.BeginPhase().ok());
  EXPECT_EQ(tried, 3);
}

TEST(AttributeGatesTest, ThePhaseWaitsForPartsAndPartsForThePhase) {
  server::AttributeGates gates;
  EXPECT_EQ(gates.Update().value(), 0u);
  ASSERT_TRUE(gates.BeginPart().ok());
  std::atomic<bool> ended = false;
  std::thread phase([&] {
    EXPECT_TRUE(gates.BeginPhase().ok());
    EXPECT_TRUE(ended);
  });
  // The phase has come, and the part may still be applied.
  while (gates.Update().ok()) std::this_thread::yield();
  EXPECT_EQ(gates.Update().status().code(), absl::StatusCode::kAborted);
  ASSERT_TRUE(gates.BeginApply().ok());
  gates.EndApply();
  ended = true;
  gates.EndPart();
  phase.join();
  EXPECT_EQ(gates.BeginPart().code(), absl::StatusCode::kAborted);
  gates.RunPhase();
  std::thread part([&] {
    EXPECT_TRUE(gates.BeginApply().ok());
    EXPECT_EQ(gates.Update().value(), 7u);
    gates.EndApply();
  });
  gates.EndPhase(7);
  part.join();
  const uint64_t first = gates.NextSequence();
  EXPECT_GT(gates.NextSequence(), first);
}

}  // namespace
}  // namespace ndmap

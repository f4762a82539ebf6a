// SPDX-License-Identifier: Apache-2.0
// Attributes: how values are cut into messages, which server gets them, what is asked again.
#include "client/sdk/attributes.h"

#include <gmock/gmock.h>
#include <grpcpp/server.h>
#include <grpcpp/server_builder.h>
#include <gtest/gtest.h>

#include <memory>
#include <mutex>
#include <numeric>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/sdk/client.h"
#include "client/sdk/connection.h"
#include "ndmap/v1/block_service.grpc.pb.h"
#include "ndmap/v1/coordinator.grpc.pb.h"

namespace ndmap {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

TEST(NewAttributeTest, SaysWhatIsToBeDefined) {
  const v1::Attribute plain = NewAttribute("a").attribute();
  EXPECT_EQ(plain.name(), "a");
  EXPECT_EQ(plain.dimension(), 3u);
  EXPECT_EQ(plain.type(), v1::VALUE_TYPE_DOUBLE);
  EXPECT_EQ(plain.split(), v1::SPLIT_RULE_COPY);
  EXPECT_FALSE(plain.has_fill());
  const v1::Attribute vector = NewAttribute("v").OnVertices().OfVectors().Mean().Fill({1, 2, 3}).attribute();
  EXPECT_EQ(vector.dimension(), 0u);
  EXPECT_THAT(vector.fill().doubles(), ElementsAre(1, 2, 3));
  // The last word counts.
  const v1::Attribute text = NewAttribute("t").OnFaces().Fill(7).OfCategories().Fill("rock").attribute();
  EXPECT_THAT(text.fill().integers(), IsEmpty());
  EXPECT_THAT(text.fill().codes(), ElementsAre(0));
  EXPECT_THAT(text.fill().categories(), ElementsAre("rock"));
}

TEST(AttributeColumnTest, AccessorsSayWhenTheTypeIsAnother) {
  AttributeColumn column = AttributeColumn::Texts({"b", "a", "b"});
  column.name = "rock";
  EXPECT_THAT(column.codes, ElementsAre(0, 1, 0));
  EXPECT_THAT(*column.AsTexts(), ElementsAre("b", "a", "b"));
  const absl::Status status = column.AsDoubles().status();
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(status.message(), "values of 'rock' are of type category, not double");
  EXPECT_THAT(*AttributeColumn::Vectors({{1, 2, 3}, {4, 5, 6}}).AsVectors(),
              ElementsAre(ElementsAre(1, 2, 3), ElementsAre(4, 5, 6)));
  EXPECT_THAT(*AttributeColumn::Integers({-1}).AsIntegers(), ElementsAre(-1));
  // Without cells there is no type to be wrong.
  EXPECT_THAT(*AttributeColumn().AsVectors(), IsEmpty());
}

TEST(AttributeColumnTest, PartsOfAColumnKeepTheirOwnCategories) {
  const v1::Values values = internal::ToValues(AttributeColumn::Texts({"a", "b", "c", "b"}), 1, 4);
  EXPECT_THAT(values.codes(), ElementsAre(0, 1, 0));
  EXPECT_THAT(values.categories(), ElementsAre("b", "c"));
  EXPECT_THAT(internal::ToValues(AttributeColumn::Vectors({{1, 2, 3}, {4, 5, 6}}), 1, 2).doubles(),
              ElementsAre(4, 5, 6));
}

TEST(AttributeColumnTest, AnswersThatMakeNoSenseAreRefused) {
  v1::ReadAttributesResponse part;
  part.add_cell_hi(1);
  part.add_cell_lo(2);
  const auto refused = [&](const char* what) {
    const absl::Status status = internal::ToCellValues(part, {"x"}, "the server").status();
    EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss);
    EXPECT_THAT(status.message(), HasSubstr(what));
  };
  refused("0 columns for 1 names");
  part.add_columns()->add_codes(1);
  part.mutable_columns(0)->add_categories("only");
  refused("'x' has no value for each of 1 cells");
  part.mutable_columns(0)->Clear();
  part.mutable_columns(0)->add_doubles(1);
  part.mutable_columns(0)->add_doubles(1);
  refused("'x' has no value for each of 1 cells");
  part.mutable_columns(0)->add_doubles(1);
  EXPECT_EQ(internal::ToCellValues(part, {"x"}, "")->columns[0].type, v1::VALUE_TYPE_VEC3);
  part.add_missing(1);
  refused("beyond the end");
  part.clear_missing();
  part.add_cell_hi(1);
  refused("half an id");
}

class FakeAttributeCoordinator final : public v1::Coordinator::Service {
 public:
  grpc::Status GetVersion(grpc::ServerContext*, const v1::GetVersionRequest*,
                          v1::GetVersionResponse* response) override {
    *response->mutable_version() = internal::SdkVersion();
    return grpc::Status::OK;
  }
  grpc::Status GetMap(grpc::ServerContext*, const v1::GetMapRequest*, v1::GetMapResponse* response) override {
    *response->mutable_map() = map;
    return grpc::Status::OK;
  }
  grpc::Status DefineAttribute(grpc::ServerContext*, const v1::DefineAttributeRequest* request,
                               v1::DefineAttributeResponse* response) override {
    ++defines;
    if (request->attribute().name() == "there") return {grpc::StatusCode::ALREADY_EXISTS, "it is there"};
    if (request->attribute().name() == "gone") return {grpc::StatusCode::UNAVAILABLE, "nobody"};
    *map.add_attributes() = request->attribute();
    response->mutable_job()->set_job(8);
    return grpc::Status::OK;
  }
  grpc::Status DropAttribute(grpc::ServerContext*, const v1::DropAttributeRequest* request,
                             v1::DropAttributeResponse* response) override {
    EXPECT_EQ(request->map(), "m");
    EXPECT_EQ(request->name(), "a");
    response->mutable_job()->set_job(9);
    return grpc::Status::OK;
  }
  v1::Map map;
  int defines = 0;
};

// Answers with the lower words of ids as values, in parts of at most `part` cells; fails the calls that it is
// told to, after some parts.
class FakeAttributeBlocks final : public v1::BlockService::Service {
 public:
  grpc::Status GetVersion(grpc::ServerContext*, const v1::GetVersionRequest*,
                          v1::GetVersionResponse* response) override {
    *response->mutable_version() = internal::SdkVersion();
    return grpc::Status::OK;
  }
  grpc::Status ReadAttributes(grpc::ServerContext*, const v1::ReadAttributesRequest* request,
                              grpc::ServerWriter<v1::ReadAttributesResponse>* writer) override {
    const std::lock_guard<std::mutex> lock(mutex);
    EXPECT_EQ(request->map(), "m");
    asked.push_back(*request);
    std::vector<uint64_t> ids(all);
    std::iota(ids.begin(), ids.end(), 0);
    if (request->select().has_ids())
      ids.assign(request->select().ids().lo().begin(), request->select().ids().lo().end());
    const bool fails = static_cast<int>(asked.size()) <= failures;
    for (size_t at = 0, parts = 0; at < ids.size(); ++parts) {
      if (fails && parts == parts_before_failure) break;
      v1::ReadAttributesResponse response;
      response.add_columns();
      for (size_t end = std::min(ids.size(), at + part); at < end; ++at) {
        response.add_cell_hi(0);
        response.add_cell_lo(ids[at]);
        response.mutable_columns(0)->add_integers(static_cast<int64_t>(ids[at]));
      }
      writer->Write(response);
    }
    return fails ? end : grpc::Status::OK;
  }
  grpc::Status WriteAttribute(grpc::ServerContext*, grpc::ServerReader<v1::WriteAttributeRequest>* reader,
                              v1::WriteAttributeResponse* response) override {
    const std::lock_guard<std::mutex> lock(mutex);
    std::vector<v1::WriteAttributeRequest> messages;
    v1::WriteAttributeRequest message;
    while (reader->Read(&message)) {
      response->set_written(response->written() + static_cast<uint64_t>(message.ids().lo_size()));
      messages.push_back(message);
    }
    written.push_back(std::move(messages));
    response->set_missing(1);
    response->add_missing_ids("h9");
    return static_cast<int>(written.size()) <= failures ? end : grpc::Status::OK;
  }
  grpc::Status Aggregate(grpc::ServerContext*, const v1::AggregateRequest* request,
                         v1::AggregateResponse* response) override {
    const std::lock_guard<std::mutex> lock(mutex);
    EXPECT_EQ(request->map(), "m");
    if (++aggregates <= failures) return end;
    response->add_groups()->set_count(5);
    return grpc::Status::OK;
  }

  std::mutex mutex;
  size_t all = 5, part = 2, parts_before_failure = 0;
  int failures = 0, aggregates = 0;
  grpc::Status end{grpc::StatusCode::ABORTED, "being brought up to date"};
  std::vector<v1::ReadAttributesRequest> asked;
  std::vector<std::vector<v1::WriteAttributeRequest>> written;
};

class AttributeCallTest : public ::testing::Test {
 protected:
  AttributeCallTest() {
    coordinator_.map.set_map("m");
    coordinator_.map.set_block_count(2);
    for (uint32_t block = 0; block < 2; ++block) {
      v1::BlockPlacement* placement = coordinator_.map.add_blocks();
      placement->set_block(block);
      placement->set_address(Serve(&blocks_[block]));
    }
    ClientOptions options;
    options.first_pause = absl::Milliseconds(1);
    options.call_timeout = absl::Seconds(10);
    map_ = std::make_unique<MapHandle>(Client::Connect(Serve(&coordinator_), options)->OpenMap("m").value());
  }
  std::string Serve(grpc::Service* service) {
    grpc::ServerBuilder builder;
    int port = 0;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
    builder.SetMaxReceiveMessageSize(internal::kMaxMessageBytes);
    builder.RegisterService(service);
    servers_.push_back(builder.BuildAndStart());
    return absl::StrCat("127.0.0.1:", port);
  }
  void FailAll(int failures, size_t parts, grpc::Status end) {
    for (FakeAttributeBlocks& blocks : blocks_) {
      blocks.failures = failures;
      blocks.parts_before_failure = parts;
      blocks.end = end;
    }
  }
  // All values of a reader, and its error.
  static absl::Status Collect(AttributeReader reader, std::vector<int64_t>* values) {
    for (absl::StatusOr<CellValues>& part : reader) {
      if (!part.ok()) return part.status();
      EXPECT_EQ(part->columns[0].type, v1::VALUE_TYPE_INT64);
      for (int64_t value : part->columns[0].integers) values->push_back(value);
    }
    return absl::OkStatus();
  }
  static CellIds Ids(size_t count) {
    CellIds ids;
    for (size_t i = 0; i < count; ++i) ids.Add(0, i);
    return ids;
  }
  int Reads() const { return static_cast<int>(blocks_[0].asked.size() + blocks_[1].asked.size()); }

  FakeAttributeCoordinator coordinator_;
  FakeAttributeBlocks blocks_[2];
  std::vector<std::unique_ptr<grpc::Server>> servers_;
  std::unique_ptr<MapHandle> map_;
};

TEST_F(AttributeCallTest, DefinitionsAreJobsAndAreNotAskedForTwice) {
  const auto job = map_->DefineAttribute(NewAttribute("a").OnVertices().OfIntegers());
  ASSERT_TRUE(job.ok()) << job.status();
  EXPECT_EQ(job->id(), 8u);
  EXPECT_EQ(map_->DefineAttribute(NewAttribute("there")).status().code(), absl::StatusCode::kAlreadyExists);
  EXPECT_EQ(map_->DefineAttribute(NewAttribute("gone")).status().code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(coordinator_.defines, 3);
  EXPECT_EQ(map_->DropAttribute("a")->id(), 9u);
  // As it is now, not as it was when the handle was made.
  EXPECT_EQ(map_->info().attributes_size(), 0);
  ASSERT_EQ(map_->ListAttributes()->size(), 1u);
  EXPECT_EQ(map_->ListAttributes()->front().name(), "a");
}

TEST_F(AttributeCallTest, PartsAreARange) {
  std::vector<int64_t> values;
  EXPECT_TRUE(Collect(map_->ReadAttributes(3, {"a"}, AllCells()), &values).ok());
  EXPECT_THAT(values, ElementsAre(0, 1, 2, 3, 4));
  const v1::ReadAttributesRequest& asked =
      blocks_[0].asked.empty() ? blocks_[1].asked[0] : blocks_[0].asked[0];
  EXPECT_TRUE(asked.select().has_all());
  EXPECT_EQ(asked.dimension(), 3u);
  EXPECT_THAT(asked.names(), ElementsAre("a"));
}

TEST_F(AttributeCallTest, ARangeMayBeLeftEarly) {
  blocks_[0].all = blocks_[1].all = 100000;
  AttributeReader reader = map_->ReadAttributes(3, {"a"}, AllCells());
  auto part = reader.begin();
  ASSERT_FALSE(part == reader.end());
  ASSERT_TRUE(part->ok());
  EXPECT_THAT((*part)->cells.lo, ElementsAre(0, 1));
}

TEST_F(AttributeCallTest, IdsAreAskedForInMessagesThatServersTake) {
  blocks_[0].part = blocks_[1].part = 50000;
  std::vector<int64_t> values;
  EXPECT_TRUE(Collect(map_->ReadAttributes(0, {"a"}, TheseCells(Ids(140000))), &values).ok());
  ASSERT_THAT(values, SizeIs(140000));
  for (size_t i = 0; i < values.size(); ++i) ASSERT_EQ(values[i], static_cast<int64_t>(i));
  EXPECT_EQ(Reads(), 3);
  for (const FakeAttributeBlocks& blocks : blocks_) {
    for (const v1::ReadAttributesRequest& asked : blocks.asked) {
      EXPECT_LE(asked.select().ids().hi_size(), 65536);
      EXPECT_EQ(asked.select().ids().hi_size(), asked.select().ids().lo_size());
    }
  }
}

TEST_F(AttributeCallTest, ReadingIdsGoesOnWhereItWas) {
  FailAll(3, 1, {grpc::StatusCode::ABORTED, "being brought up to date"});
  std::vector<int64_t> values;
  EXPECT_TRUE(Collect(map_->ReadAttributes(0, {"a"}, TheseCells(Ids(20))), &values).ok());
  ASSERT_THAT(values, SizeIs(20));
  for (size_t i = 0; i < values.size(); ++i) EXPECT_EQ(values[i], static_cast<int64_t>(i));
  EXPECT_EQ(Reads(), 7);
}

TEST_F(AttributeCallTest, AllCellsAreAskedForAgainUntilAPartWasHandedOver) {
  FailAll(2, 0, {grpc::StatusCode::ABORTED, "being brought up to date"});
  std::vector<int64_t> values;
  EXPECT_TRUE(Collect(map_->ReadAttributes(3, {"a"}, AllCells()), &values).ok());
  EXPECT_THAT(values, SizeIs(5));
  EXPECT_EQ(Reads(), 5);

  FailAll(1000, 1, {grpc::StatusCode::ABORTED, "being brought up to date"});
  values.clear();
  const absl::Status status = Collect(map_->ReadAttributes(3, {"a"}, AllCells()), &values);
  EXPECT_EQ(status, absl::AbortedError("being brought up to date"));
  EXPECT_THAT(values, SizeIs(2));
  EXPECT_EQ(Reads(), 6);
}

TEST_F(AttributeCallTest, OtherErrorsAndSilenceAreFinal) {
  FailAll(1000, 0, {grpc::StatusCode::FAILED_PRECONDITION, "no attribute"});
  std::vector<int64_t> values;
  EXPECT_EQ(Collect(map_->ReadAttributes(3, {"a"}, AllCells()), &values).message(), "no attribute");
  EXPECT_EQ(Reads(), 1);
  FailAll(1000, 0, {grpc::StatusCode::UNAVAILABLE, "a server is gone"});
  EXPECT_EQ(Collect(map_->ReadAttributes(3, {"a"}, AllCells()), &values).code(),
            absl::StatusCode::kUnavailable);
  EXPECT_EQ(Reads(), 4);
  EXPECT_EQ(map_->Aggregate({}).status().code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(blocks_[0].aggregates + blocks_[1].aggregates, 3);
}

TEST_F(AttributeCallTest, WritesGoToTheServerOfBlock0InMessagesThatItTakes) {
  const size_t count = 140000;
  std::vector<double> values(count);
  std::iota(values.begin(), values.end(), 0.0);
  const auto answer = map_->WriteAttribute("a", Ids(count), AttributeColumn::Doubles(values));
  ASSERT_TRUE(answer.ok()) << answer.status();
  EXPECT_EQ(answer->written(), count);
  EXPECT_EQ(answer->missing(), 1u);
  EXPECT_THAT(answer->missing_ids(), ElementsAre("h9"));
  EXPECT_TRUE(blocks_[1].written.empty());
  ASSERT_EQ(blocks_[0].written.size(), 1u);
  const std::vector<v1::WriteAttributeRequest>& messages = blocks_[0].written[0];
  ASSERT_EQ(messages.size(), 4u);
  EXPECT_EQ(messages[0].map(), "m");
  EXPECT_EQ(messages[0].name(), "a");
  EXPECT_FALSE(messages[0].has_ids());
  size_t next = 0;
  for (size_t i = 1; i < messages.size(); ++i) {
    ASSERT_EQ(messages[i].ids().lo_size(), messages[i].values().doubles_size());
    EXPECT_LE(messages[i].ids().lo_size(), 65536);
    for (double value : messages[i].values().doubles()) ASSERT_EQ(value, static_cast<double>(next++));
  }
  EXPECT_EQ(next, count);
}

TEST_F(AttributeCallTest, WritesAreTriedAgainForTheyAreHarmlessTwice) {
  FailAll(2, 0, {grpc::StatusCode::ABORTED, "being brought up to date"});
  EXPECT_EQ(map_->WriteAttribute("a", Ids(3), AttributeColumn::Integers({1, 2, 3}))->written(), 3u);
  EXPECT_EQ(blocks_[0].written.size(), 3u);
  FailAll(1000, 0, {grpc::StatusCode::NOT_FOUND, "no attribute a"});
  EXPECT_EQ(map_->WriteAttribute("a", Ids(3), AttributeColumn::Integers({1, 2, 3})).status().message(),
            "no attribute a");
  EXPECT_EQ(blocks_[0].written.size(), 4u);
}

TEST_F(AttributeCallTest, LongWritesAreSeveralCallsWithOneAnswer) {
  const size_t count = 16 * 65536 + 1;
  const auto answer =
      map_->WriteAttribute("a", Ids(count), AttributeColumn::Integers(std::vector<int64_t>(count)));
  ASSERT_TRUE(answer.ok()) << answer.status();
  EXPECT_EQ(blocks_[0].written.size(), 2u);
  EXPECT_EQ(answer->written(), count);
  EXPECT_EQ(answer->missing(), 2u);
  EXPECT_THAT(answer->missing_ids(), ElementsAre("h9", "h9"));
}

TEST_F(AttributeCallTest, ValuesThatDoNotFitAreRefusedHere) {
  const auto refused = [&](const absl::StatusOr<v1::WriteAttributeResponse>& answer) {
    EXPECT_EQ(answer.status().code(), absl::StatusCode::kInvalidArgument) << answer.status();
  };
  refused(map_->WriteAttribute("a", Ids(3), AttributeColumn::Integers({1, 2})));
  AttributeColumn column = AttributeColumn::Texts({"x"});
  column.codes[0] = 1;
  refused(map_->WriteAttribute("a", Ids(1), column));
  refused(map_->SetAttribute("a", AllCells(), AttributeColumn::Integers({1, 2})));
  EXPECT_TRUE(blocks_[0].written.empty());
}

TEST_F(AttributeCallTest, OneValueForASelectionOrForIds) {
  ASSERT_TRUE(map_->SetAttribute("a", CellsOfLevels(1, 2), AttributeColumn::Texts({"x"})).ok());
  ASSERT_EQ(blocks_[0].written[0].size(), 1u);
  const v1::WriteAttributeRequest& message = blocks_[0].written[0][0];
  EXPECT_EQ(message.map(), "m");
  EXPECT_EQ(message.select().lowest_level(), 1u);
  EXPECT_EQ(message.select().highest_level(), 2u);
  EXPECT_THAT(message.values().categories(), ElementsAre("x"));
  ASSERT_TRUE(map_->SetAttribute("a", TheseCells(Ids(2)), AttributeColumn::Vectors({{1, 2, 3}})).ok());
  EXPECT_THAT(blocks_[0].written[1][1].values().doubles(), ElementsAre(1, 2, 3, 1, 2, 3));
}

}  // namespace
}  // namespace ndmap

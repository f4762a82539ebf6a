// SPDX-License-Identifier: GPL-3.0-or-later
// The SDK's view of a map in the client's memory, against the services' own walks.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>
#include <thread>

#include "absl/container/flat_hash_set.h"
#include "client/sdk/client.h"
#include "client/sdk/navigator.h"
#include "tests/service/cluster.h"

namespace ndmap {
namespace {

using Dart = Navigator::Dart;

class NavigatorTest : public ::testing::Test {
 protected:
  NavigatorTest() : cluster_(3), client_(Client::Connect(cluster_.coordinator().address()).value()) {}

  explicit NavigatorTest(server::ServiceOptions service)
      : cluster_(3, {}, {}, service), client_(Client::Connect(cluster_.coordinator().address()).value()) {}

  // A refined map; more than one chunk of hexahedra in a block.
  MapHandle Make(const std::string& name, uint32_t blocks, v1::Routing routing = v1::ROUTING_DIRECT) {
    v1::CreateMapRequest request = Cluster::GridRequest(name, blocks, 3);
    request.set_routing(routing);
    EXPECT_EQ(cluster_.Create(request).state(), v1::JOB_STATE_DONE);
    Refine(name, 3);
    return client_.OpenMap(name).value();
  }
  void Refine(const std::string& name, int depth) {
    const Cluster::Values sphere = {
        {"oracle", "sphere"}, {"centre", "0.3,0.2,0.1"}, {"radius", "2"}, {"depth", absl::StrCat(depth)}};
    const v1::Job job = cluster_.Run(name, {{"refine", sphere}});
    ASSERT_EQ(job.state(), v1::JOB_STATE_DONE) << job.error();
  }

  // Every dart that beta leads to from some dart.
  std::vector<Dart> Traverse(Navigator& view, Dart start) {
    absl::flat_hash_set<Dart> seen = {start};
    std::vector<Dart> queue = {start};
    for (size_t i = 0; i < queue.size(); ++i) {
      for (int b = 0; b <= 3; ++b) {
        const absl::StatusOr<Dart> next = view.Beta(queue[i], b);
        if (!next.ok()) {
          ADD_FAILURE() << next.status();
          return queue;
        }
        if (!next->is_free() && seen.insert(*next).second) queue.push_back(*next);
      }
    }
    return queue;
  }

  // From a dart of block 0 the view leads through the whole map, as the services do.
  void ExpectTheServices(const MapHandle& map) {
    uint64_t darts = 0, hexahedra = 0;
    const std::vector<v1::BlockStats> blocks_now = map.Stats().value();
    for (const v1::BlockStats& stats : blocks_now) {
      darts += stats.darts();
      hexahedra += stats.hexahedra();
    }
    Navigator view(map);
    const absl::StatusOr<Dart> start = view.DartOf(map.AnyDart(0)->dart());
    ASSERT_TRUE(start.ok()) << start.status();
    const std::vector<Dart> all = Traverse(view, *start);
    ASSERT_EQ(all.size(), darts);
    EXPECT_EQ(view.counters().darts, darts);
    EXPECT_EQ(view.counters().hexahedra, hexahedra);

    std::vector<v1::DartRef> references(all.size());
    for (size_t i = 0; i < all.size(); ++i) {
      references[i].set_block(all[i].block);
      references[i].set_dart(all[i].index);
    }
    std::set<std::string> cells;
    for (uint8_t b = 0; b <= 3; ++b) {
      const auto walked = map.Beta(references, {b});
      ASSERT_TRUE(walked.ok()) << walked.status();
      for (size_t i = 0; i < all.size(); ++i) {
        const Walked& expected = (*walked)[i];
        const Dart next = view.Beta(all[i], b).value();
        ASSERT_EQ(next.is_free(), expected.free);
        if (next.is_free()) continue;
        const Dart there{expected.at.dart().block(), expected.at.dart().dart()};
        ASSERT_EQ(next, there) << "beta " << int{b};
        EXPECT_EQ(view.Point(next).value(),
                  (std::array<double, 3>{expected.at.x(), expected.at.y(), expected.at.z()}));
        const CellId id = CellId::FromWords((*view.CellOf(next))->id.hi(), (*view.CellOf(next))->id.lo());
        ASSERT_EQ(id.ToString(), expected.at.cell());
        cells.insert(id.ToString());
      }
    }
    EXPECT_EQ(cells.size(), hexahedra);
  }

  Cluster cluster_;
  Client client_;
};

TEST_F(NavigatorTest, LeadsWhereTheServicesLead) {
  for (const auto& [name, blocks, routing] :
       {std::tuple("one", 1u, v1::ROUTING_DIRECT), std::tuple("seven", 7u, v1::ROUTING_DIRECT),
        std::tuple("broadcast", 4u, v1::ROUTING_BROADCAST)}) {
    SCOPED_TRACE(name);
    ExpectTheServices(Make(name, blocks, routing));
  }
}

class SmallPartsTest : public NavigatorTest {
 protected:
  static constexpr uint64_t kDarts = 100;
  static server::ServiceOptions Small() {
    server::ServiceOptions options;
    options.max_query_darts = kDarts;
    return options;
  }
  SmallPartsTest() : NavigatorTest(Small()) {}
};

// A hexahedron beside much finer ones has more darts than any message may have; once it made its whole chunk
// unreadable.
TEST_F(SmallPartsTest, HexahedraOfMoreDartsThanOnePartAreWalked) {
  const MapHandle map = Make("m", 3);
  int continued = 0;
  for (uint32_t block = 0; block < 3; ++block) {
    v1::FetchCellsRequest request;
    *request.mutable_dart() = map.AnyDart(block)->dart();
    const auto parts = map.FetchCells(request);
    ASSERT_TRUE(parts.ok()) << parts.status();
    for (const v1::FetchCellsResponse& part : *parts) {
      EXPECT_LE(part.darts().size(), 4 * kDarts);
      EXPECT_GT(part.darts().size(), 0);
      EXPECT_EQ(part.version(), parts->front().version());
      continued += part.continued() ? 1 : 0;
    }
    EXPECT_FALSE(parts->front().continued());
  }
  EXPECT_GT(continued, 0);
  ExpectTheServices(map);
}

TEST_F(NavigatorTest, ManyThreadsSeeOneMap) {
  const MapHandle map = Make("m", 5);
  Navigator view(map);
  const Dart start = view.DartOf(map.AnyDart(0)->dart()).value();
  std::vector<size_t> found(4);
  std::vector<std::thread> threads;
  for (size_t t = 0; t < found.size(); ++t) {
    threads.emplace_back([&, t] { found[t] = Traverse(view, start).size(); });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_THAT(found, ::testing::Each(view.counters().darts));
}

TEST_F(NavigatorTest, AViewOfAnEarlierVersionNeverAnswersWrongly) {
  const MapHandle map = Make("m", 2);
  Navigator view(map);
  const v1::DartRef old = map.AnyDart(0)->dart();
  ASSERT_TRUE(view.DartOf(old).ok());
  const v1::DartRef other = map.AnyDart(1)->dart();
  Refine("m", 4);
  // What was not fetched is of another version now; what was is as it was.
  EXPECT_EQ(view.Beta({other.block(), other.dart()}, 1).status().code(),
            absl::StatusCode::kFailedPrecondition);
  EXPECT_TRUE(view.DartOf(old).ok());
  EXPECT_EQ(view.DartOf(map.AnyDart(0)->dart()).status().code(), absl::StatusCode::kFailedPrecondition);
  view.Refresh();
  EXPECT_EQ(view.DartOf(old).status().code(), absl::StatusCode::kFailedPrecondition);
  view.Refresh();
  EXPECT_TRUE(view.DartOf(map.AnyDart(0)->dart()).ok());
}

TEST_F(NavigatorTest, WrongDartsAreTypedErrors) {
  const MapHandle map = Make("m", 2);
  Navigator view(map);
  const Dart start = view.DartOf(map.AnyDart(0)->dart()).value();
  EXPECT_EQ(view.Beta(start, 4).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(view.Beta(start, -1).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(view.Beta({9, 1}, 1).status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(view.Beta({0, 4000000000u}, 1).status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(view.Beta({0, Dart::kFree}, 1).status().code(), absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace ndmap

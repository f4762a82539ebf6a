// SPDX-License-Identifier: GPL-3.0-or-later
// A block server that is killed in the middle of a stream: one typed error with one sentence, never half an
// answer that passes for a whole one.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "client/sdk/client.h"
#include "client/sdk/explore.h"
#include "client/sdk/navigator.h"
#include "tests/cli/map_cluster.h"

namespace ndmap::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

// With a map "big" whose answers are many times what gRPC sends ahead of the reader.
class LostServerTest : public ::testing::Test {
 protected:
  LostServerTest() {
    cluster_.Do({"create", "big", cluster_.surface(), "--grid", "60x60x60", "--blocks", "2"});
    ClientOptions options;
    options.first_pause = absl::Milliseconds(1);
    map_ = Client::Connect(cluster_.coordinator(), options)->OpenMap("big").value();
    const std::vector<v1::ProcessStats> servers = map_->ServerStats().value();
    for (const v1::ProcessStats& stats : servers) {
      if (stats.address() == map_->info().blocks(0).address()) pid_ = static_cast<pid_t>(stats.pid());
    }
    EXPECT_NE(pid_, 0);
  }
  // The server of block 0, at once.
  void Kill() { EXPECT_EQ(kill(pid_, SIGKILL), 0); }

  void ExpectLost(const absl::Status& status) {
    EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable) << status;
    EXPECT_THAT(std::string(status.message()),
                HasSubstr(absl::StrCat("the block server at ", map_->info().blocks(0).address())));
    EXPECT_THAT(std::string(status.message()), Not(HasSubstr("\n")));
  }

  MapCluster cluster_;
  absl::StatusOr<MapHandle> map_ = absl::UnknownError("not opened");
  pid_t pid_ = 0;
};

// About 12,000 hexahedra of block 0.
v1::ExploreRequest Many() {
  v1::ExploreRequest request;
  request.set_dimension(3);
  for (uint32_t id = 0; id < 12000; ++id) *request.add_anchors() = CellAnchor(absl::StrCat("h", id));
  request.add_close(3);
  request.set_give(v1::GIVE_CELL_DETAILS);
  return request;
}

TEST_F(LostServerTest, AnAnswerThatIsCutOffIsAnError) {
  v1::ExploreRequest request = Many();
  // Its server is that of the first anchor which is in a block.
  *request.add_anchors() = DartAnchor(map_->AnyDart(0)->dart());
  int parts = 0, cells = 0;
  const absl::Status status = map_->Explore(request, [&](const v1::ExploreResponse& part) {
    if (parts++ == 0) Kill();
    cells += part.cells_size();
    return absl::OkStatus();
  });
  ExpectLost(status);
  EXPECT_GT(cells, 0);
  EXPECT_LT(cells, 12000);
  // And nobody is there for the next question.
  ExpectLost(map_->Explore(request).status());
}

TEST_F(LostServerTest, APieceThatIsCutOffIsAnError) {
  uint64_t bytes = 0;
  const auto summary = map_->ExportPiece(0, {{"cells", "polyhedron"}}, [&](absl::string_view data) {
    if (bytes == 0) Kill();
    bytes += data.size();
    return absl::OkStatus();
  });
  ExpectLost(summary.status());
  EXPECT_GT(bytes, 0u);
}

// Whichever server is asked, it needs the other one.
TEST_F(LostServerTest, ValuesThatAreCutOffEndWithTheError) {
  v1::CellSelection all = AllCells();
  uint64_t cells = 0;
  absl::Status status;
  for (const absl::StatusOr<CellValues>& part : map_->ReadAttributes(3, {"@point"}, all)) {
    if (!part.ok()) {
      status = part.status();
      break;
    }
    if (cells == 0) Kill();
    cells += part->cells.size();
  }
  ExpectLost(status);
  EXPECT_GT(cells, 0u);
  EXPECT_LT(cells, 216000u);
  v1::AggregateRequest count;
  count.set_dimension(0);
  // The cluster stops when one of its servers is gone, so by now it may be either that is missed.
  const absl::Status lost = map_->Aggregate(count).status();
  EXPECT_EQ(lost.code(), absl::StatusCode::kUnavailable) << lost;
  EXPECT_THAT(std::string(lost.message()), HasSubstr("the block server at "));
  EXPECT_THAT(std::string(lost.message()), Not(HasSubstr("\n")));
}

TEST_F(LostServerTest, ANavigatorSaysThatItCannotGoOn) {
  const v1::DartRef start = map_->AnyDart(0)->dart();
  Kill();
  Navigator navigator(*map_);
  ExpectLost(navigator.Beta({start.block(), start.dart()}, 1).status());
}

TEST_F(LostServerTest, TheCommandLineSaysSoInOneLine) {
  Kill();
  EXPECT_THAT(cluster_.Fails({"orbit", "big", "0:1", "-i", "0"}), HasSubstr("ndmap orbit: the "));
}

TEST_F(LostServerTest, MapsOfAServerThatWasStoppedAreShownAsLost) {
  EXPECT_EQ(cluster_.Do({"maps"})["maps"][0]["state"], "ready");
  EXPECT_EQ(kill(pid_, SIGTERM), 0);
  nlohmann::json map;
  const absl::Time end = absl::Now() + absl::Minutes(1);
  do {
    map = cluster_.Do({"maps"})["maps"][0];
  } while (map["state"] == "ready" && absl::Now() < end);
  EXPECT_EQ(map["state"], "lost");
  // It has said so: nobody waited for the end of its lease.
  EXPECT_THAT(map["error"].get<std::string>(), HasSubstr("was stopped and has lost its blocks"));
}

}  // namespace
}  // namespace ndmap::testing

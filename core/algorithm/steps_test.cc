// SPDX-License-Identifier: GPL-3.0-or-later
// No call of an algorithm does more than its budget, whatever the size of the block: counted, not timed. And
// what a cancelled algorithm leaves and reports.
#include <memory>
#include <string>
#include <vector>

#include "core/algorithm/build/build.h"
#include "core/algorithm/registry.h"
#include "core/attributes/table.h"
#include "core/geometry/surface_caches.h"
#include "core/io/sample_surface.h"
#include "core/names/mesh_cells.h"
#include "gtest/gtest.h"

namespace ndmap {
namespace {

class Bin final : public Outbox {
 public:
  void Send(BlockId, const Message&) override {}
  void Broadcast(const Message&) override {}
};

// One block of two, a grid of 6 x 6 x 6 cut through the middle.
class StepsTest : public testing::Test {
 protected:
  static constexpr uint32_t kSide = 6;

  StepsTest() {
    surface_ = std::make_shared<const TriangleSurface>(MakeSample("sphere", {.triangles = 200}).value());
    Build();
  }

  void Build() {
    auto build = MakeBuild();
    ASSERT_TRUE(build->Start(1).value());
    while (build->HasWork()) ASSERT_TRUE(build->Work(1, bin_).ok());
  }
  std::unique_ptr<BlockAlgorithm> MakeBuild() {
    std::vector<uint32_t> block_of;
    for (uint32_t i = 0; i < kSide * kSide * kSide; ++i) block_of.push_back(i < kHere ? 0 : 1);
    const Box3 box = BoundingBox(*surface_);
    GridShape grid;
    grid.cells = {kSide, kSide, kSide};
    grid.lo = box.lo;
    grid.hi = box.hi;
    return Make("build", GridParameters(grid, Assignment::FromTable(block_of)));
  }
  std::unique_ptr<BlockAlgorithm> Make(const std::string& name, const Parameters& parameters = {},
                                       Routing routing = Routing::kDirect) {
    Environment environment{BlockId{0}, 2, routing, surface_, std::make_shared<IndexCache>(), parity_};
    return MakeAlgorithm(name, parameters, environment, block_).value();
  }
  static size_t Starts(BlockAlgorithm& algorithm) {
    for (size_t calls = 1;; ++calls) {
      if (algorithm.Start(1).value()) return calls;
    }
  }
  size_t Works(BlockAlgorithm& algorithm) {
    size_t calls = 0;
    for (; algorithm.HasWork(); ++calls) EXPECT_LE(algorithm.Work(1, bin_).value(), 1u);
    return calls;
  }

  static constexpr size_t kHere = kSide * kSide * kSide / 2;
  static constexpr size_t kCritical = kSide * kSide * 4;
  Bin bin_;
  std::shared_ptr<const TriangleSurface> surface_;
  std::shared_ptr<ParityCache> parity_ = std::make_shared<ParityCache>();
  Block3 block_{BlockId{0}};
};

TEST_F(StepsTest, StartLooksAtACellAStep) {
  EXPECT_EQ(Starts(*Make("refine", Parameters().Set("depth", int64_t{1}))), kHere);
  EXPECT_EQ(Starts(*Make("refine", Parameters().Set("depth", int64_t{1}), Routing::kBroadcast)),
            kHere + kCritical);
  EXPECT_EQ(Starts(*Make("classify")), kHere);
  EXPECT_EQ(Starts(*Make("trim", Parameters().Set("keep", "all"))), kHere);
  EXPECT_EQ(Starts(*Make("count")), kHere + kCritical);
}

TEST_F(StepsTest, CheckAndHashLookAtADartAStep) {
  for (const char* name : {"check", "hash"}) {
    auto algorithm = Make(name);
    Starts(*algorithm);
    EXPECT_GE(Works(*algorithm), kHere * 24) << name;
  }
}

TEST_F(StepsTest, AttributesLookAtACellOrSomeRowsAStep) {
  AttributeDefinition definition{"a", 3, ValueType::kInt64, SplitRule::kCopy, {}, "", 1};
  const auto store = std::make_shared<AttributeStore>();
  const auto make = [&] {
    Environment environment{BlockId{0}, 2, Routing::kDirect, nullptr, nullptr};
    environment.attributes = store;
    return MakeAlgorithm("attributes", Parameters().Set("definitions", EncodeDefinitions({definition})),
                         environment, block_)
        .value();
  };
  auto first = make();
  EXPECT_EQ(Starts(*first), 1u);
  EXPECT_GE(Works(*first), 2 * kHere);
  while (!first->Finish(1).value()) {
  }
  EXPECT_EQ(first->report().counts["values_3"], static_cast<int64_t>(kHere));
  // Rows that are there already are given the fill value in parts.
  AttributeTable& table = store->table(3);
  for (uint64_t h = 0; h < 1000; ++h) table.Add(CellId::Initial(1000 + h));
  definition.number = 2;
  definition.fill = {5, 0, 0};
  auto second = make();
  EXPECT_GT(Starts(*second), 4u);
  EXPECT_EQ(table.columns()[0]->Get(0)[0], 5u);
  EXPECT_EQ(table.columns()[0]->Get(static_cast<uint32_t>(table.size()) - 1)[0], 5u);
  Works(*second);
  EXPECT_EQ(table.size(), kHere);
}

TEST_F(StepsTest, CheckLooksForPartnersALabelAStep) {
  auto check = Make("check");
  Starts(*check);
  Works(*check);
  size_t calls = 1;
  while (!check->Finish(1).value()) ++calls;
  EXPECT_EQ(calls, kCritical);
  EXPECT_EQ(check->report().counts["findings"], static_cast<int64_t>(kCritical));
}

TEST_F(StepsTest, AnIndexIsMadeWithTheAlgorithmAndParityOncePerSurface) {
  for (int i = 0; i < 3; ++i) Make("classify");
  EXPECT_EQ(parity_->made(), 1);
}

TEST_F(StepsTest, ACancelDuringStartIsHonoured) {
  for (const char* name : {"refine", "classify", "trim", "count", "check", "hash"}) {
    auto algorithm =
        Make(name, Parameters().Set("depth", int64_t{2}).Set("oracle", "everything").Set("keep", "all"));
    algorithm->Start(1).IgnoreError();
    algorithm->Cancel();
    EXPECT_EQ(Starts(*algorithm), 1u) << name;
    EXPECT_FALSE(algorithm->HasWork()) << name;
    EXPECT_TRUE(algorithm->Finish(1).value()) << name;
  }
  EXPECT_EQ(block_.map().number_of_attributes<3>(), kHere);
}

TEST_F(StepsTest, ACancelledCountHashOrCheckReportsThatAndNoResult) {
  for (const char* name : {"count", "hash", "check"}) {
    auto algorithm = Make(name);
    Starts(*algorithm);
    if (algorithm->HasWork()) {
      ASSERT_TRUE(algorithm->Work(5, bin_).ok());
    }
    algorithm->Cancel();
    EXPECT_FALSE(algorithm->HasWork());
    EXPECT_TRUE(algorithm->Finish(1).value());
    const Report report = algorithm->report();
    EXPECT_EQ(report.digest, Digest()) << name;
    EXPECT_EQ(report.counts, (absl::btree_map<std::string, int64_t>{{"cancelled", 1}})) << name;
  }
}

TEST_F(StepsTest, ACancelledBuildLeavesAnEmptyBlock) {
  block_.Clear();
  for (size_t steps : {size_t{10}, kHere + 5}) {
    auto build = MakeBuild();
    ASSERT_TRUE(build->Start(1).value());
    ASSERT_TRUE(build->Work(steps, bin_).ok());
    EXPECT_GT(block_.map().number_of_darts(), 0u);
    build->Cancel();
    EXPECT_FALSE(build->HasWork());
    EXPECT_EQ(block_.map().number_of_darts(), 0u);
    EXPECT_EQ(block_.map().number_of_attributes<3>(), 0u);
    EXPECT_EQ(block_.critical_count(), 0u);
    EXPECT_EQ(build->report().counts["cancelled"], 1);
  }
  // The empty block is as good as a new one.
  Build();
  EXPECT_TRUE(block_.map().is_valid());
  EXPECT_EQ(block_.critical_count(), kCritical);
}

// Five hexahedra in a row, the last in another block.
std::shared_ptr<const MeshCells> RowOfCells() {
  VolumeMesh mesh;
  for (uint32_t i = 0; i < 6; ++i) {
    for (const auto& [y, z] : {std::pair{0, 0}, {1, 0}, {0, 1}, {1, 1}}) {
      mesh.points.push_back({1.0 * i, 1.0 * y, 1.0 * z});
    }
  }
  for (uint32_t i = 0; i < 5; ++i) {
    mesh.kinds.push_back(CellKind::kHexahedron);
    for (uint32_t p : {0u, 4u, 5u, 1u, 2u, 6u, 7u, 3u}) mesh.corners.push_back(4 * i + p);
    mesh.begins.push_back(mesh.corners.size());
  }
  const std::vector<uint32_t> block_of = {0, 0, 0, 0, 1};
  return MeshCells::Make(MeshCutter(mesh, block_of, 2).Piece(BlockId{0}), BlockId{0}, 2).value();
}

TEST_F(StepsTest, AMeshIsLoadedACellAStepAndACancelledLoadLeavesAnEmptyBlock) {
  Environment environment{BlockId{0}, 2, Routing::kDirect, nullptr, nullptr};
  Block3 block(BlockId{0});
  EXPECT_EQ(MakeAlgorithm("load", {}, environment, block).status().code(),
            absl::StatusCode::kFailedPrecondition);
  environment.initial = RowOfCells();
  for (size_t cancel_after : {3u, 7u, 100u}) {
    auto load = MakeAlgorithm("load", {}, environment, block).value();
    EXPECT_TRUE(load->changes_map());
    EXPECT_TRUE(load->Start(1).value());
    size_t darts = 0, calls = 0;
    for (; load->HasWork() && calls < cancel_after; ++calls) {
      EXPECT_EQ(load->Work(1, bin_).value(), 1u);
      EXPECT_LE(block.map().number_of_darts(), darts + 24);
      darts = block.map().number_of_darts();
    }
    if (cancel_after == 100) {
      EXPECT_EQ(darts, 4 * 24u);
      EXPECT_EQ(block.critical_count(), 4u);
      EXPECT_TRUE(block.map().is_valid());
      EXPECT_EQ(load->report().counts["cells"], 4);
      EXPECT_EQ(MakeAlgorithm("load", {}, environment, block).value()->Start(1).status().code(),
                absl::StatusCode::kFailedPrecondition);
      continue;
    }
    EXPECT_GT(darts, 0u);
    load->Cancel();
    EXPECT_FALSE(load->HasWork());
    EXPECT_EQ(block.map().number_of_darts(), 0u);
    EXPECT_EQ(block.critical_count(), 0u);
    EXPECT_EQ(load->report().counts["cancelled"], 1);
  }
}

TEST_F(StepsTest, OnlyAlgorithmsThatChangeTheMapSaySo) {
  for (const AlgorithmInfo& info : Algorithms()) {
    const Parameters parameters = Parameters().Set("depth", int64_t{1}).Set("definitions", "");
    if (info.name == "build" || info.name == "load") continue;
    EXPECT_EQ(Make(info.name, parameters)->changes_map(), info.changes_map) << info.name;
  }
  EXPECT_TRUE(MakeBuild()->changes_map());
}

}  // namespace
}  // namespace ndmap

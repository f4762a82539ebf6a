// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/io/block_piece.h"

#include <algorithm>
#include <bit>
#include <map>
#include <memory>
#include <set>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/algorithm/build/build.h"
#include "core/algorithm/refine/oracle.h"
#include "core/algorithm/registry.h"
#include "core/names/name_of.h"
#include "core/sim/simulated_blocks.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"

namespace ndmap {
namespace {

// A grid of hexahedra in blocks, refined again and again in its upper corner.
class BlockPieceTest : public testing::Test {
 protected:
  void Make(const GridShape& grid, uint32_t blocks, int depth) {
    grid_ = grid;
    blocks_ = std::make_unique<SimulatedBlocks>(blocks);
    const absl::Status built = blocks_->Build(grid);
    ASSERT_TRUE(built.ok()) << built;
    Parameters parameters;
    parameters.Set("oracle", "sphere").Set("radius", 1e-30).Set("centre", FormatPoint(grid.hi));
    parameters.Set("depth", int64_t{depth});
    const auto refined = blocks_->Run("refine", parameters);
    ASSERT_TRUE(refined.ok()) << refined.status();
  }

  std::vector<VtuPiece> Pieces(VtuCells cells, const AttributeStore* attributes = nullptr) {
    std::vector<VtuPiece> pieces;
    for (size_t b = 0; b < blocks_->size(); ++b) {
      BlockPiece piece(grid_, cells);
      for (absl::StatusOr<bool> done = false; !*done;) {
        done = piece.Step((*blocks_)[b], 7, attributes);
        EXPECT_TRUE(done.ok()) << done.status();
        if (!done.ok()) return pieces;
      }
      pieces.push_back(piece.piece());
    }
    return pieces;
  }

  // Calls `visit` with the id of each hexahedron.
  template <class Visit>
  void EachHexahedron(Visit visit) {
    for (size_t b = 0; b < blocks_->size(); ++b) {
      auto& map = (*blocks_)[b].map();
      auto& cells = map.attributes<3>();
      for (auto it = cells.begin(); it != cells.end(); ++it) visit(map.info_of_attribute<3>(it).id);
    }
  }

  GridShape grid_;
  std::unique_ptr<SimulatedBlocks> blocks_;
};

// Hexahedra of level 8 whose sides are a few units in the last place of the coordinates.
TEST_F(BlockPieceTest, PointsFarFromTheOriginAreNotTakenForOneAnother) {
  GridShape grid;
  grid.cells = {2, 2, 2};
  grid.lo = {1e6, 1e6, 1e6};
  grid.hi = {1e6 + 2e-6, 1e6 + 2e-6, 1e6 + 2e-6};
  ASSERT_TRUE(CheckDepth(grid, 9).ok()) << CheckDepth(grid, 9);
  Make(grid, 2, 9);
  for (VtuCells cells : {VtuCells::kHexahedra, VtuCells::kPolyhedra}) {
    // Over all pieces equal ids are equal points, and other ids others.
    std::map<int64_t, Point3> point_of;
    std::map<Point3, int64_t> id_of;
    for (const VtuPiece& piece : Pieces(cells)) {
      EXPECT_EQ(std::set<int64_t>(piece.point_ids.begin(), piece.point_ids.end()).size(),
                piece.point_ids.size());
      for (size_t i = 0; i < piece.points.size(); ++i) {
        EXPECT_EQ(point_of.try_emplace(piece.point_ids[i], piece.points[i]).first->second, piece.points[i]);
        EXPECT_EQ(id_of.try_emplace(piece.points[i], piece.point_ids[i]).first->second, piece.point_ids[i]);
      }
    }
    EXPECT_EQ(point_of.size(), 27u + 9 * 19);
  }
}

// Two hexahedra that share faces name the same points there, whichever block they are in: each face that is
// not on the boundary of the grid is listed twice.
TEST_F(BlockPieceTest, PolyhedraShareWholeFaces) {
  GridShape grid;
  grid.cells = {2, 2, 2};
  grid.hi = {2, 2, 2};
  Make(grid, 4, 4);
  std::map<std::vector<int64_t>, int> faces;
  size_t cells = 0;
  for (const VtuPiece& piece : Pieces(VtuCells::kPolyhedra)) {
    cells += piece.types.size();
    for (size_t at = 0; at < piece.faces.size();) {
      int64_t left = piece.faces[at++];
      for (; left > 0; --left) {
        std::vector<int64_t> ids;
        for (int64_t n = piece.faces[at++]; n > 0; --n) ids.push_back(piece.point_ids[piece.faces[at++]]);
        std::sort(ids.begin(), ids.end());
        ++faces[ids];
      }
    }
  }
  EXPECT_EQ(cells, 8u + 4 * 7);
  int64_t once = 0;
  for (const auto& [ids, count] : faces) {
    EXPECT_LE(count, 2);
    once += count == 1;
  }
  // 24 on the boundary of the grid, and 3 more where each level splits a face of it in three directions.
  EXPECT_EQ(once, 24 + 4 * 9);
}

AttributeDefinition Definition(const std::string& name, unsigned dimension, ValueType type, uint64_t number) {
  AttributeDefinition definition;
  definition.name = name;
  definition.dimension = dimension;
  definition.type = type;
  definition.number = number;
  return definition;
}

// Every vertex, hanging ones and those on cuts included, has its own coordinates for values, each hexahedron
// its level.
TEST_F(BlockPieceTest, AttributesBecomeFields) {
  GridShape grid;
  grid.cells = {3, 2, 2};
  grid.hi = {3, 2, 2};
  Make(grid, 4, 3);
  AttributeStore store;
  AttributeDefinition rock = Definition("rock", 3, ValueType::kCategory, 3);
  rock.fill_text = "clay";
  store.Define(
      {Definition("place", 0, ValueType::kVec3, 1), Definition("level", 3, ValueType::kInt64, 2), rock});
  const GridCells initial(grid.cells);
  EachHexahedron([&](const CellId& id) {
    AttributeTable& cells = store.table(3);
    cells.columns()[0]->Set(cells.Add(id), {static_cast<uint64_t>(id.level()), 0, 0});
    const LatticeBox whole = BoxOf(id);
    for (unsigned corner = 0; corner < 8; ++corner) {
      LatticeBox vertex;
      vertex.low = whole.low;
      ValueWords at{};
      uint64_t stride = 1;
      for (int c = 0; c < 3; ++c) {
        if (corner >> c & 1) vertex.low.at[c] += whole.extent[c];
        const auto index = static_cast<double>(id.initial() / stride % grid.cells[c]);
        at[c] = std::bit_cast<uint64_t>(index + vertex.low.at[c] / static_cast<double>(LatticePlace::kSide));
        stride *= grid.cells[c];
      }
      AttributeTable& vertices = store.table(0);
      const CellId name = NameOf(initial, vertex);
      const uint32_t row = vertices.Find(name);
      vertices.columns()[0]->Set(row == AttributeTable::kNoRow ? vertices.Add(name) : row, at);
    }
  });
  for (VtuCells cells : {VtuCells::kHexahedra, VtuCells::kPolyhedra}) {
    size_t points = 0, fine = 0;
    for (const VtuPiece& piece : Pieces(cells, &store)) {
      ASSERT_EQ(piece.point_fields.size(), 1u);
      ASSERT_EQ(piece.cell_fields.size(), 2u);
      EXPECT_EQ(piece.cell_fields[0].name, "level (attribute)");
      points += piece.points.size();
      ASSERT_EQ(piece.point_fields[0].size(), piece.points.size());
      for (size_t i = 0; i < piece.points.size(); ++i) {
        for (size_t c = 0; c < 3; ++c)
          EXPECT_EQ(piece.point_fields[0].doubles[3 * i + c], piece.points[i][c]);
      }
      for (size_t i = 0; i < piece.types.size(); ++i) {
        EXPECT_EQ(piece.cell_fields[0].integers[i], piece.level[i]);
        EXPECT_EQ(piece.cell_fields[1].texts[i], "clay");
        fine += piece.level[i] == 3;
      }
    }
    EXPECT_GT(points, 36u);
    EXPECT_EQ(fine, 8u);
  }
}

TEST_F(BlockPieceTest, AttributesThatChangeMeanwhileEndIt) {
  GridShape grid;
  grid.cells = {2, 2, 2};
  grid.hi = {2, 2, 2};
  Make(grid, 1, 1);
  AttributeStore store;
  store.Define({Definition("heat", 0, ValueType::kDouble, 1)});
  BlockPiece piece(grid_, VtuCells::kHexahedra);
  EXPECT_FALSE(piece.Step((*blocks_)[0], 0, &store).value());
  store.Define({Definition("heat", 0, ValueType::kDouble, 2)});
  EXPECT_EQ(piece.Step((*blocks_)[0], 1, &store).status().code(), absl::StatusCode::kAborted);
  BlockPiece other(grid_, VtuCells::kHexahedra);
  store.BeginUpdate();
  EXPECT_EQ(other.Step((*blocks_)[0], 1, &store).status().code(), absl::StatusCode::kAborted);
  store.EndUpdate(0);
  const absl::Status without_values = other.Step((*blocks_)[0], 100, &store).status();
  EXPECT_EQ(without_values.code(), absl::StatusCode::kAborted);
  EXPECT_THAT(without_values.message(), testing::HasSubstr("is new: it has no values"));
}

// Between two steps of the algorithm build, hexahedra have no corners yet.
TEST(BlockPieceOfABuildTest, IsRefusedUntilTheHexahedraAreThere) {
  GridShape grid;
  grid.cells = {2, 2, 2};
  grid.hi = {2, 2, 2};
  Block3 block(BlockId{0});
  const auto assignment = MakeAssignment(grid, 1, "slabs", nullptr, 0);
  ASSERT_TRUE(assignment.ok()) << assignment.status();
  const Environment environment{BlockId{0}, 1, Routing::kDirect, nullptr, nullptr};
  auto build = MakeAlgorithm("build", GridParameters(grid, *assignment), environment, block);
  ASSERT_TRUE(build.ok()) << build.status();
  ASSERT_TRUE((*build)->Start(1).value());
  class : public Outbox {
    void Send(BlockId, const Message&) override {}
    void Broadcast(const Message&) override {}
  } out;
  int refused = 0;
  while ((*build)->HasWork()) {
    ASSERT_TRUE((*build)->Work(1, out).ok());
    BlockPiece piece(grid, VtuCells::kHexahedra);
    const auto done = piece.Step(block, 100);
    if (done.ok()) continue;
    ++refused;
    EXPECT_EQ(done.status().code(), absl::StatusCode::kFailedPrecondition);
    EXPECT_EQ(done.status().message(), "block 0 is being built");
  }
  EXPECT_GT(refused, 0);
  BlockPiece piece(grid, VtuCells::kHexahedra);
  EXPECT_TRUE(piece.Step(block, 100).value());
}

}  // namespace
}  // namespace ndmap

// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/names/mesh_cells.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <set>

#include "core/names/name_of.h"

namespace ndmap {
namespace {

using ::testing::HasSubstr;

TEST(CellDartsTest, EveryKindIsAClosedSurfaceOfNumberedDarts) {
  const std::array<std::array<unsigned, 4>, kCellKinds> expected = {
      {{4, 6, 4, 12}, {5, 8, 5, 16}, {6, 9, 5, 18}, {8, 12, 6, 24}}};
  for (int k = 0; k < kCellKinds; ++k) {
    const CellDarts& cell = DartsOf(static_cast<CellKind>(k));
    EXPECT_EQ((std::array<unsigned, 4>{cell.corners, cell.edges, cell.faces, cell.darts}), expected[k]);
    for (unsigned d = 0; d < cell.darts; ++d) {
      EXPECT_EQ(cell.across[cell.across[d]], d);
      EXPECT_NE(cell.face[cell.across[d]], cell.face[d]);
      EXPECT_EQ(cell.start[cell.across[d]], cell.end(d));
      const auto& edge = cell.edge[cell.edge_of[d]];
      EXPECT_EQ(cell.start[d], edge[cell.along[d] ? 0 : 1]);
      EXPECT_EQ(cell.end(d), edge[cell.along[d] ? 1 : 0]);
    }
  }
  for (unsigned role = 0; role < hexahedron::kRoles; ++role) {
    EXPECT_EQ(DartsOf(CellKind::kHexahedron).across[role], hexahedron::kAcross[role]);
  }
}

// A hexahedron (cell 4 of the mesh, block 1), a pyramid on its top (2, block 0) and a tetrahedron beside the
// pyramid (7, block 0).
MeshPiece Piece() {
  MeshPiece piece;
  piece.mesh.points = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},     {0, 0, 1},
                       {1, 0, 1}, {1, 1, 1}, {0, 1, 1}, {0.5, 0.5, 2}, {0.5, -1, 1.5}};
  piece.mesh.kinds = {CellKind::kPyramid, CellKind::kHexahedron, CellKind::kTetrahedron};
  piece.mesh.corners = {4, 5, 6, 7, 8, 0, 1, 2, 3, 4, 5, 6, 7, 4, 5, 8, 9};
  piece.mesh.begins = {0, 5, 13, 17};
  piece.numbers = {2, 4, 7};
  piece.blocks = {0, 1, 0};
  return piece;
}

TEST(MeshCellsTest, AHexahedronNamesWhatItTouchesAndTheLowestCellTheRest) {
  const auto mesh = MeshCells::Make(Piece(), BlockId{0}, 2);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  const CellDarts& pyramid = DartsOf(CellKind::kPyramid);
  std::set<std::string> vertices, edges, faces;
  PartBox edge{0, {0, 0}, {LatticePlace::kSide, 0}};
  PartBox face{0, {0, 0}, {LatticePlace::kSide, LatticePlace::kSide}};
  for (unsigned c = 0; c < pyramid.corners; ++c) {
    vertices.insert((*mesh)->Name(0, {static_cast<uint8_t>(c), {}, {}}).ToString());
  }
  for (unsigned e = 0; e < pyramid.edges; ++e) {
    edge.part = static_cast<uint8_t>(pyramid.edge_part(e));
    edges.insert((*mesh)->Name(0, edge).ToString());
  }
  for (unsigned f = 0; f < pyramid.faces; ++f) {
    face.part = static_cast<uint8_t>(pyramid.face_part(f));
    faces.insert((*mesh)->Name(0, face).ToString());
  }
  EXPECT_EQ(vertices, (std::set<std::string>{"v4:4", "v4:5", "v4:6", "v4:7", "v2#4"}));
  EXPECT_EQ(edges, (std::set<std::string>{"e4:2", "e4:3", "e4:6", "e4:7", "e2#2", "e2#4", "e2#6", "e2#7"}));
  EXPECT_EQ(faces, (std::set<std::string>{"f4:1", "f2#1", "f2#2", "f2#3", "f2#4"}));
  // The tetrahedron, a higher number, has the pyramid's names.
  EXPECT_EQ((*mesh)->Find(CellId::Rank(7, 0, 2)).id.ToString(), "v2#4");
  EXPECT_EQ((*mesh)->Find(CellId::Rank(7, 0, 0)).id.ToString(), "v4:4");
  EXPECT_EQ((*mesh)->Find(CellId::Rank(7, 0, 3)).id.ToString(), "v7#3");
  EXPECT_EQ((*mesh)->Find(CellId::Rank(7, 0, 3)).cells, std::vector<uint32_t>{2});
  EXPECT_TRUE((*mesh)->Find(CellId::Rank(7, 0, 4)).cells.empty());
  EXPECT_TRUE((*mesh)->Find(CellId::Rank(4, 0, 0)).cells.empty());
  EXPECT_TRUE((*mesh)->Find(CellId::Rank(5, 0, 0)).cells.empty());
  EXPECT_EQ((*mesh)->own_cells(), 2u);
}

TEST(MeshCellsTest, WhatIsBesideAFaceIsKnownWhoeverHasIt) {
  const auto mesh = MeshCells::Make(Piece(), BlockId{0}, 2);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  int beside = 0;
  for (unsigned f = 0; f < DartsOf(CellKind::kPyramid).faces; ++f) {
    const MeshCells::Side side = (*mesh)->Beyond(0, f);
    if (side.cell == kNoCell) continue;
    ++beside;
    for (unsigned d = 0; d < DartsOf(CellKind::kPyramid).darts; ++d) {
      if (DartsOf(CellKind::kPyramid).face[d] != f) continue;
      EXPECT_LT((*mesh)->DartBeyond(0, d, side), DartsOf((*mesh)->kind(side.cell)).darts);
    }
  }
  EXPECT_EQ(beside, 2);
}

TEST(MeshCellsTest, APieceThatIsNoneIsRefusedWithASentence) {
  const std::vector<std::pair<const char*, std::function<void(MeshPiece&)>>> wrong = {
      {"do not fit together", [](MeshPiece& p) { p.numbers.pop_back(); }},
      {"do not fit together", [](MeshPiece& p) { p.mesh.begins.back() = 1000; }},
      {"do not fit together", [](MeshPiece& p) { p = MeshPiece(); }},
      {"cell 0 of a piece of a mesh has not as many points", [](MeshPiece& p) { p.mesh.begins[1] = 4; }},
      {"cell 1 of a piece of a mesh is of no kind",
       [](MeshPiece& p) { p.mesh.kinds[1] = static_cast<CellKind>(9); }},
      {"cell 2 of a piece of a mesh has a point that is not there",
       [](MeshPiece& p) { p.mesh.corners.back() = 10; }},
      {"cell 2 of a piece of a mesh has a point twice", [](MeshPiece& p) { p.mesh.corners.back() = 5; }},
      {"cell 1 of a piece of a mesh is out of order", [](MeshPiece& p) { p.numbers[1] = 2; }},
      {"does not fit in an id", [](MeshPiece& p) { p.numbers[2] = CellId::kMaxInitial + 1; }},
      {"in a block that is not there", [](MeshPiece& p) { p.blocks[1] = 2; }},
      {"without a cell of its block",
       [](MeshPiece& p) {
         p.blocks = {1, 1, 1};
       }},
      {"not finite", [](MeshPiece& p) { p.mesh.points[3][1] = std::nan(""); }},
      {"cells 2 and 7 of the mesh do not list their face in opposite directions",
       [](MeshPiece& p) { std::swap(p.mesh.corners[13], p.mesh.corners[14]); }},
      {"cells 2, 7 and 8 of the mesh have one face together", [](MeshPiece& p) {
         p.mesh.kinds.push_back(CellKind::kTetrahedron);
         for (uint32_t point : {5u, 4u, 8u, 0u}) p.mesh.corners.push_back(point);
         p.mesh.begins.push_back(21);
         p.numbers.push_back(8);
         p.blocks.push_back(0);
       }}};
  for (const auto& [what, spoil] : wrong) {
    MeshPiece piece = Piece();
    spoil(piece);
    const auto made = MeshCells::Make(std::move(piece), BlockId{0}, 2);
    EXPECT_EQ(made.status().code(), absl::StatusCode::kInvalidArgument) << what;
    EXPECT_THAT(std::string(made.status().message()), HasSubstr(what));
  }
}

TEST(MeshCutterTest, APieceHasItsBlockAndWhatTouchesIt) {
  // A row of five hexahedra.
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
  const std::vector<uint32_t> block_of = {0, 1, 1, 0, 2};
  const MeshCutter cutter(mesh, block_of, 3);
  EXPECT_EQ(cutter.Piece(BlockId{0}).numbers, (std::vector<uint64_t>{0, 1, 2, 3, 4}));
  EXPECT_EQ(cutter.Piece(BlockId{2}).numbers, (std::vector<uint64_t>{3, 4}));
  const MeshPiece piece = cutter.Piece(BlockId{1});
  EXPECT_EQ(piece.numbers, (std::vector<uint64_t>{0, 1, 2, 3}));
  EXPECT_EQ(piece.blocks, (std::vector<uint32_t>{0, 1, 1, 0}));
  EXPECT_EQ(piece.mesh.points.size(), 20u);
  EXPECT_TRUE(ValidatePiece(piece, BlockId{1}, 3).ok());
  for (uint64_t c = 0; c < 4; ++c) {
    for (size_t i = 0; i < 8; ++i) {
      EXPECT_EQ(piece.mesh.points[piece.mesh.Corners(c)[i]], mesh.points[mesh.Corners(piece.numbers[c])[i]]);
    }
  }
}

}  // namespace
}  // namespace ndmap

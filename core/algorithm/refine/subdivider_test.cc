// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/algorithm/refine/subdivider.h"

#include <random>
#include <set>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/sim/simulated_blocks.h"
#include "gtest/gtest.h"

namespace ndmap {
namespace {

constexpr int kMiddleCell = 13;

// The middle one of 27 hexahedra is refined first, when nothing of it is split, or last, when its neighbours
// have split what they share with it: the same map (the first way is compared with CGAL's insert operations
// by tests/property).
Digest HashOfRefined(const std::vector<std::vector<std::string>>& lists) {
  SimulatedBlocks blocks(1);
  GridShape grid;
  grid.cells = {3, 3, 3};
  grid.hi = {3, 3, 3};
  EXPECT_TRUE(blocks.Build(grid).ok());
  for (const auto& list : lists) {
    std::string cells;
    for (const std::string& id : list) absl::StrAppend(&cells, " ", id);
    EXPECT_TRUE(
        blocks.Run("refine", Parameters().Set("oracle", "list").Set("cells", cells).Set("depth", int64_t{4}))
            .ok());
  }
  // The map is closed under its references, too.
  auto& map = blocks[0].map();
  size_t of_cells = 0, of_vertices = 0;
  for (auto it = map.attributes<3>().begin(); it != map.attributes<3>().end(); ++it) {
    of_cells += map.get_attribute_ref_counting<3>(it);
    EXPECT_TRUE(map.attribute<3>(map.info_of_attribute<3>(it).reference) == it);
    EXPECT_TRUE(map.attribute<3>(map.dart_of_attribute<3>(it)) == it);
  }
  for (auto it = map.attributes<0>().begin(); it != map.attributes<0>().end(); ++it) {
    of_vertices += map.get_attribute_ref_counting<0>(it);
    EXPECT_TRUE(map.attribute<0>(map.dart_of_attribute<0>(it)) == it);
  }
  EXPECT_EQ(of_cells, map.number_of_darts());
  EXPECT_EQ(of_vertices, map.number_of_darts());
  return blocks.Run("hash")->digest;
}

// What a neighbour at an offset shares with the middle one: the number of axes along which it lies beside it.
int AxesBeside(int neighbour) {
  return (neighbour % 3 != 1) + (neighbour / 3 % 3 != 1) + (neighbour / 9 != 1);
}
// Whether the neighbour at an edge has its edge in the face of the one at a face.
bool EdgeInFace(int edge, int face) {
  for (int unit : {1, 3, 9}) {
    if (face / unit % 3 != 1) return edge / unit % 3 == face / unit % 3;
  }
  return false;
}

// All sets of faces that may be split before, with all sets of other edges: a split face has split edges.
// Neighbours at corners share no more than a vertex.
TEST(SubdividerTest, EveryPatternOfSplitEdgesAndFacesAtOneLevel) {
  std::vector<int> faces, edges;
  for (int i = 0; i < 27; ++i) {
    if (AxesBeside(i) == 1) faces.push_back(i);
    if (AxesBeside(i) == 2) edges.push_back(i);
  }
  ASSERT_EQ(faces.size(), 6u);
  ASSERT_EQ(edges.size(), 12u);
  std::mt19937 random(1);
  int patterns = 0;
  for (unsigned face_set = 0; face_set < 64; ++face_set) {
    std::vector<std::string> fixed;
    std::vector<int> free;
    for (unsigned f = 0; f < 6; ++f) {
      if ((face_set >> f & 1) != 0) fixed.push_back(absl::StrCat("h", faces[f]));
    }
    for (int e : edges) {
      bool split = false;
      for (unsigned f = 0; f < 6; ++f) split |= (face_set >> f & 1) != 0 && EdgeInFace(e, faces[f]);
      if (!split) free.push_back(e);
    }
    for (unsigned edge_set = 0; edge_set < 1u << free.size(); ++edge_set) {
      // Each edge is treated by itself, so that of the many sets of edges a part will do.
      if (free.size() > 5 && random() % (1u << (free.size() - 5)) != 0) continue;
      std::vector<std::string> before = fixed;
      for (size_t e = 0; e < free.size(); ++e) {
        if ((edge_set >> e & 1) != 0) before.push_back(absl::StrCat("h", free[e]));
      }
      const std::vector<std::string> middle = {absl::StrCat("h", kMiddleCell)};
      ASSERT_EQ(HashOfRefined({before, middle}), HashOfRefined({middle, before}))
          << face_set << " " << edge_set;
      ++patterns;
    }
  }
  EXPECT_GT(patterns, 400);
}

// Neighbours refined to four levels at random, all parts of the middle one's boundary among them.
TEST(SubdividerTest, DeeperPatternsAtRandom) {
  std::mt19937 random(2);
  for (int i = 0; i < 30; ++i) {
    std::vector<std::string> before;
    for (int h = 0; h < 27; ++h) {
      if (h == kMiddleCell || random() % 3 == 0) continue;
      std::string id = absl::StrCat("h", h);
      before.push_back(id);
      for (int level = 1; level < 4 && random() % 4 != 0; ++level) {
        absl::StrAppend(&id, level == 1 ? "/" : ".", random() % 8);
        before.push_back(id);
      }
    }
    const std::vector<std::string> middle = {absl::StrCat("h", kMiddleCell),
                                             absl::StrCat("h", kMiddleCell, "/", random() % 8)};
    ASSERT_EQ(HashOfRefined({before, middle}), HashOfRefined({middle, before})) << "case " << i;
  }
}

}  // namespace
}  // namespace ndmap

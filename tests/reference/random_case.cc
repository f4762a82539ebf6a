// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/reference/random_case.h"

#include <algorithm>
#include <random>
#include <utility>

#include "absl/container/flat_hash_set.h"
#include "absl/strings/str_cat.h"

namespace ndmap::reference {
namespace {

// The standard fixes the engine's numbers but not those of its distributions.
class Dice {
 public:
  explicit Dice(uint64_t seed) : engine_(seed) {}
  // 0 ... n-1; the bias is below 2^-50 for the n used here.
  uint32_t Below(uint64_t n) { return static_cast<uint32_t>(engine_() % n); }
  // [0, 1), a multiple of 2^-53.
  double Unit() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }

 private:
  std::mt19937_64 engine_;
};

void MakeGrid(Dice& dice, RandomCase* c) {
  do {
    for (uint32_t& n : c->grid) n = 1 + dice.Below(4);
  } while (c->cells() > RandomCase::kMaxCells);
  const uint32_t kind = dice.Below(8);  // Mostly distorted: equal coordinates hide mistakes.
  c->geometry = kind == 0 ? "regular" : kind == 1 ? "wild" : "distorted";
  for (uint32_t k = 0; k <= c->grid[2]; ++k) {
    for (uint32_t j = 0; j <= c->grid[1]; ++j) {
      for (uint32_t i = 0; i <= c->grid[0]; ++i) {
        Point3 p = {double(i), double(j), double(k)};
        for (double& x : p) {
          if (kind == 1) x = 1e6 * (dice.Unit() - 0.5);
          if (kind > 1) x += 0.6 * (dice.Unit() - 0.5);
        }
        c->corners.push_back(p);
      }
    }
  }
}

// Cells along the chosen axis in layers of about equal thickness.
void CutInSlabs(Dice& dice, RandomCase* c) {
  uint32_t axis = dice.Below(3);
  for (int i = 0; i < 2 && c->grid[axis] == 1; ++i) axis = (axis + 1) % 3;
  c->blocks = c->grid[axis] == 1 ? 1 : 2 + dice.Below(c->grid[axis] - 1);
  for (uint32_t n = 0; n < c->cells(); ++n) {
    const std::array<uint32_t, 3> at = {n % c->grid[0], n / c->grid[0] % c->grid[1],
                                        n / c->grid[0] / c->grid[1]};
    c->block_of.push_back(at[axis] * c->blocks / c->grid[axis]);
  }
}

// Black cells in block 0; white cells anywhere else, so that those blocks meet only along edges and vertices.
void CutAsCheckerboard(Dice& dice, RandomCase* c) {
  c->blocks = 2 + dice.Below(RandomCase::kMaxBlocks - 1);
  for (uint32_t n = 0; n < c->cells(); ++n) {
    const uint32_t parity = n % c->grid[0] + n / c->grid[0] % c->grid[1] + n / c->grid[0] / c->grid[1];
    c->block_of.push_back(parity % 2 == 0 ? 0 : 1 + dice.Below(c->blocks - 1));
  }
}

void CutAtRandom(Dice& dice, RandomCase* c) {
  c->blocks = 1 + dice.Below(RandomCase::kMaxBlocks);
  for (uint32_t n = 0; n < c->cells(); ++n) c->block_of.push_back(dice.Below(c->blocks));
}

// Block 0 holds two cells that share only an edge or a vertex; the grid must allow it.
void CutDiagonally(Dice& dice, RandomCase* c) {
  c->blocks = 2 + dice.Below(RandomCase::kMaxBlocks - 1);
  for (uint32_t n = 0; n < c->cells(); ++n) c->block_of.push_back(1 + dice.Below(c->blocks - 1));
  uint32_t from = 0, to = 0, stride = 1;
  uint32_t steps = 0;
  for (int a = 0; a < 3; ++a) {
    const uint32_t n = c->grid[a];
    if (n > 1 && (steps < 2 || dice.Below(2) == 0)) {
      const uint32_t at = dice.Below(n - 1), up = dice.Below(2);
      from += stride * (at + up);
      to += stride * (at + 1 - up);
      ++steps;
    }
    stride *= n;
  }
  c->block_of[from] = c->block_of[to] = 0;
}

void Cut(Dice& dice, RandomCase* c) {
  const uint32_t style = dice.Below(10);
  const int wide = (c->grid[0] > 1) + (c->grid[1] > 1) + (c->grid[2] > 1);
  if (style == 0) {
    c->partition = "single";
    c->block_of.assign(c->cells(), 0);
  } else if (style <= 2) {
    c->partition = "slabs";
    CutInSlabs(dice, c);
  } else if (style <= 4) {
    c->partition = "checkerboard";
    CutAsCheckerboard(dice, c);
  } else if (style <= 6 && wide >= 2) {
    c->partition = "diagonal";
    CutDiagonally(dice, c);
  } else {
    c->partition = "random";
    CutAtRandom(dice, c);
  }
}

// Refines a random hexahedron again and again, at times one of the eight just made, so that deep and coarse
// ones are neighbours. Returns the hexahedra that are left.
std::vector<CellId> Refine(Dice& dice, RandomCase* c) {
  static constexpr uint32_t kAtMost[] = {4, 4, 16, 16, 16, 64, 64, 400};
  const uint32_t wanted =
      std::min(1 + dice.Below(kAtMost[dice.Below(8)]), (RandomCase::kMaxLeaves - c->cells()) / 7);
  const uint32_t deepen = dice.Below(4);  // In so many of four steps the last one's child is taken.
  std::vector<CellId> open, leaves;       // open: may be refined; leaves: deepest level.
  for (uint32_t n = 0; n < c->cells(); ++n) open.push_back(CellId::Initial(n));
  while (c->refined.size() < wanted && !open.empty()) {
    const size_t recent = std::min<size_t>(8, open.size());
    const bool deep = !c->refined.empty() && dice.Below(4) < deepen;
    const size_t at = deep ? open.size() - 1 - dice.Below(recent) : dice.Below(open.size());
    const CellId id = open[at];
    open[at] = open.back();
    open.pop_back();
    c->refined.push_back(id);
    std::vector<CellId>& target = id.level() + 1 < RandomCase::kMaxLevel ? open : leaves;
    for (unsigned child = 0; child < 8; ++child) target.push_back(id.Child(child));
  }
  leaves.insert(leaves.end(), open.begin(), open.end());
  std::sort(leaves.begin(), leaves.end());
  return leaves;
}

}  // namespace

std::vector<CellId> RandomCase::Leaves() const {
  absl::flat_hash_set<CellId> set;
  for (uint32_t n = 0; n < cells(); ++n) set.insert(CellId::Initial(n));
  for (const CellId id : refined) {
    set.erase(id);
    for (unsigned child = 0; child < 8; ++child) set.insert(id.Child(child));
  }
  std::vector<CellId> leaves(set.begin(), set.end());
  std::sort(leaves.begin(), leaves.end());
  return leaves;
}

std::string RandomCase::Describe() const {
  int level = 0;
  for (const CellId id : refined) level = std::max(level, id.level() + 1);
  return absl::StrCat("seed ", seed, ": ", geometry, " grid ", grid[0], "x", grid[1], "x", grid[2], ", ",
                      blocks, blocks == 1 ? " block (" : " blocks (", partition, "), ", refined.size(),
                      " hexahedra refined down to level ", level, ", ", removed.size(), " removed");
}

RandomCase MakeRandomCase(uint64_t seed) {
  RandomCase c;
  c.seed = seed;
  Dice dice(seed);
  MakeGrid(dice, &c);
  Cut(dice, &c);
  const std::vector<CellId> leaves = Refine(dice, &c);
  if (dice.Below(2) == 0) {
    const double share = dice.Unit();
    for (const CellId id : leaves) {
      if (dice.Unit() < share) c.removed.push_back(id);
    }
  }
  return c;
}

}  // namespace ndmap::reference

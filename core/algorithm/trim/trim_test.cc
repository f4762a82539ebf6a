// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/algorithm/trim/trim.h"

#include <random>
#include <string>

#include "absl/strings/str_cat.h"
#include "core/sim/simulated_blocks.h"
#include "gtest/gtest.h"

namespace ndmap {
namespace {

class NoOutbox final : public Outbox {
 public:
  void Send(BlockId, const Message&) override {}
  void Broadcast(const Message&) override {}
};

// Definition 1, attributes and their counts included: a vertex that holds together what hangs together no
// longer is a fault.
void ExpectValidVertices(SimulatedBlocks& blocks, const std::string& what) {
  const auto checked = blocks.Run("check");
  ASSERT_TRUE(checked.ok()) << checked.status();
  EXPECT_EQ(checked->counts.at("findings"), 0)
      << what << ": " << (checked->findings.empty() ? "" : checked->findings[0]);
  EXPECT_TRUE(blocks[0].map().is_valid()) << what;
}

// A grid some cells of which are refined, in one block.
void RefineSome(SimulatedBlocks& blocks) {
  GridShape grid;
  grid.cells = {3, 3, 3};
  grid.hi = {3, 3, 3};
  ASSERT_TRUE(blocks.Build(grid).ok());
  Parameters refine;
  refine.Set("oracle", "list").Set("cells", "h0 h13 h13/0 h13/7 h26 h5").Set("depth", int64_t{2});
  ASSERT_TRUE(blocks.Run("refine", refine).ok());
}

// Every other cell goes: the rest meet along edges and at vertices only.
std::string EveryOther() {
  std::string cells;
  for (int i = 0; i < 27; i += 2) absl::StrAppend(&cells, i == 0 ? "" : " ", "h", i);
  return cells + " h13/0.0 h13/0.3 h13/0.5 h13/0.6 h13/7.7 h13/1 h13/2 h13/4 h5/0 h5/3";
}

// Wherever it is cancelled, what is left is a map whose vertices are those of its volumes.
TEST(TrimTest, ACancelAtAnyStepLeavesAValidMap) {
  size_t whole = 1;
  for (size_t cancel_after = 0; cancel_after < whole; ++cancel_after) {
    SimulatedBlocks blocks(1);
    RefineSome(blocks);
    const Environment environment{BlockId{0}, 1, Routing::kDirect, nullptr, nullptr};
    auto trim =
        MakeAlgorithm("trim", Parameters().Set("cells", EveryOther()), environment, blocks[0]).value();
    ASSERT_TRUE(trim->Start(1 << 20).value());
    NoOutbox bin;
    size_t steps = 0;
    for (; steps < cancel_after && trim->HasWork(); ++steps) ASSERT_EQ(trim->Work(1, bin).value(), 1u);
    if (cancel_after == 0) {
      // How many steps it takes in all, of a trim that is not cancelled.
      while (trim->HasWork()) whole += trim->Work(1, bin).value();
      ASSERT_GT(whole, 40u);
      ExpectValidVertices(blocks, "not cancelled");
      continue;
    }
    trim->Cancel();
    while (trim->HasWork()) ASSERT_EQ(trim->Work(1, bin).value(), 1u);
    ASSERT_TRUE(trim->Finish(1).value());
    EXPECT_LE(trim->report().counts["removed"], static_cast<int64_t>(steps));
    ExpectValidVertices(blocks, absl::StrCat("cancelled after ", steps, " steps"));
  }
}

// What a trim makes does not depend on whether it goes at once or in parts.
TEST(TrimTest, InPartsOrAtOnceIsTheSame) {
  std::mt19937 random(3);
  for (int i = 0; i < 10; ++i) {
    std::string parts[3], all;
    for (int c = 0; c < 27; ++c) {
      const unsigned part = random() % 4;
      if (part == 3 || c == 0 || c == 5 || c == 13 || c == 26) continue;
      absl::StrAppend(&parts[part], " h", c);
      absl::StrAppend(&all, " h", c);
    }
    SimulatedBlocks at_once(1), in_parts(1);
    RefineSome(at_once);
    RefineSome(in_parts);
    ASSERT_TRUE(at_once.Run("trim", Parameters().Set("cells", all)).ok());
    for (const std::string& part : parts)
      ASSERT_TRUE(in_parts.Run("trim", Parameters().Set("cells", part)).ok());
    ExpectValidVertices(at_once, all);
    ExpectValidVertices(in_parts, all);
    EXPECT_EQ(at_once.Run("hash")->digest, in_parts.Run("hash")->digest);
    EXPECT_EQ(at_once[0].map().number_of_attributes<0>(), in_parts[0].map().number_of_attributes<0>());
  }
}

}  // namespace
}  // namespace ndmap

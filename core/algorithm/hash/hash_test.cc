// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/algorithm/hash/hash.h"

#include "core/sim/simulated_blocks.h"
#include "gtest/gtest.h"

namespace ndmap {
namespace {

// Takes messages, which nobody will answer.
class SilentOutbox : public Outbox {
 public:
  void Send(BlockId, const Message&) override { ++sent; }
  void Broadcast(const Message&) override { ++sent; }
  int sent = 0;
};

TEST(HashTest, OneThatWasCancelledIsNoFailureAndOneWithoutAnswersIs) {
  SimulatedBlocks blocks(2);
  GridShape grid;
  grid.cells = {2, 2, 2};
  grid.hi = {2, 2, 2};
  ASSERT_TRUE(blocks.Build(grid).ok());
  for (bool cancelled : {true, false}) {
    const Environment environment{BlockId{0}, 2, Routing::kDirect, nullptr, nullptr};
    auto hash = MakeAlgorithm("hash", {}, environment, blocks[0]);
    ASSERT_TRUE(hash.ok()) << hash.status();
    ASSERT_TRUE((*hash)->Start(1).value());
    SilentOutbox out;
    while ((*hash)->HasWork()) ASSERT_TRUE((*hash)->Work(100, out).ok());
    EXPECT_GT(out.sent, 0);
    if (cancelled) (*hash)->Cancel();
    EXPECT_EQ((*hash)->Finish(1).ok(), cancelled);
  }
}

}  // namespace
}  // namespace ndmap

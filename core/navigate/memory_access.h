// SPDX-License-Identifier: GPL-3.0-or-later
// Blocks in this process as a BlockAccess: for tests, and for programs that use core alone.
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "core/map/block.h"
#include "core/navigate/closure.h"

namespace ndmap {

template <class BlockT>
class MemoryAccess final : public BlockAccess {
 public:
  using Blocks = std::vector<std::unique_ptr<BlockT>>;

  // The blocks stay where they are.
  explicit MemoryAccess(Blocks* blocks) : blocks_(*blocks) {}

  uint32_t block_count() const override { return static_cast<uint32_t>(blocks_.size()); }

  absl::StatusOr<std::vector<OrbitPiece>> Expand(absl::Span<const Question> questions) override {
    std::vector<OrbitPiece> pieces;
    for (const Question& question : questions) {
      BlockT& block = *blocks_[question.block.value];
      if (question.version != 0 && question.version != block.version()) {
        return absl::FailedPreconditionError(absl::StrCat("block ", question.block.value, " is at version ",
                                                          block.version(), ", not ", question.version));
      }
      OrbitExpander<BlockT> expander(question.dimension, question.seeds, kMost);
      absl::StatusOr<bool> done = false;
      while (done.ok() && !*done) done = expander.Step(block, kMost);
      if (!done.ok()) return done.status();
      pieces.push_back(expander.Take());
    }
    return pieces;
  }

 private:
  static constexpr size_t kMost = size_t{1} << 32;
  Blocks& blocks_;
};

}  // namespace ndmap

// SPDX-License-Identifier: GPL-3.0-or-later
// Cells that several blocks may have found, put together: each once, in the lowest of its blocks. Lists are
// ascending by id, so that those of servers are merged as they come.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "ndmap/v1/attributes.pb.h"
#include "server/attribute_columns.h"

namespace ndmap::server {

// Cells in one message.
inline constexpr size_t kFoundInAPart = 1 << 15;

// Both are ascending; of a cell that is in both the lower block stays. O(cells).
std::vector<FoundCell> MergeFound(std::vector<FoundCell> a, std::vector<FoundCell> b);

// Cells [begin, end).
void ToWire(const std::vector<FoundCell>& cells, size_t begin, size_t end, bool points, v1::FoundCells& wire);
// INTERNAL: columns that do not fit each other, or ids that are not ascending after `last`.
absl::StatusOr<std::vector<FoundCell>> FromWire(const v1::FoundCells& wire, bool points, CellId last);

// An ascending list that comes in parts.
class FoundSource {
 public:
  virtual ~FoundSource() = default;
  // The next part; empty when there are no more.
  virtual absl::StatusOr<std::vector<FoundCell>> Next() = 0;
};

// Of a list that is at hand.
class FoundHere final : public FoundSource {
 public:
  explicit FoundHere(std::vector<FoundCell> cells) : cells_(std::move(cells)) {}
  absl::StatusOr<std::vector<FoundCell>> Next() override { return std::exchange(cells_, {}); }

 private:
  std::vector<FoundCell> cells_;
};

// Takes the cells of all sources, each once, in parts of at most `most`. O(cells * sources). Returns the
// first error of a source or of `take`.
absl::Status MergeSources(std::vector<std::unique_ptr<FoundSource>> sources, size_t most,
                          const std::function<absl::Status(const std::vector<FoundCell>&)>& take);

}  // namespace ndmap::server

// SPDX-License-Identifier: GPL-3.0-or-later
// Counts, sums, extremes, histograms and integrals of values, exact whatever the blocks.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/attributes/aggregate.h"
#include "server/attribute_rows.h"
#include "server/part_stream.h"

namespace ndmap::server {

class AttributeAggregates {
 public:
  AttributeAggregates(BlockHost* host, PeerStubs* peers, const AttributeRows* rows)
      : host_(host), peers_(peers), rows_(rows) {}

  // For a client: of all blocks. Begins again some times when it is ABORTED. Blocking.
  absl::Status Aggregate(const v1::AggregateRequest& question, const Caller& caller,
                         v1::AggregateResponse& response) const;
  // For another server: of the blocks here. Writes sums, then cells without rows that other servers may have.
  absl::Status AggregateBlocks(const v1::AggregateBlocksRequest& request, const Caller& caller,
                               const std::function<bool(const v1::AggregateBlocksResponse&)>& write) const;

 private:
  struct Part {
    Aggregates aggregates;
    AttributeRows::Columns columns;
    // Not in the sums: cells without rows that other servers may have. Ascending.
    std::vector<FoundCell> found;
  };
  using Stream = PartStream<v1::AggregateBlocksResponse>;
  absl::StatusOr<Part> Here(const v1::AggregateRequest& question, const Caller& caller) const;
  absl::Status Add(const v1::AggregateRequest& question, Stream& stream, Part& part,
                   std::vector<std::unique_ptr<FoundSource>>& sources) const;
  absl::Status Once(const v1::AggregateRequest& question, const Caller& caller,
                    v1::AggregateResponse& response) const;

  BlockHost* const host_;
  PeerStubs* const peers_;
  const AttributeRows* const rows_;
};

}  // namespace ndmap::server

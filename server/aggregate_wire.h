// SPDX-License-Identifier: GPL-3.0-or-later
// Aggregates as they are on the wire, in part and as a whole.
#pragma once

#include "absl/status/statusor.h"
#include "core/attributes/aggregate.h"
#include "ndmap/v1/attributes.pb.h"
#include "server/attribute_columns.h"

namespace ndmap::server {

// What fits into a message between servers.
inline constexpr size_t kMaxGroups = 8192;
inline constexpr size_t kMaxBinsInAll = 1 << 20;

// INVALID_ARGUMENT: histogram, groups, levels or an integral that cannot be; `column` is that of the name,
// null when the question has none.
absl::Status CheckQuestion(const v1::AggregateRequest& question, const AskedColumn* column);

// RESOURCE_EXHAUSTED: more groups, or bins in all groups, than fit.
absl::Status CheckSize(const Aggregates& aggregates, uint32_t bins);

void ToWire(const Aggregates& aggregates, v1::AggregateBlocksResponse& wire);
// INTERNAL unless each group has `components` components, with `bins` bins or none.
absl::StatusOr<Aggregates> FromWire(const v1::AggregateBlocksResponse& wire, size_t components,
                                    uint32_t bins);
// The answer.
void ToWire(const Aggregates& aggregates, const v1::AggregateRequest& question, const AskedColumn* column,
            v1::AggregateResponse& wire);

}  // namespace ndmap::server

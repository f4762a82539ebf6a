// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/attribute_aggregates.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "server/aggregate_wire.h"
#include "server/attribute_gates.h"
#include "server/attribute_reads.h"
#include "server/block_aggregator.h"

namespace ndmap::server {
namespace {

using Async = v1::BlockService::StubInterface::async_interface;

}  // namespace

absl::StatusOr<AttributeAggregates::Part> AttributeAggregates::Here(const v1::AggregateRequest& question,
                                                                    const Caller& caller) const {
  absl::StatusOr<BlockHost::MapInfo> info = host_->Info(question.map());
  if (!info.ok()) return info.status();
  absl::StatusOr<std::shared_ptr<AttributeGates>> gates = host_->Gates(question.map());
  if (!gates.ok()) return gates.status();
  Names names;
  if (!question.name().empty()) *names.Add() = question.name();
  if (!question.category().empty()) *names.Add() = question.category();
  absl::StatusOr<AttributeRows::Columns> columns =
      rows_->Resolve(question.map(), question.dimension(), names);
  if (!columns.ok()) return columns.status();
  Part part;
  part.update = columns->update;
  if (!question.name().empty()) part.column = columns->columns.front();
  const AskedColumn* column = part.column ? &*part.column : nullptr;
  if (absl::Status s = CheckQuestion(question, column); !s.ok()) return s;
  if (!question.category().empty() && columns->columns.back().type != ValueType::kCategory) {
    return absl::InvalidArgumentError(
        absl::StrCat("attribute ", question.category(), " is no category: groups cannot be made by it"));
  }
  for (uint32_t b : info->blocks) {
    absl::StatusOr<std::shared_ptr<const InitialCells>> initial = host_->Initial(question.map(), b);
    if (!initial.ok()) return initial.status();
    BlockAggregator aggregator(question, columns->columns, initial->get(), part.aggregates);
    absl::Status status = host_->QuerySliced(
        question.map(), b,
        [&](Block3& block, AttributeStore& store) -> absl::StatusOr<bool> {
          absl::StatusOr<uint64_t> update = (*gates)->Update();
          if (!update.ok()) return update.status();
          if (*update != part.update) return AttributesChanged();
          return aggregator.Step(block, store);
        },
        caller.Gone());
    if (!status.ok()) return status;
  }
  return part;
}

absl::Status AttributeAggregates::AggregateBlocks(const v1::AggregateBlocksRequest& request,
                                                  const Caller& caller,
                                                  v1::AggregateBlocksResponse& response) const {
  absl::StatusOr<Part> part = Here(request.question(), caller);
  if (!part.ok()) return part.status();
  ToWire(part->aggregates, response);
  response.set_update(part->update);
  return absl::OkStatus();
}

absl::Status AttributeAggregates::Aggregate(const v1::AggregateRequest& question, const Caller& caller,
                                            v1::AggregateResponse& response) const {
  absl::Status status;
  int attempt = 0;
  do {
    status = Once(question, caller, response);
  } while (absl::IsAborted(status) && TryAgain(++attempt, caller));
  if (!status.ok() && caller.gone()) return absl::CancelledError("the caller has gone");
  return status;
}

absl::Status AttributeAggregates::Once(const v1::AggregateRequest& question, const Caller& caller,
                                       v1::AggregateResponse& response) const {
  absl::StatusOr<BlockHost::MapInfo> info = host_->Info(question.map());
  if (!info.ok()) return info.status();
  v1::AggregateBlocksRequest request;
  *request.mutable_question() = question;
  PeerCalls<v1::AggregateBlocksRequest, v1::AggregateBlocksResponse> calls(
      *peers_, OtherServers(*info, host_->address()), request, &Async::AggregateBlocks,
      [&caller] { return caller.Onward(); });
  absl::StatusOr<Part> part = Here(question, caller);
  if (!part.ok()) return part.status();
  absl::StatusOr<std::vector<v1::AggregateBlocksResponse>> answers = calls.Wait();
  if (!answers.ok()) return answers.status();
  const AskedColumn* column = part->column ? &*part->column : nullptr;
  const size_t components = column == nullptr ? 0 : column->width();
  for (const v1::AggregateBlocksResponse& answer : *answers) {
    if (answer.update() != part->update) return AttributesChanged();
    absl::StatusOr<Aggregates> theirs = FromWire(answer, components, question.bins());
    if (!theirs.ok()) return theirs.status();
    if (absl::Status s = MergeInto(*theirs, part->aggregates); !s.ok()) return s;
    if (absl::Status s = CheckSize(part->aggregates, question.bins()); !s.ok()) return s;
  }
  response.Clear();
  ToWire(part->aggregates, question, column, response);
  return absl::OkStatus();
}

}  // namespace ndmap::server

// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/attribute_aggregates.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "server/aggregate_wire.h"
#include "server/attribute_gates.h"
#include "server/attribute_reads.h"
#include "server/block_aggregator.h"
#include "server/found_cells.h"

namespace ndmap::server {
namespace {

// That of the question's name; null when it has none.
const AskedColumn* ColumnOf(const v1::AggregateRequest& question, const AttributeRows::Columns& columns) {
  return question.name().empty() ? nullptr : &columns.columns.front();
}

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
  absl::StatusOr<AttributeRows::Columns> resolved =
      rows_->Resolve(question.map(), question.dimension(), names);
  if (!resolved.ok()) return resolved.status();
  Part part;
  part.columns = *std::move(resolved);
  const AttributeRows::Columns& columns = part.columns;
  if (absl::Status s = CheckQuestion(question, ColumnOf(question, columns)); !s.ok()) return s;
  if (!question.category().empty() && columns.columns.back().type != ValueType::kCategory) {
    return absl::InvalidArgumentError(
        absl::StrCat("attribute ", question.category(), " is no category: groups cannot be made by it"));
  }
  std::unique_ptr<ScanTurns::Turn> turn;
  if (columns.by_scan) {
    absl::StatusOr<std::unique_ptr<ScanTurns::Turn>> waited = rows_->WaitForScan(caller.Gone());
    if (!waited.ok()) return waited.status();
    turn = *std::move(waited);
  }
  for (uint32_t b : info->blocks) {
    absl::StatusOr<std::shared_ptr<const InitialCells>> initial = host_->Initial(question.map(), b);
    if (!initial.ok()) return initial.status();
    BlockAggregator aggregator(question, columns, *initial, part.aggregates);
    absl::Status status = host_->QuerySliced(
        question.map(), b,
        [&](Block3& block, AttributeStore& store) -> absl::StatusOr<bool> {
          if (absl::Status s = rows_->CheckState(question.map(), **gates, columns); !s.ok()) return s;
          return aggregator.Step(block, store);
        },
        caller.Gone());
    if (!status.ok()) return status;
    part.found = MergeFound(std::move(part.found), aggregator.TakeOuter());
  }
  return part;
}

absl::Status AttributeAggregates::AggregateBlocks(
    const v1::AggregateBlocksRequest& request, const Caller& caller,
    const std::function<bool(const v1::AggregateBlocksResponse&)>& write) const {
  absl::StatusOr<Part> part = Here(request.question(), caller);
  if (!part.ok()) return part.status();
  v1::AggregateBlocksResponse response;
  ToWire(part->aggregates, response);
  response.set_update(part->columns.update);
  const bool sent =
      write(response) && SendFound(part->found, part->columns.points(), [&](v1::FoundCells&& found) {
        response.clear_groups();
        *response.mutable_found() = std::move(found);
        return write(response);
      });
  return sent ? absl::OkStatus() : absl::CancelledError("the caller has gone");
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
  std::vector<std::unique_ptr<Stream>> streams;
  for (const std::string& address : OtherServers(*info, host_->address())) {
    streams.push_back(std::make_unique<Stream>(
        *peers_, address, caller, [&](v1::BlockService::Stub& stub, grpc::ClientContext* context) {
          return stub.AggregateBlocks(context, request);
        }));
  }
  absl::StatusOr<Part> part = Here(question, caller);
  if (!part.ok()) return part.status();
  std::vector<std::unique_ptr<FoundSource>> sources;
  sources.push_back(std::make_unique<FoundHere>(std::move(part->found)));
  for (auto& stream : streams) {
    if (absl::Status s = Add(question, *stream, *part, sources); !s.ok()) return s;
  }
  BlockAggregator aggregator(question, part->columns, nullptr, part->aggregates);
  absl::Status merged =
      MergeSources(std::move(sources), kFoundInAPart,
                   [&](const std::vector<FoundCell>& cells) { return aggregator.AddFound(cells); });
  if (!merged.ok()) return merged;
  response.Clear();
  ToWire(part->aggregates, question, ColumnOf(question, part->columns), response);
  return absl::OkStatus();
}

absl::Status AttributeAggregates::Add(const v1::AggregateRequest& question, Stream& stream, Part& part,
                                      std::vector<std::unique_ptr<FoundSource>>& sources) const {
  v1::AggregateBlocksResponse answer;
  absl::StatusOr<bool> there = stream.Next(answer);
  if (!there.ok()) return there.status();
  const auto check = [update = part.columns.update](const v1::AggregateBlocksResponse& a) {
    return a.update() == update ? absl::OkStatus() : AttributesChanged();
  };
  if (absl::Status s = check(answer); !s.ok()) return s;
  const AskedColumn* column = ColumnOf(question, part.columns);
  absl::StatusOr<Aggregates> theirs =
      FromWire(answer, column == nullptr ? 0 : column->width(), question.bins());
  if (!theirs.ok()) return theirs.status();
  if (absl::Status s = MergeInto(*theirs, part.aggregates); !s.ok()) return s;
  if (absl::Status s = CheckSize(part.aggregates, question.bins()); !s.ok()) return s;
  answer.Clear();
  sources.push_back(std::make_unique<FoundThere<v1::AggregateBlocksResponse>>(&stream, std::move(answer),
                                                                              part.columns.points(), check));
  return absl::OkStatus();
}

}  // namespace ndmap::server

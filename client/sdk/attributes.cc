// SPDX-License-Identifier: Apache-2.0
// Calls about attributes.
#include "client/sdk/attributes.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/sdk/connection.h"
#include "client/sdk/map.h"

namespace ndmap {
namespace internal {

// A server of the map.
struct SomeServer {
  std::shared_ptr<v1::BlockService::Stub> stub;
  std::string name;
};

}  // namespace internal

namespace {

using internal::SomeServer;

// In one message.
constexpr size_t kCellsAMessage = 65536;
// In one call: what is written again when it does not succeed.
constexpr size_t kCellsACall = 16 * kCellsAMessage;

// Each in turn: any of them answers for all.
absl::StatusOr<SomeServer> NextServer(internal::Connection& connection, const MapHandle& map) {
  const uint32_t block = connection.NextNumber() % std::max<uint32_t>(1, map.info().block_count());
  absl::StatusOr<std::string> address = map.AddressOf(block);
  if (!address.ok()) return address.status();
  auto server = connection.BlockServer(*address);
  if (!server.ok()) return server.status();
  return SomeServer{*std::move(server), internal::ServerName(*address)};
}

absl::Status CheckColumn(const AttributeColumn& values, size_t cells) {
  if (values.size() != cells || values.doubles.size() % (values.type == v1::VALUE_TYPE_VEC3 ? 3 : 1) != 0) {
    return absl::InvalidArgumentError(
        absl::StrCat(values.size(), " values for ", cells, " cells, expected as many"));
  }
  for (uint32_t code : values.codes) {
    if (code >= values.categories.size()) {
      return absl::InvalidArgumentError(
          absl::StrCat("code ", code, " of ", values.categories.size(), " categories"));
    }
  }
  return absl::OkStatus();
}

void AddTo(v1::WriteAttributeResponse& sum, const v1::WriteAttributeResponse& part) {
  constexpr int kMissingIds = 10;
  sum.set_written(sum.written() + part.written());
  sum.set_missing(sum.missing() + part.missing());
  for (const std::string& id : part.missing_ids()) {
    if (sum.missing_ids_size() < kMissingIds) sum.add_missing_ids(id);
  }
}

}  // namespace

namespace internal {

// One answer, part by part. Ids are asked for a message at a time.
class AttributeParts {
 public:
  AttributeParts(std::shared_ptr<Connection> connection, MapHandle map, v1::ReadAttributesRequest request)
      : connection_(std::move(connection)), map_(std::move(map)), request_(std::move(request)) {
    names_.assign(request_.names().begin(), request_.names().end());
    by_ids_ = request_.select().has_ids();
    if (!by_ids_) return;
    ids_.Swap(request_.mutable_select()->mutable_ids());
    end_ = static_cast<size_t>(std::max(ids_.hi_size(), ids_.lo_size()));
  }
  ~AttributeParts() {
    if (stream_ == nullptr) return;
    context_->TryCancel();
    // What was under way must be taken before a stream may go.
    v1::ReadAttributesResponse rest;
    while (stream_->Read(&rest)) {
    }
    stream_->Finish();
  }

  // False at the end.
  absl::StatusOr<bool> Next(CellValues* values) {
    Retries retries(connection_->options());
    for (;;) {
      if (over_) return false;
      absl::Status status = stream_ == nullptr ? Begin() : absl::OkStatus();
      v1::ReadAttributesResponse part;
      if (status.ok() && stream_->Read(&part)) return Take(part, values);
      if (status.ok()) status = End();
      if (status.ok()) continue;
      // What the caller has seen of all cells cannot be taken back.
      if ((handed_ && !by_ids_) || !retries.Again(status)) return status;
    }
  }

 private:
  absl::Status Begin() {
    absl::StatusOr<SomeServer> server = NextServer(*connection_, map_);
    if (!server.ok()) return server.status();
    server_ = *std::move(server);
    if (by_ids_) {
      call_end_ = std::min(end_, done_ + kCellsAMessage);
      auto& ids = *request_.mutable_select()->mutable_ids();
      ids.Clear();
      const auto copy = [&](const auto& from, auto* to) {
        const int last = std::min(from.size(), static_cast<int>(call_end_));
        for (int i = static_cast<int>(done_); i < last; ++i) to->Add(from.Get(i));
      };
      copy(ids_.hi(), ids.mutable_hi());
      copy(ids_.lo(), ids.mutable_lo());
    }
    context_ = std::make_unique<grpc::ClientContext>();
    SetDeadline(*context_, connection_->options().transfer_timeout);
    stream_ = server_.stub->ReadAttributes(context_.get(), request_);
    return absl::OkStatus();
  }

  absl::StatusOr<bool> Take(const v1::ReadAttributesResponse& part, CellValues* values) {
    absl::StatusOr<CellValues> taken = ToCellValues(part, names_, server_.name);
    if (!taken.ok()) return taken.status();
    *values = *std::move(taken);
    handed_ = true;
    done_ += values->cells.size();
    if (by_ids_ && done_ > call_end_)
      return absl::DataLossError(absl::StrCat(server_.name, " sent too much"));
    return true;
  }

  // The stream has no more parts.
  absl::Status End() {
    absl::Status status = FromGrpc(stream_->Finish(), server_.name);
    stream_ = nullptr;
    if (!status.ok()) return status;
    if (by_ids_ && done_ < call_end_) {
      return absl::DataLossError(absl::StrCat(server_.name, " sent values of too few cells"));
    }
    over_ = !by_ids_ || done_ >= end_;
    return absl::OkStatus();
  }

  const std::shared_ptr<Connection> connection_;
  const MapHandle map_;
  v1::ReadAttributesRequest request_;
  std::vector<std::string> names_;
  v1::CellSelection::Ids ids_;
  bool by_ids_ = false, handed_ = false, over_ = false;
  // Ids: handed over, asked for in this call, in all.
  size_t done_ = 0, call_end_ = 0, end_ = 0;
  SomeServer server_;
  std::unique_ptr<grpc::ClientContext> context_;
  std::unique_ptr<grpc::ClientReader<v1::ReadAttributesResponse>> stream_;
};

}  // namespace internal

AttributeReader::AttributeReader(std::unique_ptr<internal::AttributeParts> parts)
    : parts_(std::move(parts)) {}
AttributeReader::AttributeReader(AttributeReader&&) noexcept = default;
AttributeReader& AttributeReader::operator=(AttributeReader&&) noexcept = default;
AttributeReader::~AttributeReader() = default;

bool AttributeReader::Next() {
  if (failed_) return false;
  CellValues values;
  const absl::StatusOr<bool> more = parts_->Next(&values);
  failed_ = !more.ok();
  if (failed_) {
    part_ = more.status();
    return true;
  }
  part_ = std::move(values);
  return *more;
}

AttributeReader MapHandle::ReadAttributes(uint32_t dimension, std::vector<std::string> names,
                                          v1::CellSelection select) const {
  v1::ReadAttributesRequest request;
  request.set_map(name());
  request.set_dimension(dimension);
  for (std::string& name : names) request.add_names(std::move(name));
  *request.mutable_select() = std::move(select);
  return AttributeReader(std::make_unique<internal::AttributeParts>(connection_, *this, std::move(request)));
}

absl::StatusOr<JobHandle> MapHandle::DefineAttribute(const NewAttribute& attribute) const {
  v1::DefineAttributeRequest request;
  request.set_map(name());
  *request.mutable_attribute() = attribute.attribute();
  v1::DefineAttributeResponse response;
  absl::Status status =
      internal::CallOnce(connection_->coordinator(), &v1::Coordinator::Stub::DefineAttribute, request,
                         &response, connection_->options().call_timeout, connection_->coordinator_name());
  if (!status.ok()) return status;
  return JobHandle(connection_, response.job().job());
}

absl::StatusOr<JobHandle> MapHandle::DropAttribute(const std::string& name) const {
  v1::DropAttributeRequest request;
  request.set_map(this->name());
  request.set_name(name);
  v1::DropAttributeResponse response;
  absl::Status status =
      internal::CallOnce(connection_->coordinator(), &v1::Coordinator::Stub::DropAttribute, request,
                         &response, connection_->options().call_timeout, connection_->coordinator_name());
  if (!status.ok()) return status;
  return JobHandle(connection_, response.job().job());
}

absl::StatusOr<std::vector<v1::Attribute>> MapHandle::ListAttributes() const {
  v1::GetMapRequest request;
  request.set_map(name());
  v1::GetMapResponse response;
  absl::Status status =
      internal::CallIdempotent(connection_->coordinator(), &v1::Coordinator::Stub::GetMap, request, &response,
                               connection_->options(), connection_->coordinator_name());
  if (!status.ok()) return status;
  const auto& all = response.map().attributes();
  return std::vector<v1::Attribute>(all.begin(), all.end());
}

absl::StatusOr<v1::WriteAttributeResponse> MapHandle::Write(
    absl::Span<const v1::WriteAttributeRequest> messages) const {
  absl::StatusOr<std::string> address = AddressOf(0);
  if (!address.ok()) return address.status();
  internal::Retries retries(connection_->options());
  for (;;) {
    auto server = connection_->BlockServer(*address);
    absl::Status status = server.status();
    if (status.ok()) {
      grpc::ClientContext context;
      internal::SetDeadline(context, connection_->options().transfer_timeout);
      v1::WriteAttributeResponse response;
      auto stream = (*server)->WriteAttribute(&context, &response);
      // A write that fails means that the server has already answered: Finish() tells what.
      for (const v1::WriteAttributeRequest& message : messages) {
        if (!stream->Write(message)) break;
      }
      stream->WritesDone();
      status = internal::FromGrpc(stream->Finish(), internal::ServerName(*address));
      if (status.ok()) return response;
    }
    if (!retries.Again(status)) return status;
  }
}

absl::StatusOr<v1::WriteAttributeResponse> MapHandle::WriteAttribute(const std::string& name,
                                                                     const CellIds& cells,
                                                                     const AttributeColumn& values) const {
  const size_t count = cells.size();
  if (cells.lo.size() != count) {
    return absl::InvalidArgumentError(
        absl::StrCat(count, " upper words of ids, but ", cells.lo.size(), " lower ones"));
  }
  if (absl::Status s = CheckColumn(values, count); !s.ok()) return s;
  v1::WriteAttributeResponse sum;
  size_t at = 0;
  do {
    std::vector<v1::WriteAttributeRequest> messages(1);
    messages[0].set_map(this->name());
    messages[0].set_name(name);
    for (const size_t call_end = std::min(count, at + kCellsACall); at < call_end;) {
      const size_t end = std::min(call_end, at + kCellsAMessage);
      v1::WriteAttributeRequest& message = messages.emplace_back();
      message.mutable_ids()->mutable_hi()->Add(cells.hi.begin() + static_cast<std::ptrdiff_t>(at),
                                               cells.hi.begin() + static_cast<std::ptrdiff_t>(end));
      message.mutable_ids()->mutable_lo()->Add(cells.lo.begin() + static_cast<std::ptrdiff_t>(at),
                                               cells.lo.begin() + static_cast<std::ptrdiff_t>(end));
      *message.mutable_values() = internal::ToValues(values, at, end);
      at = end;
    }
    absl::StatusOr<v1::WriteAttributeResponse> part = Write(messages);
    if (!part.ok()) return part;
    AddTo(sum, *part);
  } while (at < count);
  return sum;
}

absl::StatusOr<v1::WriteAttributeResponse> MapHandle::SetAttribute(const std::string& name,
                                                                   const v1::CellSelection& select,
                                                                   const AttributeColumn& value) const {
  if (absl::Status s = CheckColumn(value, 1); !s.ok()) return s;
  if (select.has_ids()) {
    CellIds cells;
    cells.hi.assign(select.ids().hi().begin(), select.ids().hi().end());
    cells.lo.assign(select.ids().lo().begin(), select.ids().lo().end());
    AttributeColumn values = value;
    const auto repeat = [&](auto& field) {
      const auto one = field;
      field.clear();
      for (size_t i = 0; i < cells.size(); ++i) field.insert(field.end(), one.begin(), one.end());
    };
    repeat(values.doubles);
    repeat(values.integers);
    repeat(values.codes);
    return WriteAttribute(name, cells, values);
  }
  v1::WriteAttributeRequest message;
  message.set_map(this->name());
  message.set_name(name);
  *message.mutable_select() = select;
  *message.mutable_values() = internal::ToValues(value, 0, 1);
  return Write({message});
}

absl::StatusOr<std::vector<v1::Aggregate>> MapHandle::Aggregate(const v1::AggregateRequest& question) const {
  v1::AggregateRequest request = question;
  request.set_map(name());
  internal::Retries retries(connection_->options());
  for (;;) {
    absl::StatusOr<SomeServer> server = NextServer(*connection_, *this);
    absl::Status status = server.status();
    if (status.ok()) {
      v1::AggregateResponse response;
      status = internal::CallOnce(*server->stub, &v1::BlockService::Stub::Aggregate, request, &response,
                                  connection_->options().transfer_timeout, server->name);
      if (status.ok()) {
        auto* groups = response.mutable_groups();
        return std::vector<v1::Aggregate>(std::make_move_iterator(groups->begin()),
                                          std::make_move_iterator(groups->end()));
      }
    }
    if (!retries.Again(status)) return status;
  }
}

}  // namespace ndmap

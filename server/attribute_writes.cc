// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/attribute_writes.h"

#include <algorithm>
#include <utility>

#include "absl/cleanup/cleanup.h"
#include "absl/container/flat_hash_set.h"
#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "server/attribute_reads.h"
#include "service/attributes.h"

namespace ndmap::server {
namespace {

using Async = v1::BlockService::StubInterface::async_interface;

constexpr int kShownMissing = 10;
constexpr absl::Duration kWritePatience = absl::Seconds(2);

Column* FindColumn(AttributeStore& store, uint64_t number) {
  for (unsigned i = 0; i < 4; ++i) {
    if (Column* column = store.table(i).FindNumber(number)) return column;
  }
  return nullptr;
}

absl::Status NoAttribute(const std::string& map, const std::string& name,
                         const std::vector<std::string>& there) {
  return absl::NotFoundError(absl::StrCat("map \"", map, "\" has no attribute \"",
                                          absl::CHexEscape(name.substr(0, 128)), "\"; it has ",
                                          there.empty() ? "none" : absl::StrJoin(there, ", ")));
}

// One value for each of `count` cells.
v1::Values Repeated(const v1::Values& one, ValueType type, int count) {
  v1::Values values;
  *values.mutable_categories() = one.categories();
  for (int k = 0; k < count; ++k) {
    if (type == ValueType::kCategory) {
      values.add_codes(one.codes(0));
    } else {
      service::AddNumber(type, service::NumberAt(one, type, 0), values);
    }
  }
  return values;
}

}  // namespace

absl::Status AttributeWrites::Write(const ReadPart& read, const Caller& caller,
                                    v1::WriteAttributeResponse& response) const {
  v1::WriteAttributeRequest request;
  if (!read(request)) return absl::InvalidArgumentError("a write begins with the names of map and attribute");
  absl::StatusOr<Target> target = Find(request.map(), request.name());
  if (!target.ok()) return target.status();
  bool selected = false;
  do {
    if (selected) return absl::InvalidArgumentError("a write to selected cells is one message");
    if (caller.gone()) break;
    selected = request.has_select();
    if (selected && request.has_ids()) {
      return absl::InvalidArgumentError("cells to write: expected ids or select, given both");
    }
    absl::Status status = selected ? WriteSelected(*target, request, caller, response)
                                   : WriteIds(*target, std::move(*request.mutable_ids()),
                                              std::move(*request.mutable_values()), response);
    if (!status.ok()) return status;
    request.Clear();
  } while (read(request));
  return caller.gone() ? absl::CancelledError("the caller has gone") : absl::OkStatus();
}

absl::StatusOr<AttributeWrites::Target> AttributeWrites::Find(const std::string& map,
                                                              const std::string& name) const {
  absl::StatusOr<BlockHost::MapInfo> info = host_->Info(map);
  if (!info.ok()) return info.status();
  if (info->blocks.empty() || info->blocks.front() != 0) {
    return absl::FailedPreconditionError(absl::StrCat(
        "attributes of map \"", map, "\" are written at the server of its block 0, at ", info->addresses[0]));
  }
  absl::StatusOr<std::shared_ptr<AttributeGates>> gates = host_->Gates(map);
  if (!gates.ok()) return gates.status();
  if (absl::StatusOr<uint64_t> update = (*gates)->Update(kWritePatience); !update.ok())
    return update.status();
  Target target;
  target.map = map;
  target.info = *std::move(info);
  target.gates = *std::move(gates);
  absl::Status status = host_->Query(map, 0, [&](Block3&, AttributeStore& store) -> absl::Status {
    std::vector<std::string> there;
    for (unsigned i = 0; i < 4; ++i) {
      for (const auto& column : store.table(i).columns()) {
        there.push_back(column->definition().name);
        if (there.back() != name) continue;
        target.definition = column->definition();
        return absl::OkStatus();
      }
    }
    return NoAttribute(map, name, there);
  });
  if (!status.ok()) return status;
  return target;
}

absl::Status AttributeWrites::WriteSelected(const Target& target, const v1::WriteAttributeRequest& request,
                                            const Caller& caller,
                                            v1::WriteAttributeResponse& response) const {
  const ValueType type = target.definition.type;
  if (absl::Status s = CheckSelection(request.select()); !s.ok()) return s;
  if (absl::Status s = service::CheckValues(request.values(), type, 1); !s.ok()) return s;
  v1::CellSelection::Ids ids = request.select().ids();
  if (request.select().has_all()) {
    auto part = std::make_shared<v1::ApplyAttributeRequest>();
    *part->mutable_select() = request.select();
    *part->mutable_values() = request.values();
    std::vector<v1::ApplyAttributeResponse> answers;
    if (absl::Status s = Do(target, std::move(part), answers); !s.ok()) return s;
    for (const v1::ApplyAttributeResponse& answer : answers)
      response.set_written(response.written() + answer.written());
    return absl::OkStatus();
  }
  if (request.select().has_query()) {
    absl::StatusOr<v1::CellSelection::Ids> found =
        IdsOfQuery(*explorer_, request.select().query(), target.map, target.definition.dimension, caller);
    if (!found.ok()) return found.status();
    ids = *std::move(found);
  }
  for (int begin = 0; begin < ids.hi_size(); begin += service::kMaxPart) {
    const int end = std::min(begin + service::kMaxPart, ids.hi_size());
    v1::CellSelection::Ids chunk;
    chunk.mutable_hi()->Add(ids.hi().begin() + begin, ids.hi().begin() + end);
    chunk.mutable_lo()->Add(ids.lo().begin() + begin, ids.lo().begin() + end);
    v1::Values values = Repeated(request.values(), type, end - begin);
    if (absl::Status s = WriteIds(target, std::move(chunk), std::move(values), response); !s.ok()) return s;
  }
  return absl::OkStatus();
}

absl::Status AttributeWrites::WriteIds(const Target& target, v1::CellSelection::Ids ids, v1::Values values,
                                       v1::WriteAttributeResponse& response) const {
  if (absl::Status s = CheckIds(ids); !s.ok()) return s;
  const auto count = static_cast<size_t>(ids.hi_size());
  if (absl::Status s = service::CheckValues(values, target.definition.type, count); !s.ok()) return s;
  if (count == 0) return absl::OkStatus();
  auto part = std::make_shared<v1::ApplyAttributeRequest>();
  *part->mutable_ids() = std::move(ids);
  *part->mutable_values() = std::move(values);
  std::vector<v1::ApplyAttributeResponse> answers;
  if (absl::Status s = Do(target, part, answers); !s.ok()) return s;
  std::vector<bool> found(count, false);
  for (const v1::ApplyAttributeResponse& answer : answers) {
    for (uint32_t place : answer.found()) {
      if (place < count) found[place] = true;
    }
  }
  for (size_t k = 0; k < count; ++k) {
    if (found[k]) {
      response.set_written(response.written() + 1);
      continue;
    }
    response.set_missing(response.missing() + 1);
    if (response.missing_ids_size() >= kShownMissing) continue;
    const int place = static_cast<int>(k);
    response.add_missing_ids(CellId::FromWords(part->ids().hi(place), part->ids().lo(place)).ToString());
  }
  return absl::OkStatus();
}

absl::Status AttributeWrites::Do(const Target& target, std::shared_ptr<v1::ApplyAttributeRequest> part,
                                 std::vector<v1::ApplyAttributeResponse>& answers) const {
  part->set_map(target.map);
  part->set_map_number(target.info.number);
  part->set_attribute_number(target.definition.number);
  if (absl::Status s = target.gates->BeginPart(); !s.ok()) return s;
  const absl::Cleanup end = [&] { target.gates->EndPart(); };
  if (absl::Status s = CheckRoom(target, part->values()); !s.ok()) return s;
  absl::Status status = ToAll(target, *part, answers);
  if (status.ok()) return status;
  Target later = target;
  // Does not keep alive whom it belongs to.
  later.gates = std::shared_ptr<AttributeGates>(std::shared_ptr<void>(), target.gates.get());
  target.gates->SetUnsettled([this, later = std::move(later), part]() -> absl::Status {
    std::vector<v1::ApplyAttributeResponse> again;
    // What was dropped meanwhile is in nobody's way.
    if (absl::IsNotFound(CheckRoom(later, part->values()))) return absl::OkStatus();
    const absl::Status settled = ToAll(later, *part, again);
    if (settled.ok()) return settled;
    return absl::UnavailableError(absl::StrCat(
        "an earlier write could not be brought to all blocks, and must be before anything else is written: ",
        settled.message()));
  });
  return absl::UnavailableError(
      absl::StrCat(status.message(), "; parts of the write may have been done: write again"));
}

absl::Status AttributeWrites::ToAll(const Target& target, v1::ApplyAttributeRequest& part,
                                    std::vector<v1::ApplyAttributeResponse>& answers) const {
  part.set_sequence(target.gates->NextSequence());
  // Not the client's: when that goes, the part is done all the same.
  const auto context = [] {
    auto made = std::make_unique<grpc::ClientContext>();
    made->set_deadline(std::chrono::system_clock::now() + PeerStubs::kDeadline);
    return made;
  };
  // Where the map's blocks are now.
  absl::StatusOr<BlockHost::MapInfo> info = host_->Info(target.map);
  if (!info.ok()) return info.status();
  PeerCalls<v1::ApplyAttributeRequest, v1::ApplyAttributeResponse> calls(
      *peers_, OtherServers(*info, host_->address()), part, &Async::ApplyAttribute, context);
  v1::ApplyAttributeResponse here;
  const absl::Status status = rows_->Apply(part, here);
  absl::StatusOr<std::vector<v1::ApplyAttributeResponse>> there = calls.Wait();
  if (!status.ok()) return status;
  if (!there.ok()) return there.status();
  answers = *std::move(there);
  answers.push_back(std::move(here));
  return absl::OkStatus();
}

absl::Status AttributeWrites::CheckRoom(const Target& target, const v1::Values& values) const {
  absl::flat_hash_set<uint32_t> used(values.codes().begin(), values.codes().end());
  absl::flat_hash_set<std::string> texts;
  for (uint32_t code : used) texts.insert(values.categories(static_cast<int>(code)));
  auto next = texts.begin();
  size_t fresh = 0;
  const auto step = [&](Block3&, AttributeStore& store) -> absl::StatusOr<bool> {
    constexpr size_t kAStep = 4096;
    const Column* column = FindColumn(store, target.definition.number);
    if (column == nullptr) {
      return absl::NotFoundError(absl::StrCat("attribute ", target.definition.name, " was dropped"));
    }
    for (size_t k = 0; k < kAStep && next != texts.end(); ++k, ++next) fresh += column->Knows(*next) ? 0 : 1;
    if (next != texts.end()) return false;
    if (column->categories() + fresh <= AttributeDefinition::kMaxCategories) return true;
    return absl::ResourceExhaustedError(absl::StrCat(
        "attribute ", target.definition.name, " has ", column->categories(), " different categories, ", fresh,
        " more are given, and ", AttributeDefinition::kMaxCategories, " are possible"));
  };
  return host_->QuerySliced(target.map, 0, step, [] { return false; });
}

}  // namespace ndmap::server

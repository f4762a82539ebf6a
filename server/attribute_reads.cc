// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/attribute_reads.h"

#include <algorithm>
#include <utility>

#include "absl/cleanup/cleanup.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"

namespace ndmap::server {
namespace {

constexpr int kReadAttempts = 5;
constexpr absl::Duration kPause = absl::Milliseconds(10);

using BlockReader = grpc::ClientReader<v1::ReadBlocksResponse>;

// A stream of parts from another server.
struct PartStream {
  std::string address;
  std::shared_ptr<v1::BlockService::Stub> stub;
  std::unique_ptr<grpc::ClientContext> context;
  std::unique_ptr<BlockReader> reader;

  PartStream(PeerStubs& peers, const std::string& to, const v1::ReadBlocksRequest& request,
             const Caller& caller)
      : address(to),
        stub(peers.To(to)),
        context(caller.Onward()),
        reader(stub->ReadBlocks(context.get(), request)) {}
  ~PartStream() {
    if (reader == nullptr) return;
    context->TryCancel();
    reader->Finish();
  }
  PartStream(const PartStream&) = delete;
  PartStream& operator=(const PartStream&) = delete;

  absl::Status ReadTo(const AttributeRows::TakePart& take) {
    v1::ReadBlocksResponse part;
    while (reader->Read(&part)) {
      if (!take(part)) return absl::CancelledError("the caller has gone");
      part.Clear();
    }
    return FromPeer(std::exchange(reader, nullptr)->Finish(), address);
  }
};

// Puts the values of a part at places of the answer.
class Merger {
 public:
  Merger(const std::vector<AskedColumn>& columns, size_t cells, v1::ReadAttributesResponse& answer)
      : columns_(columns), there_(cells, false), codes_(columns.size()), answer_(answer) {
    const int n = static_cast<int>(cells);
    for (const AskedColumn& column : columns_) {
      v1::Values& values = *answer_.add_columns();
      if (column.type == ValueType::kCategory) {
        values.mutable_codes()->Resize(n, 0);
      } else if (column.type == ValueType::kInt64) {
        values.mutable_integers()->Resize(n, 0);
      } else {
        values.mutable_doubles()->Resize(n * static_cast<int>(column.width()), 0);
      }
    }
  }

  absl::Status Add(const v1::ReadBlocksResponse& part) {
    if (part.columns_size() != static_cast<int>(columns_.size())) return Wrong();
    for (uint32_t place : part.places()) {
      if (place >= there_.size()) return Wrong();
      there_[place] = true;
    }
    for (size_t k = 0; k < columns_.size(); ++k) {
      const v1::Values& from = part.columns(static_cast<int>(k));
      v1::Values& to = *answer_.mutable_columns(static_cast<int>(k));
      const bool fits = columns_[k].type == ValueType::kCategory
                            ? AddCodes(k, part, from, to)
                            : AddNumbers(static_cast<int>(columns_[k].width()), part, from, to);
      if (!fits) return Wrong();
    }
    return absl::OkStatus();
  }

  // The places that nobody has.
  void Finish() {
    for (size_t k = 0; k < there_.size(); ++k) {
      if (!there_[k]) answer_.add_missing(static_cast<uint32_t>(k));
    }
    for (v1::Values& values : *answer_.mutable_columns()) {
      // Every code names a text, also where it means nothing.
      if (values.codes_size() > 0 && values.categories_size() == 0) values.add_categories("");
    }
  }

 private:
  static absl::Status Wrong() {
    return absl::InternalError("a block server sent values that do not belong to what was asked");
  }
  static bool AddNumbers(int width, const v1::ReadBlocksResponse& part, const v1::Values& from,
                         v1::Values& to) {
    const int n = part.places_size();
    if (to.integers_size() > 0) {
      if (from.integers_size() != n) return false;
      for (int i = 0; i < n; ++i) to.set_integers(static_cast<int>(part.places(i)), from.integers(i));
      return true;
    }
    if (from.doubles_size() != n * width) return false;
    for (int i = 0; i < n * width; ++i) {
      const int place = static_cast<int>(part.places(i / width));
      to.set_doubles(place * width + i % width, from.doubles(i));
    }
    return true;
  }
  bool AddCodes(size_t k, const v1::ReadBlocksResponse& part, const v1::Values& from, v1::Values& to) {
    if (from.codes_size() != part.places_size()) return false;
    std::vector<uint32_t> places;
    for (const std::string& text : from.categories()) {
      const auto [it, made] = codes_[k].try_emplace(text, static_cast<uint32_t>(to.categories_size()));
      if (made) to.add_categories(text);
      places.push_back(it->second);
    }
    for (int i = 0; i < from.codes_size(); ++i) {
      if (from.codes(i) >= places.size()) return false;
      to.set_codes(static_cast<int>(part.places(i)), places[from.codes(i)]);
    }
    return true;
  }

  const std::vector<AskedColumn>& columns_;
  std::vector<bool> there_;
  std::vector<absl::flat_hash_map<std::string, uint32_t>> codes_;
  v1::ReadAttributesResponse& answer_;
};

}  // namespace

// A question of a client on its way.
struct AttributeReads::Question {
  const v1::ReadAttributesRequest& request;
  const Caller& caller;
  const Write& write;
  AttributeRows::Columns columns;
  std::vector<std::string> others;
  bool begun = false;

  v1::ReadBlocksRequest ToBlocks() const {
    v1::ReadBlocksRequest to;
    to.set_map(request.map());
    to.set_dimension(request.dimension());
    *to.mutable_names() = request.names();
    return to;
  }
  absl::Status CheckUpdate(const v1::ReadBlocksResponse& part) const {
    if (part.update() == columns.update) return absl::OkStatus();
    return absl::AbortedError("the map's attributes were brought up to date during the question: ask again");
  }
  bool Send(const v1::ReadAttributesResponse& part) {
    begun = true;
    return write(part);
  }
};

absl::Status AttributeReads::Read(const v1::ReadAttributesRequest& request, const Caller& caller,
                                  const Write& write) const {
  if (absl::Status s = CheckSelection(request.select()); !s.ok()) return s;
  absl::Status status;
  int attempt = 0;
  do {
    Question question{request, caller, write, {}, {}};
    status = Once(question);
    if (!absl::IsAborted(status) || question.begun) break;
  } while (TryAgain(++attempt, caller));
  return status;
}

absl::Status AttributeReads::Once(Question& question) const {
  const v1::ReadAttributesRequest& request = question.request;
  absl::StatusOr<BlockHost::MapInfo> info = host_->Info(request.map());
  if (!info.ok()) return info.status();
  absl::StatusOr<AttributeRows::Columns> columns =
      rows_->Resolve(request.map(), request.dimension(), request.names());
  if (!columns.ok()) return columns.status();
  question.columns = *std::move(columns);
  question.others = OtherServers(*info, host_->address());
  if (request.select().has_all()) return ReadAll(question);
  if (request.select().has_ids()) return ReadIds(question, request.select().ids(), false);
  absl::StatusOr<v1::CellSelection::Ids> ids =
      IdsOfQuery(*explorer_, request.select().query(), request.map(), request.dimension(), question.caller);
  if (!ids.ok()) return ids.status();
  return ReadIds(question, *ids, true);
}

absl::Status AttributeReads::ReadAll(Question& question) const {
  v1::ReadBlocksRequest request = question.ToBlocks();
  *request.mutable_select() = question.request.select();
  absl::Status wrong;
  const auto take = [&](v1::ReadBlocksResponse& part) {
    wrong = question.CheckUpdate(part);
    if (!wrong.ok()) return false;
    if (part.cell_hi_size() == 0) return true;
    v1::ReadAttributesResponse out;
    out.mutable_cell_hi()->Swap(part.mutable_cell_hi());
    out.mutable_cell_lo()->Swap(part.mutable_cell_lo());
    out.mutable_columns()->Swap(part.mutable_columns());
    return question.Send(out);
  };
  absl::Status status = rows_->Read(request, question.caller.Gone(), take);
  for (const std::string& address : question.others) {
    if (!status.ok()) break;
    status = PartStream(*peers_, address, request, question.caller).ReadTo(take);
  }
  return wrong.ok() ? status : wrong;
}

absl::Status AttributeReads::ReadIds(Question& question, const v1::CellSelection::Ids& ids,
                                     bool all_there) const {
  const int most = static_cast<int>(PartBuilder(question.columns.columns).most());
  for (int begin = 0; begin < ids.hi_size(); begin += most) {
    const int end = std::min(begin + most, ids.hi_size());
    v1::ReadBlocksRequest request = question.ToBlocks();
    v1::CellSelection::Ids& chunk = *request.mutable_select()->mutable_ids();
    chunk.mutable_hi()->Add(ids.hi().begin() + begin, ids.hi().begin() + end);
    chunk.mutable_lo()->Add(ids.lo().begin() + begin, ids.lo().begin() + end);
    if (absl::Status s = ReadChunk(question, request, all_there); !s.ok()) return s;
  }
  return absl::OkStatus();
}

absl::Status AttributeReads::ReadChunk(Question& question, const v1::ReadBlocksRequest& request,
                                       bool all_there) const {
  const v1::CellSelection::Ids& ids = request.select().ids();
  std::vector<std::unique_ptr<PartStream>> streams;
  for (const std::string& address : question.others) {
    streams.push_back(std::make_unique<PartStream>(*peers_, address, request, question.caller));
  }
  v1::ReadAttributesResponse answer;
  *answer.mutable_cell_hi() = ids.hi();
  *answer.mutable_cell_lo() = ids.lo();
  Merger merger(question.columns.columns, static_cast<size_t>(ids.hi_size()), answer);
  absl::Status wrong;
  const auto take = [&](v1::ReadBlocksResponse& part) {
    wrong = question.CheckUpdate(part);
    if (wrong.ok()) wrong = merger.Add(part);
    return wrong.ok();
  };
  absl::Status status = rows_->Read(request, question.caller.Gone(), take);
  for (auto& stream : streams) {
    if (status.ok()) status = stream->ReadTo(take);
  }
  if (!wrong.ok()) return wrong;
  if (!status.ok()) return status;
  merger.Finish();
  if (all_there && answer.missing_size() > 0) {
    const int k = static_cast<int>(answer.missing(0));
    return absl::AbortedError(
        absl::StrCat("cell ", CellId::FromWords(ids.hi(k), ids.lo(k)).ToString(),
                     " is new: it has no values until the job that changes the map has ended"));
  }
  return question.Send(answer) ? absl::OkStatus() : absl::CancelledError("the caller has gone");
}

absl::StatusOr<v1::CellSelection::Ids> IdsOfQuery(Explorer& explorer, v1::ExploreRequest query,
                                                  const std::string& map, unsigned dimension,
                                                  const Caller& caller) {
  query.set_map(map);
  query.set_dimension(dimension);
  query.set_give(v1::GIVE_CELLS);
  v1::CellSelection::Ids ids;
  absl::Status status = explorer.Explore(query, caller.Gone(), [&ids](const v1::ExploreResponse& part) {
    ids.mutable_hi()->MergeFrom(part.cell_hi());
    ids.mutable_lo()->MergeFrom(part.cell_lo());
    return true;
  });
  if (!status.ok()) return status;
  return ids;
}

bool TryAgain(int k, const Caller& caller) {
  if (k >= kReadAttempts || caller.gone()) return false;
  absl::SleepFor(k * kPause);
  return true;
}

}  // namespace ndmap::server

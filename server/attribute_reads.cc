// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/attribute_reads.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "server/attribute_gates.h"
#include "server/found_cells.h"

namespace ndmap::server {
namespace {

constexpr int kReadAttempts = 5;
constexpr absl::Duration kPause = absl::Milliseconds(10);

using Stream = PartStream<v1::ReadBlocksResponse>;

std::unique_ptr<Stream> Ask(PeerStubs& peers, const std::string& address,
                            const v1::ReadBlocksRequest& request, const Caller& caller) {
  return std::make_unique<Stream>(peers, address, caller,
                                  [&](v1::BlockService::Stub& stub, grpc::ClientContext* context) {
                                    return stub.ReadBlocks(context, request);
                                  });
}

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
    std::vector<bool> again;
    for (uint32_t place : part.places()) {
      if (place >= there_.size()) return Wrong();
      again.push_back(there_[place]);
      there_[place] = true;
    }
    for (size_t k = 0; k < columns_.size(); ++k) {
      const v1::Values& from = part.columns(static_cast<int>(k));
      v1::Values& to = *answer_.mutable_columns(static_cast<int>(k));
      const bool fits = columns_[k].type == ValueType::kCategory
                            ? AddCodes(k, part, from, to)
                            : AddNumbers(columns_[k], part, again, from, to);
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
  // A cell without rows comes from each of its blocks: what they say is the same, but for the block.
  static bool AddNumbers(const AskedColumn& column, const v1::ReadBlocksResponse& part,
                         const std::vector<bool>& again, const v1::Values& from, v1::Values& to) {
    const int n = part.places_size();
    const int width = static_cast<int>(column.width());
    if (to.integers_size() > 0) {
      if (from.integers_size() != n) return false;
      for (int i = 0; i < n; ++i) {
        const int place = static_cast<int>(part.places(i));
        const bool lower = column.kind == AskedColumn::Kind::kBlock && again[static_cast<size_t>(i)];
        to.set_integers(place, lower ? std::min(to.integers(place), from.integers(i)) : from.integers(i));
      }
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
    return AttributesChanged();
  }
  absl::Status Send(const v1::ReadAttributesResponse& part) {
    begun = true;
    return write(part) ? absl::OkStatus() : absl::CancelledError("the caller has gone");
  }
  // The cells of a part, taken out of it.
  absl::Status SendCells(v1::ReadBlocksResponse& part) {
    if (part.cell_hi_size() == 0) return absl::OkStatus();
    v1::ReadAttributesResponse out;
    out.mutable_cell_hi()->Swap(part.mutable_cell_hi());
    out.mutable_cell_lo()->Swap(part.mutable_cell_lo());
    out.mutable_columns()->Swap(part.mutable_columns());
    return Send(out);
  }
  absl::Status SendFound(const std::vector<FoundCell>& cells) {
    PartBuilder builder(columns.columns);
    const RowView view = RowView::Of(nullptr, request.dimension(), columns.columns, cells);
    for (uint32_t row = 0; row < view.size(); ++row) {
      builder.part().add_cell_hi(cells[row].id.hi());
      builder.part().add_cell_lo(cells[row].id.lo());
      builder.Add(view, row);
    }
    return SendCells(builder.part());
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
  std::vector<FoundCell> found_here;
  const auto take = [&](v1::ReadBlocksResponse& part) {
    wrong = question.CheckUpdate(part);
    if (!wrong.ok()) return false;
    if (part.found().cell_hi_size() > 0) {
      absl::StatusOr<std::vector<FoundCell>> found = FromWire(
          part.found(), question.columns.points(), found_here.empty() ? CellId() : found_here.back().id);
      wrong = found.status();
      if (found.ok()) found_here.insert(found_here.end(), found->begin(), found->end());
    } else {
      wrong = question.SendCells(part);
    }
    return wrong.ok();
  };
  absl::Status status = rows_->Read(request, question.caller.Gone(), take);
  if (!wrong.ok()) return wrong;
  if (!status.ok()) return status;
  std::vector<std::unique_ptr<FoundSource>> sources;
  sources.push_back(std::make_unique<FoundHere>(std::move(found_here)));
  // One after the other, and after the blocks here: who looks through its blocks for this waits for nobody
  // else.
  std::vector<std::unique_ptr<Stream>> streams;
  for (const std::string& address : question.others) {
    streams.push_back(Ask(*peers_, address, request, question.caller));
    if (status = ReadParts(question, *streams.back(), sources); !status.ok()) return status;
  }
  return MergeSources(std::move(sources), PartBuilder(question.columns.columns).most(),
                      [&](const std::vector<FoundCell>& cells) { return question.SendFound(cells); });
}

absl::Status AttributeReads::ReadParts(Question& question, PartStream<v1::ReadBlocksResponse>& stream,
                                       std::vector<std::unique_ptr<FoundSource>>& sources) const {
  v1::ReadBlocksResponse part;
  const auto check = [&question](const v1::ReadBlocksResponse& p) { return question.CheckUpdate(p); };
  while (true) {
    absl::StatusOr<bool> more = stream.Next(part);
    if (!more.ok()) return more.status();
    if (!*more) return absl::OkStatus();
    if (absl::Status s = check(part); !s.ok()) return s;
    if (part.found().cell_hi_size() > 0) break;
    if (absl::Status s = question.SendCells(part); !s.ok()) return s;
  }
  sources.push_back(std::make_unique<FoundThere<v1::ReadBlocksResponse>>(&stream, std::move(part),
                                                                         question.columns.points(), check));
  return absl::OkStatus();
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
  std::vector<std::unique_ptr<Stream>> streams;
  for (const std::string& address : question.others)
    streams.push_back(Ask(*peers_, address, request, question.caller));
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
    v1::ReadBlocksResponse part;
    for (bool more = true; more && status.ok() && wrong.ok();) {
      absl::StatusOr<bool> next = stream->Next(part);
      status = next.status();
      more = next.ok() && *next;
      if (more) take(part);
    }
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
  return question.Send(answer);
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

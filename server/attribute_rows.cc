// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/attribute_rows.h"

#include <algorithm>
#include <utility>

#include "absl/cleanup/cleanup.h"
#include "absl/strings/str_cat.h"
#include "core/names/mesh_cells.h"
#include "core/names/name_of.h"
#include "core/navigate/cell_index.h"
#include "server/attribute_gates.h"
#include "server/block_version.h"
#include "server/found_cells.h"
#include "service/attributes.h"

namespace ndmap::server {
namespace {

// Looking up an id takes longer than going on to the next row.
constexpr size_t kIdsAStep = 2048;
constexpr size_t kWritesAStep = 4096;
// To look for a cell in the map takes some ten microseconds.
constexpr size_t kFindsAStep = 64;
constexpr absl::Duration kReadPatience = absl::Seconds(2);

CellId IdAt(const v1::CellSelection::Ids& ids, size_t k) {
  return CellId::FromWords(ids.hi(static_cast<int>(k)), ids.lo(static_cast<int>(k)));
}

// Whether a cell is told under this id, and not under another of its names: as it is with rows.
bool IsItsName(const InitialCells& initial, const CellId& id) {
  if (id.is_part()) return NameOf(initial, BoxOf(id)) == id;
  return id.is_cell() || (initial.mesh() != nullptr && initial.mesh()->Find(id).id == id);
}

// One question to the blocks of a server.
class RowReader {
 public:
  // OK while the map is in the state of which the answer is to be.
  using Check = std::function<absl::Status()>;

  RowReader(BlockHost& host, Check check, const v1::ReadBlocksRequest& request,
            const AttributeRows::Columns& columns, const AttributeRows::Gone& gone,
            const AttributeRows::TakePart& take)
      : host_(host),
        check_(std::move(check)),
        request_(request),
        columns_(columns),
        gone_(gone),
        take_(take),
        a_step_(request.select().has_ids() ? kIdsAStep : RowsAStep(columns_.columns)),
        builder_(columns_.columns) {}

  absl::Status ReadBlock(uint32_t block) {
    return InSteps(block, [this](Block3& b, AttributeStore& store) -> absl::StatusOr<bool> {
      absl::StatusOr<RowView> view = RowView::Make(b, store, request_.dimension(), columns_.columns);
      if (!view.ok()) return view.status();
      return Step(*view);
    });
  }

  // Cells without rows. Those that other blocks may have are left in the scan.
  absl::Status ReadScanned(uint32_t block, BlockScan& scan) {
    bool scanned = false;
    inner_.clear();
    return InSteps(block, [&](Block3& b, AttributeStore&) -> absl::StatusOr<bool> {
      if (next_ >= inner_.size() && !scanned) {
        inner_.clear();
        next_ = 0;
        absl::StatusOr<bool> over = scan.Step(b, inner_);
        if (!over.ok()) return over.status();
        scanned = *over;
      } else if (absl::Status s = CheckUnchanged(b, scan.version()); !s.ok()) {
        return s;
      }
      return AddCells(RowView::Of(&b, request_.dimension(), columns_.columns, inner_)) && scanned;
    });
  }

  // The cells without rows among those that are asked for by id.
  absl::Status FindIds(uint32_t block, const CellIndex& index, const InitialCells& initial) {
    return InSteps(block, [&](Block3& b, AttributeStore&) -> absl::StatusOr<bool> {
      if (absl::Status s = CheckUnchanged(b, index.version()); !s.ok()) return s;
      const v1::CellSelection::Ids& ids = request_.select().ids();
      const auto end = static_cast<size_t>(ids.hi_size());
      for (size_t k = 0; k < kFindsAStep && next_ < end && !builder_.full(); ++k, ++next_) {
        FoundCell cell{IdAt(ids, next_), DartIndex{}, block};
        if (cell.id.dimension() != request_.dimension()) continue;
        cell.dart = FindCell(b, index, initial, cell.id);
        // Names of nothing are left out first: they may be of no hexahedron.
        if (!cell.dart.valid() || !IsItsName(initial, cell.id)) continue;
        builder_.part().add_places(static_cast<uint32_t>(next_));
        builder_.Add(RowView::Of(&b, request_.dimension(), columns_.columns, absl::MakeConstSpan(&cell, 1)),
                     0);
      }
      return next_ >= end;
    });
  }

  // The last part. Before the first one, too: an answer has at least one, which says which update it is of.
  absl::Status Flush() {
    builder_.part().set_update(columns_.update);
    if (!take_(builder_.part())) return absl::CancelledError("the caller has gone");
    builder_.Clear();
    return absl::OkStatus();
  }

 private:
  // Calls `step` on the block's turns until it says true, and flushes in between.
  template <class F>
  absl::Status InSteps(uint32_t block, F step) {
    builder_.BeginBlock();
    next_ = 0;
    bool over = false;
    while (!over) {
      auto checked = [&](Block3& b, AttributeStore& store) -> absl::StatusOr<bool> {
        if (absl::Status s = check_(); !s.ok()) return s;
        absl::StatusOr<bool> done = step(b, store);
        if (!done.ok()) return done;
        over = *done;
        return over || builder_.full();
      };
      if (absl::Status s = host_.QuerySliced(request_.map(), block, checked, gone_); !s.ok()) return s;
      if (!builder_.full()) continue;
      if (absl::Status s = Flush(); !s.ok()) return s;
    }
    return absl::OkStatus();
  }

  // True when there are no more rows.
  bool Step(const RowView& view) {
    const v1::CellSelection& select = request_.select();
    if (!select.has_ids()) return AddCells(view);
    const auto end = static_cast<size_t>(select.ids().hi_size());
    for (size_t k = 0; k < a_step_ && next_ < end && !builder_.full(); ++k, ++next_) {
      const uint32_t row = view.Find(IdAt(select.ids(), next_));
      if (row == AttributeTable::kNoRow || view.CountsElsewhere(row)) continue;
      builder_.part().add_places(static_cast<uint32_t>(next_));
      builder_.Add(view, row);
    }
    return next_ >= end;
  }
  bool AddCells(const RowView& view) {
    for (size_t k = 0; k < a_step_ && next_ < view.size() && !builder_.full(); ++k, ++next_) {
      const auto row = static_cast<uint32_t>(next_);
      if (view.CountsElsewhere(row)) continue;
      const CellId id = view.id(row);
      if (!WithinLevels(request_.select(), id)) continue;
      builder_.part().add_cell_hi(id.hi());
      builder_.part().add_cell_lo(id.lo());
      builder_.Add(view, row);
    }
    return next_ >= view.size();
  }

  BlockHost& host_;
  const Check check_;
  const v1::ReadBlocksRequest& request_;
  const AttributeRows::Columns& columns_;
  const AttributeRows::Gone& gone_;
  const AttributeRows::TakePart& take_;
  const size_t a_step_;
  PartBuilder builder_;
  size_t next_ = 0;
  std::vector<FoundCell> inner_;
};

// One part of a write to one block.
class Applier {
 public:
  Applier(const v1::ApplyAttributeRequest& request, v1::ApplyAttributeResponse& response)
      : request_(request), response_(response) {}

  absl::StatusOr<bool> Step(AttributeStore& store) {
    Column* column = nullptr;
    AttributeTable* table = nullptr;
    for (unsigned i = 0; i < 4 && column == nullptr; ++i) {
      table = &store.table(i);
      column = table->FindNumber(request_.attribute_number());
    }
    if (column == nullptr) return true;
    if (!accepted_) {
      if (absl::Status s = Accept(store, *column); !s.ok()) return s;
    }
    if (code_ < used_.size()) return TakeUpCodes(*column);
    return request_.has_select() ? WriteAll(*table, *column) : WriteIds(*table, *column);
  }

 private:
  absl::Status Accept(AttributeStore& store, const Column& column) {
    const bool one = request_.has_select();
    const size_t count = one ? 1 : static_cast<size_t>(request_.ids().hi_size());
    absl::Status status = service::CheckValues(request_.values(), column.definition().type, count);
    if (!status.ok()) return status;
    if (!store.AcceptWrite(request_.sequence())) {
      return absl::AbortedError(
          absl::StrCat("part ", request_.sequence(), " of a write came after a later one: write again"));
    }
    accepted_ = true;
    used_.resize(static_cast<size_t>(request_.values().categories_size()));
    codes_.resize(used_.size());
    for (uint32_t code : request_.values().codes()) used_[code] = true;
    return absl::OkStatus();
  }

  // Also where none of the cells is: so all blocks have the same categories, and one has room when all have.
  absl::StatusOr<bool> TakeUpCodes(Column& column) {
    for (size_t k = 0; k < kWritesAStep && code_ < used_.size(); ++k, ++code_) {
      if (!used_[code_]) continue;
      absl::StatusOr<uint64_t> code = column.Code(request_.values().categories(static_cast<int>(code_)));
      if (!code.ok()) return code.status();
      codes_[code_] = *code;
    }
    return false;
  }

  ValueWords Value(const Column& column, size_t k) const {
    const ValueType type = column.definition().type;
    if (type != ValueType::kCategory) return service::NumberAt(request_.values(), type, static_cast<int>(k));
    return {codes_[request_.values().codes(static_cast<int>(k))], 0, 0};
  }

  absl::StatusOr<bool> WriteAll(const AttributeTable& table, Column& column) {
    const ValueWords value = Value(column, 0);
    for (size_t k = 0; k < kWritesAStep && next_ < table.size(); ++k, ++next_) {
      const auto row = static_cast<uint32_t>(next_);
      if (!WithinLevels(request_.select(), table.id(row))) continue;
      column.Set(row, value);
      if (!table.Is(row, AttributeTable::kElsewhere)) response_.set_written(response_.written() + 1);
    }
    return next_ >= table.size();
  }

  absl::StatusOr<bool> WriteIds(const AttributeTable& table, Column& column) {
    const auto end = static_cast<size_t>(request_.ids().hi_size());
    for (size_t k = 0; k < kIdsAStep && next_ < end; ++k, ++next_) {
      const uint32_t row = table.Find(IdAt(request_.ids(), next_));
      if (row == AttributeTable::kNoRow) continue;
      column.Set(row, Value(column, next_));
      if (!table.Is(row, AttributeTable::kElsewhere)) response_.add_found(static_cast<uint32_t>(next_));
    }
    return next_ >= end;
  }

  const v1::ApplyAttributeRequest& request_;
  v1::ApplyAttributeResponse& response_;
  bool accepted_ = false;
  std::vector<bool> used_;
  // By place in the message's categories.
  std::vector<uint64_t> codes_;
  size_t code_ = 0;
  size_t next_ = 0;
};

}  // namespace

absl::Status CheckIds(const v1::CellSelection::Ids& ids) {
  if (ids.hi_size() != ids.lo_size() || ids.hi_size() > service::kMaxPart) {
    return absl::InvalidArgumentError(absl::StrCat(ids.hi_size(), " upper and ", ids.lo_size(),
                                                   " lower words of ids, expected as many, and at most ",
                                                   service::kMaxPart, " in a message"));
  }
  for (int k = 0; k < ids.hi_size(); ++k) {
    if (CellId::FromWords(ids.hi(k), ids.lo(k)).IsWellFormed()) continue;
    return absl::InvalidArgumentError(absl::StrCat("the words ", absl::Hex(ids.hi(k), absl::kZeroPad16), " ",
                                                   absl::Hex(ids.lo(k), absl::kZeroPad16), " at place ", k,
                                                   " are no id of a cell"));
  }
  return absl::OkStatus();
}

absl::Status CheckSelection(const v1::CellSelection& select) {
  if (select.of_case() == v1::CellSelection::OF_NOT_SET) {
    return absl::InvalidArgumentError("select: expected ids, all or a query");
  }
  if (select.has_ids()) {
    if (absl::Status s = CheckIds(select.ids()); !s.ok()) return s;
  }
  if (!select.by_level()) return absl::OkStatus();
  if (!select.has_all())
    return absl::InvalidArgumentError("levels are asked for together with all cells only");
  if (select.lowest_level() <= select.highest_level()) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("levels ", select.lowest_level(), " to ",
                                                 select.highest_level(), ", expected the lower one first"));
}

bool WithinLevels(const v1::CellSelection& select, const CellId& id) {
  if (!select.by_level()) return true;
  const auto level = static_cast<uint32_t>(id.level());
  return select.lowest_level() <= level && level <= select.highest_level();
}

bool AttributeRows::Columns::points() const {
  return std::any_of(columns.begin(), columns.end(),
                     [](const AskedColumn& c) { return c.kind == AskedColumn::Kind::kPoint; });
}

absl::StatusOr<AttributeRows::Columns> AttributeRows::Resolve(const std::string& map, unsigned dimension,
                                                              const Names& names) const {
  absl::StatusOr<BlockHost::MapInfo> info = host_->Info(map);
  if (!info.ok()) return info.status();
  if (info->blocks.empty()) {
    return absl::NotFoundError(
        absl::StrCat("server ", host_->address(), " has no block of map \"", map, "\""));
  }
  absl::StatusOr<std::shared_ptr<AttributeGates>> gates = host_->Gates(map);
  if (!gates.ok()) return gates.status();
  absl::StatusOr<uint64_t> update = (*gates)->Update(kReadPatience);
  if (!update.ok()) return update.status();
  Columns result;
  result.update = *update;
  absl::Status status = host_->Query(map, info->blocks.front(), [&](Block3&, AttributeStore& store) {
    if (absl::Status s = store.CheckReadable(); !s.ok()) return s;
    absl::StatusOr<std::vector<AskedColumn>> columns = ResolveColumns(store, dimension, names);
    if (!columns.ok()) return columns.status();
    result.columns = *std::move(columns);
    result.by_scan = store.table(dimension).columns().empty();
    return absl::OkStatus();
  });
  if (!status.ok()) return status;
  if (!result.by_scan) return result;
  absl::StatusOr<uint64_t> rest = host_->AtRest(map);
  if (!rest.ok()) return rest.status();
  result.update = *rest;
  return result;
}

absl::Status AttributeRows::CheckState(const std::string& map, AttributeGates& gates,
                                       const Columns& columns) const {
  absl::StatusOr<uint64_t> state = columns.by_scan ? host_->AtRest(map) : gates.Update();
  if (!state.ok()) return state.status();
  return *state == columns.update ? absl::OkStatus() : AttributesChanged();
}

absl::Status AttributeRows::Read(const v1::ReadBlocksRequest& request, const Gone& gone,
                                 const TakePart& take) const {
  if (absl::Status s = CheckSelection(request.select()); !s.ok()) return s;
  if (request.select().has_query()) {
    return absl::InvalidArgumentError("a question to blocks is about ids or about all cells");
  }
  absl::StatusOr<BlockHost::MapInfo> info = host_->Info(request.map());
  if (!info.ok()) return info.status();
  absl::StatusOr<std::shared_ptr<AttributeGates>> gates = host_->Gates(request.map());
  if (!gates.ok()) return gates.status();
  absl::StatusOr<Columns> columns = Resolve(request.map(), request.dimension(), request.names());
  if (!columns.ok()) return columns.status();
  if (columns->by_scan && request.select().has_all()) {
    return ReadAllFound(request, *info, **gates, *columns, gone, take);
  }
  RowReader reader(
      *host_, [&] { return CheckState(request.map(), **gates, *columns); }, request, *columns, gone, take);
  for (uint32_t b : info->blocks) {
    absl::Status status;
    if (!columns->by_scan) {
      status = reader.ReadBlock(b);
    } else {
      absl::StatusOr<std::shared_ptr<const InitialCells>> initial = host_->Initial(request.map(), b);
      if (!initial.ok()) return initial.status();
      absl::StatusOr<std::shared_ptr<const CellIndex>> index = answers_->Index(request.map(), b, 0, gone);
      if (!index.ok()) return index.status();
      status = reader.FindIds(b, **index, **initial);
    }
    if (!status.ok()) return status;
  }
  return reader.Flush();
}

absl::Status AttributeRows::ReadAllFound(const v1::ReadBlocksRequest& request, const BlockHost::MapInfo& info,
                                         AttributeGates& gates, const Columns& columns, const Gone& gone,
                                         const TakePart& take) const {
  std::vector<FoundCell> outer;
  {
    absl::StatusOr<std::unique_ptr<ScanTurns::Turn>> turn = WaitForScan(gone);
    if (!turn.ok()) return turn.status();
    RowReader reader(
        *host_, [&] { return CheckState(request.map(), gates, columns); }, request, columns, gone, take);
    for (uint32_t b : info.blocks) {
      absl::StatusOr<std::shared_ptr<const InitialCells>> initial = host_->Initial(request.map(), b);
      if (!initial.ok()) return initial.status();
      BlockScan scan(request.dimension(), columns.points(), *std::move(initial));
      if (absl::Status s = reader.ReadScanned(b, scan); !s.ok()) return s;
      outer = MergeFound(std::move(outer), scan.TakeOuter());
    }
    if (absl::Status s = reader.Flush(); !s.ok()) return s;
  }
  std::erase_if(outer, [&](const FoundCell& cell) { return !WithinLevels(request.select(), cell.id); });
  const bool sent = SendFound(outer, columns.points(), [&](v1::FoundCells&& found) {
    v1::ReadBlocksResponse part;
    part.set_update(columns.update);
    *part.mutable_found() = std::move(found);
    return take(part);
  });
  return sent ? absl::OkStatus() : absl::CancelledError("the caller has gone");
}

bool SendFound(const std::vector<FoundCell>& cells, bool points,
               const std::function<bool(v1::FoundCells&&)>& send) {
  for (size_t begin = 0; begin < cells.size(); begin += kFoundInAPart) {
    v1::FoundCells found;
    ToWire(cells, begin, std::min(begin + kFoundInAPart, cells.size()), points, found);
    if (!send(std::move(found))) return false;
  }
  return true;
}

absl::Status AttributeRows::Apply(const v1::ApplyAttributeRequest& request,
                                  v1::ApplyAttributeResponse& response) const {
  if (absl::Status s = CheckIds(request.ids()); !s.ok()) return s;
  if (request.has_select() && !request.select().has_all()) {
    return absl::InvalidArgumentError("a part of a write is about ids or about all cells");
  }
  absl::StatusOr<BlockHost::MapInfo> info = host_->Info(request.map());
  if (!info.ok()) return info.status();
  if (info->number != request.map_number()) {
    return absl::NotFoundError(absl::StrCat("server ", host_->address(), " has another map \"", request.map(),
                                            "\" than number ", request.map_number()));
  }
  absl::StatusOr<std::shared_ptr<AttributeGates>> gates = host_->Gates(request.map());
  if (!gates.ok()) return gates.status();
  if (absl::Status s = (*gates)->BeginApply(); !s.ok()) return s;
  const absl::Cleanup end = [&] { (*gates)->EndApply(); };
  for (uint32_t b : info->blocks) {
    Applier applier(request, response);
    absl::Status status = host_->QuerySliced(
        request.map(), b, [&](Block3&, AttributeStore& store) { return applier.Step(store); },
        [] { return false; });
    if (!status.ok()) return status;
  }
  return absl::OkStatus();
}

}  // namespace ndmap::server

// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/explorer.h"

#include <algorithm>
#include <limits>
#include <set>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "server/cell_details.h"
#include "server/nearest.h"

namespace ndmap::server {
namespace {

constexpr int kMaxAnchors = 1 << 16;
constexpr int kMaxClosures = 64;
constexpr int kExploreAttempts = 4;
constexpr char kLimitFlag[] = "--max-query-darts";
// Cells or darts in a part of an answer: some hundred kilobytes.
constexpr size_t kPart = 1 << 15;
constexpr size_t kDetailsPart = 1 << 10;

// Names the limit, which core does not know by its flag.
absl::Status WithLimit(const absl::Status& status) {
  if (!absl::IsResourceExhausted(status) || absl::StrContains(status.message(), kLimitFlag)) return status;
  return absl::ResourceExhaustedError(
      absl::StrCat(status.message(), " (max_darts of the question, ", kLimitFlag, " of the server)"));
}

absl::Status CheckRequest(const v1::ExploreRequest& request) {
  if (request.anchors_size() < 1 || request.anchors_size() > kMaxAnchors) {
    return absl::InvalidArgumentError(
        absl::StrCat(request.anchors_size(), " anchors, expected 1 to ", kMaxAnchors));
  }
  if (request.close_size() > kMaxClosures) {
    return absl::InvalidArgumentError(
        absl::StrCat(request.close_size(), " closures, expected at most ", kMaxClosures));
  }
  for (uint32_t i : request.close()) {
    if (i > 3)
      return absl::InvalidArgumentError(absl::StrCat("a closure over dimension ", i, ", expected 0 to 3"));
  }
  if (request.give() == v1::GIVE_UNSPECIFIED || !v1::Give_IsValid(request.give())) {
    return absl::InvalidArgumentError("give: expected darts, cells or cell details");
  }
  if (request.dimension() > 3) {
    return absl::InvalidArgumentError(
        absl::StrCat("cells of dimension ", request.dimension(), ", expected 0 to 3"));
  }
  return absl::OkStatus();
}

// Where a question begins.
class Anchors {
 public:
  explicit Anchors(RemoteBlocks& blocks) : blocks_(blocks) {}

  absl::StatusOr<DartSet> Resolve(const v1::ExploreRequest& request) {
    for (const v1::Anchor& anchor : request.anchors()) {
      if (absl::Status s = Add(anchor); !s.ok()) return s;
    }
    if (absl::Status s = Find(); !s.ok()) return s;
    for (auto& [b, part] : set_.blocks) {
      std::sort(part.darts.begin(), part.darts.end());
      part.darts.erase(std::unique(part.darts.begin(), part.darts.end()), part.darts.end());
    }
    if (set_.size() > blocks_.max_darts()) {
      return absl::ResourceExhaustedError(absl::StrCat("the anchors have ", set_.size(),
                                                       " darts, over the limit of ", blocks_.max_darts(),
                                                       " (max_darts, --max-query-darts)"));
    }
    return std::move(set_);
  }

 private:
  absl::Status Add(const v1::Anchor& anchor) {
    const uint32_t count = blocks_.block_count();
    if (anchor.has_dart() || anchor.at_case() == v1::Anchor::kBlock) {
      const uint32_t b = anchor.has_dart() ? anchor.dart().block() : anchor.block();
      if (b >= count) {
        return absl::NotFoundError(absl::StrCat("the map has no block ", b, ": it has ", count));
      }
      if (!anchor.has_dart()) {
        *in_block_[b].add_anchors() = anchor;
        return absl::OkStatus();
      }
      DartSet::OfBlock& part = set_.blocks[BlockId{b}];
      const uint64_t version = anchor.dart().version();
      if (part.version != 0 && version != 0 && part.version != version) {
        return absl::FailedPreconditionError(
            absl::StrCat("darts of block ", b, " at versions ", part.version, " and ", version,
                         " in one question: one of them is stale, ask for it again"));
      }
      if (version != 0) part.version = version;
      part.darts.push_back(DartIndex{anchor.dart().dart()});
      return absl::OkStatus();
    }
    v1::Anchor& everywhere = *anchors_.add_anchors();
    everywhere = anchor;
    if (anchor.at_case() == v1::Anchor::kText) {
      absl::StatusOr<CellId> id = CellId::Parse(anchor.text());
      if (!id.ok()) return id.status();
      ToWire(*id, *everywhere.mutable_cell());
    } else if (anchor.has_cell()) {
      if (absl::StatusOr<CellId> id = FromWire(anchor.cell()); !id.ok()) return id.status();
    } else if (anchor.at_case() == v1::Anchor::AT_NOT_SET) {
      return absl::InvalidArgumentError(
          "an anchor is a dart, a cell, a point, a box, a nearest vertex or a block");
    }
    return absl::OkStatus();
  }

  absl::Status Find() {
    std::vector<v1::AskBlockRequest> requests;
    for (uint32_t b = 0; b < blocks_.block_count(); ++b) {
      const auto own = in_block_.find(b);
      if (anchors_.anchors_size() == 0 && own == in_block_.end()) continue;
      v1::AskBlockRequest& request = requests.emplace_back();
      request.set_block(b);
      if (const auto part = set_.blocks.find(BlockId{b}); part != set_.blocks.end())
        request.set_version(part->second.version);
      *request.mutable_find() = anchors_;
      if (own != in_block_.end()) request.mutable_find()->MergeFrom(own->second);
    }
    const std::vector<v1::AskBlockRequest> asked = requests;
    absl::StatusOr<std::vector<v1::AskBlockResponse>> answers = blocks_.Ask(std::move(requests));
    if (!answers.ok()) return answers.status();
    std::vector<bool> found(static_cast<size_t>(anchors_.anchors_size()));
    std::vector<NearestOfBlock> nearest;
    for (size_t k = 0; k < answers->size(); ++k) {
      const BlockId block{asked[k].block()};
      const v1::FindAnswer& answer = (*answers)[k].find();
      DartSet::OfBlock& part = set_.blocks[block];
      part.version = (*answers)[k].version();
      for (int row = 0; row < answer.darts_size(); ++row) {
        const DartIndex dart{answer.darts(row)};
        const size_t a = answer.anchors(row);
        if (a >= found.size() || !anchors_.anchors(static_cast<int>(a)).has_nearest_vertex()) {
          part.darts.push_back(dart);
          if (a < found.size()) found[a] = true;
          continue;
        }
        nearest.push_back(
            {a, answer.distances(row), CellId::FromWords(answer.hi(row), answer.lo(row)), block, dart});
      }
    }
    for (size_t a = 0; a < found.size(); ++a) {
      const v1::Anchor& anchor = anchors_.anchors(static_cast<int>(a));
      if (anchor.has_cell() && !found[a]) {
        return absl::NotFoundError(absl::StrCat(
            "the map has no cell ", CellId::FromWords(anchor.cell().hi(), anchor.cell().lo()).ToString(),
            " (it was split, removed, or never there)"));
      }
    }
    return ChooseNearest(blocks_, anchors_, std::move(nearest), set_);
  }

  RemoteBlocks& blocks_;
  DartSet set_;
  v1::FindQuestion anchors_;
  std::map<uint32_t, v1::FindQuestion> in_block_;
};

// Parts of an answer, each below the size of a message.
class Parts {
 public:
  explicit Parts(const DartSet& set) {
    parts_.emplace_back();
    for (const auto& [b, part] : set.blocks) {
      parts_[0].add_blocks(b.value);
      parts_[0].add_versions(part.version);
    }
  }

  void AddDarts(const DartSet& set) {
    for (const auto& [b, part] : set.blocks) {
      for (DartIndex d : part.darts) {
        v1::ExploreResponse& out = Room(kPart);
        out.add_dart_blocks(b.value);
        out.add_darts(d.value);
      }
    }
  }
  void AddCells(const CellDarts& cells) {
    for (const auto& [id, dart] : cells) {
      v1::ExploreResponse& out = Room(kPart);
      out.add_cell_hi(id.hi());
      out.add_cell_lo(id.lo());
    }
  }
  void AddDetails(std::vector<v1::CellDetails> details) {
    for (v1::CellDetails& cell : details) *Room(kDetailsPart).add_cells() = std::move(cell);
  }
  std::vector<v1::ExploreResponse> Take() { return std::move(parts_); }

 private:
  v1::ExploreResponse& Room(size_t most) {
    if (in_part_++ == most) {
      parts_.emplace_back();
      in_part_ = 1;
    }
    return parts_.back();
  }

  std::vector<v1::ExploreResponse> parts_;
  size_t in_part_ = 0;
};

}  // namespace

absl::StatusOr<std::vector<v1::ExploreResponse>> Explorer::Once(const v1::ExploreRequest& request,
                                                                const std::function<bool()>& gone) {
  absl::StatusOr<BlockHost::MapInfo> info = host_->Info(request.map());
  if (!info.ok()) return info.status();
  const uint64_t most =
      request.max_darts() == 0 ? max_darts_ : std::min<uint64_t>(request.max_darts(), max_darts_);
  RemoteBlocks blocks(request.map(), *std::move(info), host_->address(), &answers_, peers_, gone, most);
  absl::StatusOr<DartSet> start = Anchors(blocks).Resolve(request);
  if (!start.ok()) return start.status();
  DartSet set = *start;
  if (request.close_size() == 0) {
    // Nobody has looked yet whether the darts that the client named are there.
    if (absl::StatusOr<CellDarts> cells = CellsOf(blocks, set, 3); !cells.ok()) return cells.status();
  }
  for (uint32_t i : request.close()) {
    absl::StatusOr<DartSet> closed = Close(blocks, i, set, most);
    if (!closed.ok()) return closed.status();
    set = *std::move(closed);
  }
  for (auto& [b, part] : start->blocks) part.version = set.blocks[b].version;
  if (request.give() == v1::GIVE_DARTS) {
    Parts parts(set);
    parts.AddDarts(set);
    return parts.Take();
  }
  absl::StatusOr<CellDarts> cells = CellsOf(blocks, set, request.dimension());
  if (!cells.ok()) return cells.status();
  if (request.without_anchors()) {
    absl::StatusOr<CellDarts> own = CellsOf(blocks, *start, request.dimension());
    if (!own.ok()) return own.status();
    for (const auto& [id, dart] : *own) cells->erase(id);
  }
  Parts parts(set);
  if (request.give() == v1::GIVE_CELLS) {
    parts.AddCells(*cells);
    return parts.Take();
  }
  absl::StatusOr<std::vector<v1::CellDetails>> details = DetailsOf(blocks, *cells, set, request.dimension());
  if (!details.ok()) return details.status();
  parts.AddDetails(*std::move(details));
  return parts.Take();
}

absl::Status Explorer::Explore(const v1::ExploreRequest& request, const std::function<bool()>& gone,
                               const std::function<bool(const v1::ExploreResponse&)>& write) {
  if (absl::Status s = CheckRequest(request); !s.ok()) return s;
  // A version that the client did not name is one that this question met itself.
  const bool names_version =
      std::any_of(request.anchors().begin(), request.anchors().end(),
                  [](const v1::Anchor& anchor) { return anchor.has_dart() && anchor.dart().version() != 0; });
  absl::StatusOr<std::vector<v1::ExploreResponse>> parts = absl::AbortedError("");
  for (int k = 0; k < kExploreAttempts; ++k) {
    parts = Once(request, gone);
    const bool changed =
        absl::IsAborted(parts.status()) || (absl::IsFailedPrecondition(parts.status()) && !names_version);
    if (!changed) break;
  }
  if (!parts.ok()) return WithLimit(parts.status());
  for (const v1::ExploreResponse& part : *parts) {
    if (!write(part)) return absl::CancelledError("the caller has gone");
  }
  return absl::OkStatus();
}

}  // namespace ndmap::server

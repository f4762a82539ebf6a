// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/cell_details.h"

#include <algorithm>
#include <array>
#include <set>
#include <tuple>
#include <utility>

#include "absl/container/flat_hash_map.h"
#include "absl/strings/str_cat.h"
#include "core/names/cell_names.h"

namespace ndmap::server {
namespace {

// Darts in one question: its answer, with everything asked for, is some megabytes.
constexpr size_t kDartsAQuestion = 1 << 15;

constexpr uint32_t kNoCorner = CellNames<Block3>::kNoCorner;

// Questions for the names of a set's darts, and which darts each is about.
struct Naming {
  std::vector<v1::AskBlockRequest> requests;
  std::vector<absl::Span<const DartIndex>> darts;
};

Naming Questions(const DartSet& set, unsigned dimension, bool all) {
  Naming naming;
  for (const auto& [b, part] : set.blocks) {
    for (size_t begin = 0; begin < part.darts.size(); begin += kDartsAQuestion) {
      naming.darts.push_back(absl::MakeConstSpan(part.darts).subspan(begin, kDartsAQuestion));
      v1::AskBlockRequest& request = naming.requests.emplace_back();
      request.set_block(b.value);
      request.set_version(part.version);
      request.mutable_name()->set_dimension(dimension);
      request.mutable_name()->set_all(all);
      for (DartIndex d : naming.darts.back()) request.mutable_name()->add_darts(d.value);
    }
  }
  return naming;
}

absl::Status CheckAnswer(const v1::AskBlockResponse& answer, uint32_t block, uint64_t* version,
                         size_t names) {
  if (*version == 0) *version = answer.version();
  if (*version != answer.version()) {
    return absl::AbortedError(absl::StrCat("block ", block, " changed during the query"));
  }
  if (static_cast<size_t>(answer.name().hi_size()) != names ||
      static_cast<size_t>(answer.name().lo_size()) != names) {
    return absl::InternalError(
        absl::StrCat("block ", block, " named ", answer.name().hi_size(), " of ", names));
  }
  return absl::OkStatus();
}

// What is known of one dart.
struct DartFacts {
  BlockId block;
  DartIndex dart;
  std::array<CellId, 4> ids;
  Point3 point{};
  bool free = false;
  DartIndex next;
  CellState state = CellState::kUnknown;
  CellKind kind = CellKind::kHexahedron;
  // Of its 3-cell, where the dart starts; kNoCorner at a vertex that only hangs on it.
  uint32_t corner = kNoCorner;

  // The order that makes one dart of a cell canonical.
  std::tuple<const CellId&, const CellId&, const CellId&> Rank() const { return {ids[3], ids[2], ids[1]}; }
};

absl::StatusOr<std::vector<DartFacts>> FactsOf(RemoteBlocks& blocks, DartSet& set) {
  Naming naming = Questions(set, 0, true);
  const std::vector<v1::AskBlockRequest> asked = naming.requests;
  absl::StatusOr<std::vector<v1::AskBlockResponse>> answers = blocks.Ask(std::move(naming.requests));
  if (!answers.ok()) return answers.status();
  std::vector<DartFacts> facts;
  for (size_t k = 0; k < asked.size(); ++k) {
    const uint32_t b = asked[k].block();
    const absl::Span<const DartIndex> darts = naming.darts[k];
    absl::Status status = CheckAnswer((*answers)[k], b, &set.blocks[BlockId{b}].version, 4 * darts.size());
    if (!status.ok()) return status;
    const v1::NameAnswer& answer = (*answers)[k].name();
    const int n = static_cast<int>(darts.size());
    if (answer.points_size() != 3 * n || answer.free_size() != n || answer.next_size() != n ||
        answer.states_size() != n || answer.corners_size() != n || answer.kinds_size() != n) {
      return absl::InternalError(absl::StrCat("block ", b, " described other darts than it was asked about"));
    }
    for (int i = 0; i < n; ++i) {
      DartFacts& fact = facts.emplace_back();
      fact.block = BlockId{b};
      fact.dart = darts[static_cast<size_t>(i)];
      for (int j = 0; j < 4; ++j)
        fact.ids[static_cast<size_t>(j)] = CellId::FromWords(answer.hi(4 * i + j), answer.lo(4 * i + j));
      fact.point = {answer.points(3 * i), answer.points(3 * i + 1), answer.points(3 * i + 2)};
      fact.free = answer.free(i);
      fact.next = DartIndex{answer.next(i)};
      fact.state = static_cast<CellState>(answer.states(i));
      if (answer.kinds(i) >= kCellKinds) {
        return absl::InternalError(absl::StrCat("block ", b, " described a cell of kind ", answer.kinds(i)));
      }
      fact.kind = static_cast<CellKind>(answer.kinds(i));
      fact.corner = answer.corners(i);
    }
  }
  return facts;
}

void AddVertex(const DartFacts& at, v1::CellDetails& cell) {
  ToWire(at.ids[0], *cell.add_vertices());
  v1::Point& p = *cell.add_points();
  p.set_x(at.point[0]);
  p.set_y(at.point[1]);
  p.set_z(at.point[2]);
}

// The vertices of a cell, from all its darts.
void AddVertices(const DartFacts& canonical, const std::vector<const DartFacts*>& darts,
                 v1::CellDetails& cell) {
  if (cell.dimension() == 2) {
    absl::flat_hash_map<DartIndex, const DartFacts*> here;
    for (const DartFacts* d : darts) {
      if (d->block == canonical.block) here[d->dart] = d;
    }
    const DartFacts* d = &canonical;
    do {
      AddVertex(*d, cell);
      const auto next = here.find(d->next);
      if (next == here.end()) return;
      d = next->second;
    } while (d != &canonical && cell.vertices_size() <= static_cast<int>(here.size()));
    return;
  }
  if (cell.dimension() == 3) {
    std::map<uint32_t, const DartFacts*> corners;
    for (const DartFacts* d : darts) {
      if (d->corner != kNoCorner) corners.try_emplace(d->corner, d);
    }
    for (const auto& [corner, d] : corners) AddVertex(*d, cell);
    return;
  }
  std::map<CellId, const DartFacts*> vertices;
  for (const DartFacts* d : darts) vertices.try_emplace(d->ids[0], d);
  AddVertex(canonical, cell);
  for (const auto& [vertex, d] : vertices) {
    if (vertex != canonical.ids[0]) AddVertex(*d, cell);
  }
}

}  // namespace

const char* StateName(CellState state) {
  switch (state) {
    case CellState::kOutside:
      return "outside";
    case CellState::kInside:
      return "inside";
    case CellState::kCut:
      return "cut";
    default:
      return "unknown";
  }
}

absl::StatusOr<CellDarts> CellsOf(RemoteBlocks& blocks, DartSet& set, unsigned dimension) {
  Naming naming = Questions(set, dimension, false);
  const std::vector<v1::AskBlockRequest> asked = naming.requests;
  absl::StatusOr<std::vector<v1::AskBlockResponse>> answers = blocks.Ask(std::move(naming.requests));
  if (!answers.ok()) return answers.status();
  CellDarts cells;
  for (size_t k = 0; k < asked.size(); ++k) {
    const BlockId b{asked[k].block()};
    absl::Status status = CheckAnswer((*answers)[k], b.value, &set.blocks[b].version, naming.darts[k].size());
    if (!status.ok()) return status;
    const v1::NameAnswer& answer = (*answers)[k].name();
    for (int i = 0; i < answer.hi_size(); ++i) {
      cells.try_emplace(CellId::FromWords(answer.hi(i), answer.lo(i)), b,
                        naming.darts[k][static_cast<size_t>(i)]);
    }
  }
  return cells;
}

absl::StatusOr<std::vector<v1::CellDetails>> DetailsOf(RemoteBlocks& blocks, const CellDarts& cells,
                                                       const DartSet& versions, unsigned dimension) {
  DartSet one;
  for (const auto& [id, place] : cells) {
    DartSet::OfBlock& part = one.blocks[place.first];
    part.version = versions.blocks.at(place.first).version;
    part.darts.push_back(place.second);
  }
  absl::StatusOr<DartSet> whole = Close(blocks, dimension, one, blocks.max_darts());
  if (!whole.ok()) return whole.status();
  absl::StatusOr<std::vector<DartFacts>> facts = FactsOf(blocks, *whole);
  if (!facts.ok()) return facts.status();
  std::map<CellId, std::vector<const DartFacts*>> darts_of;
  for (const DartFacts& fact : *facts) darts_of[fact.ids[dimension]].push_back(&fact);

  std::vector<v1::CellDetails> details;
  for (const auto& [id, darts] : darts_of) {
    v1::CellDetails& cell = details.emplace_back();
    const DartFacts& canonical =
        **std::min_element(darts.begin(), darts.end(),
                           [](const DartFacts* a, const DartFacts* b) { return a->Rank() < b->Rank(); });
    ToWire(id, *cell.mutable_id());
    cell.set_text(id.ToString());
    cell.set_dimension(dimension);
    cell.set_level(static_cast<uint32_t>(id.level()));
    if (dimension == 3) {
      cell.set_state(StateName(canonical.state));
      cell.set_kind(std::string(ShapeOf(canonical.kind).name));
    }
    cell.mutable_dart()->set_block(canonical.block.value);
    cell.mutable_dart()->set_dart(canonical.dart.value);
    cell.mutable_dart()->set_version(whole->blocks[canonical.block].version);
    std::set<uint32_t> in;
    for (const DartFacts* d : darts) {
      in.insert(d->block.value);
      if (d->free) cell.set_boundary(true);
    }
    cell.mutable_blocks()->Add(in.begin(), in.end());
    cell.set_darts(static_cast<uint32_t>(darts.size()));
    AddVertices(canonical, darts, cell);
  }
  return details;
}

}  // namespace ndmap::server

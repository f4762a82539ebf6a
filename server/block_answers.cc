// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/block_answers.h"

#include <cmath>
#include <optional>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/algorithm/refine/frame.h"
#include "core/navigate/cell_shape.h"
#include "core/navigate/dart_names.h"
#include "core/navigate/nearest_search.h"
#include "core/navigate/orbit.h"
#include "server/block_version.h"
#include "server/walk_answer.h"
#include "server/wire.h"

namespace ndmap::server {
namespace {

// A step takes about a millisecond.
constexpr size_t kDartsAStep = 2000;
constexpr size_t kHexahedraAStep = 300;
constexpr size_t kPartsAStep = 32;

bool IsFinite(const v1::Point& p) {
  return std::isfinite(p.x()) && std::isfinite(p.y()) && std::isfinite(p.z());
}
Point3 PointOf(const v1::Point& p) { return {p.x(), p.y(), p.z()}; }

absl::Status BadPoint(const v1::Point& p) {
  return absl::InvalidArgumentError(
      absl::StrCat("a point of coordinates ", p.x(), ", ", p.y(), ", ", p.z(), ", expected finite numbers"));
}

// The box of a point or box anchor.
absl::StatusOr<Box3> BoxOf(const v1::Anchor& anchor) {
  if (anchor.has_point()) {
    if (!IsFinite(anchor.point())) return BadPoint(anchor.point());
    return Box3{PointOf(anchor.point()), PointOf(anchor.point())};
  }
  const v1::Box& box = anchor.box();
  for (const v1::Point& p : {box.lo(), box.hi()}) {
    if (!IsFinite(p)) return BadPoint(p);
  }
  if (box.lo().x() > box.hi().x() || box.lo().y() > box.hi().y() || box.lo().z() > box.hi().z()) {
    return absl::InvalidArgumentError("a box whose low corner is above its high corner");
  }
  return Box3{PointOf(box.lo()), PointOf(box.hi())};
}

}  // namespace

absl::StatusOr<CellId> FromWire(const v1::CellId& id) {
  const CellId cell = CellId::FromWords(id.hi(), id.lo());
  if (cell.IsWellFormed()) return cell;
  return absl::InvalidArgumentError(absl::StrCat("the words ", absl::Hex(id.hi(), absl::kZeroPad16), " ",
                                                 absl::Hex(id.lo(), absl::kZeroPad16),
                                                 " are no id of a cell"));
}

void ToWire(const CellId& id, v1::CellId& wire) {
  wire.set_hi(id.hi());
  wire.set_lo(id.lo());
}

struct BlockAnswers::Asked {
  const v1::AskBlockRequest& request;
  const std::function<bool()>& gone;
  BlockHost::MapInfo info;

  const std::string& map() const { return request.map(); }
  uint32_t block() const { return request.block(); }
};

absl::Status BlockAnswers::Answer(const v1::AskBlockRequest& request, const std::function<bool()>& gone,
                                  v1::AskBlockResponse& response) {
  absl::StatusOr<BlockHost::MapInfo> info = host_->Info(request.map());
  if (!info.ok()) return info.status();
  const Asked asked{request, gone, *std::move(info)};
  switch (request.question_case()) {
    case v1::AskBlockRequest::kExpand:
      return Expand(asked, response);
    case v1::AskBlockRequest::kName:
      return Name(asked, response);
    case v1::AskBlockRequest::kFind:
      return Find(asked, response);
    case v1::AskBlockRequest::kResolve:
      return Resolve(asked, response);
    case v1::AskBlockRequest::kWalk:
      return AnswerWalk(*host_, request, gone, response);
    default:
      return absl::InvalidArgumentError(
          "a question to a block is to expand, to name, to find, to resolve or to walk");
  }
}

absl::Status BlockAnswers::Expand(const Asked& asked, v1::AskBlockResponse& response) {
  const v1::ExpandQuestion& question = asked.request.expand();
  std::vector<OrbitSeed> seeds;
  for (const v1::OrbitSeed& seed : question.seeds()) {
    if (seed.has_dart()) {
      seeds.push_back({OrbitSeed::Kind::kDart, DartIndex{seed.dart()}, {}});
    } else {
      const bool after = seed.has_after_label();
      seeds.push_back({after ? OrbitSeed::Kind::kAfterLabel : OrbitSeed::Kind::kLabel,
                       {},
                       FromWire(after ? seed.after_label() : seed.label())});
    }
  }
  for (uint32_t d : question.darts()) seeds.push_back({OrbitSeed::Kind::kDart, DartIndex{d}, {}});
  const uint64_t most =
      question.max_darts() == 0 ? max_darts_ : std::min<uint64_t>(question.max_darts(), max_darts_);
  OrbitExpander<Block3> expander(question.dimension(), seeds, most);
  bool begun = false;
  auto step = [&](Block3& block) -> absl::StatusOr<bool> {
    if (!begun) {
      if (absl::Status s = CheckVersion(block, asked.request.version()); !s.ok()) return s;
    }
    begun = true;
    return expander.Step(block, kDartsAStep);
  };
  if (absl::Status s = host_->QuerySliced(asked.map(), asked.block(), step, asked.gone); !s.ok()) return s;
  const OrbitPiece piece = expander.Take();
  response.set_version(piece.version);
  v1::ExpandAnswer& answer = *response.mutable_expand();
  answer.mutable_darts()->Reserve(static_cast<int>(piece.darts.size()));
  for (DartIndex d : piece.darts) answer.add_darts(d.value);
  for (const OrbitCrossing& crossing : piece.crossings) {
    v1::OrbitCrossing& wire = *answer.add_crossings();
    server::ToWire(crossing.label, *wire.mutable_label());
    wire.set_after(crossing.kind == OrbitSeed::Kind::kAfterLabel);
    wire.set_has_peer(crossing.peer.valid());
    if (crossing.peer.valid()) wire.set_peer(crossing.peer.value);
  }
  answer.mutable_not_here()->Add(piece.not_here.begin(), piece.not_here.end());
  return absl::OkStatus();
}

absl::Status BlockAnswers::Name(const Asked& asked, v1::AskBlockResponse& response) {
  const v1::NameQuestion& question = asked.request.name();
  if (question.dimension() > 3) {
    return absl::InvalidArgumentError(
        absl::StrCat("a cell of dimension ", question.dimension(), " in a map of dimension 3"));
  }
  if (static_cast<uint64_t>(question.darts_size()) > max_darts_) {
    return absl::ResourceExhaustedError(absl::StrCat(question.darts_size(), " darts in one question, over ",
                                                     max_darts_, " (--max-query-darts)"));
  }
  absl::StatusOr<std::shared_ptr<const InitialCells>> initial = host_->Initial(asked.map(), asked.block());
  if (!initial.ok()) return initial.status();
  std::vector<DartIndex> darts;
  for (uint32_t d : question.darts()) darts.push_back(DartIndex{d});
  DartNamer<Block3> namer(**initial, darts);
  v1::NameAnswer& answer = *response.mutable_name();
  uint64_t version = 0;
  auto step = [&](Block3& block) -> absl::StatusOr<bool> {
    if (absl::Status s = CheckVersion(block, version == 0 ? asked.request.version() : version); !s.ok())
      return s;
    version = block.version();
    return namer.Step(block, kDartsAStep / 4);
  };
  if (absl::Status s = host_->QuerySliced(asked.map(), asked.block(), step, asked.gone); !s.ok()) return s;
  for (const DartIds& ids : namer.ids()) {
    for (unsigned i = 0; i < 4; ++i) {
      if (!question.all() && i != question.dimension()) continue;
      answer.add_hi(ids[i].hi());
      answer.add_lo(ids[i].lo());
    }
  }
  response.set_version(version);
  if (!question.all()) return absl::OkStatus();
  answer.mutable_corners()->Add(namer.corners().begin(), namer.corners().end());
  size_t next = 0;
  auto describe = [&](Block3& block) -> absl::StatusOr<bool> {
    if (absl::Status s = CheckVersion(block, version); !s.ok()) return s;
    auto& map = block.map();
    for (size_t k = 0; k < kDartsAStep && next < darts.size(); ++k, ++next) {
      const auto d = DartAt(map, darts[next]);
      const Point3 p = Frame<Block3>::StartPoint(map, d);
      answer.mutable_points()->Add(p.begin(), p.end());
      answer.add_free(map.is_free<3>(d) && !block.IsCritical(d));
      answer.add_next(IndexOf(map, map.beta<1>(d)).value);
      answer.add_states(static_cast<uint32_t>(map.info<3>(d).state));
      answer.add_kinds(static_cast<uint32_t>(map.info<3>(d).kind));
    }
    return next == darts.size();
  };
  return host_->QuerySliced(asked.map(), asked.block(), describe, asked.gone);
}

absl::StatusOr<std::shared_ptr<const CellIndex>> BlockAnswers::Index(const std::string& map, uint32_t block,
                                                                     uint64_t expected,
                                                                     const std::function<bool()>& gone) {
  uint64_t version = 0;
  absl::Status status = host_->Query(map, block, [&](Block3& b) {
    version = b.version();
    return CheckVersion(b, expected);
  });
  if (!status.ok()) return status;
  const std::pair<std::string, uint32_t> key(map, block);
  {
    absl::MutexLock lock(&mutex_);
    auto it = indexes_.find(key);
    if (it != indexes_.end() && it->second->version() == version) return it->second;
  }
  CellIndexBuilder builder;
  auto step = [&](Block3& b) { return builder.Step(b, kHexahedraAStep); };
  if (status = host_->QuerySliced(map, block, step, gone); !status.ok()) return status;
  std::shared_ptr<const CellIndex> index = builder.Build();
  absl::MutexLock lock(&mutex_);
  // Those of maps that are here no more go with the next that is made.
  absl::erase_if(indexes_, [this](const auto& entry) { return !host_->Info(entry.first.first).ok(); });
  indexes_[key] = index;
  return index;
}

absl::Status BlockAnswers::Resolve(const Asked& asked, v1::AskBlockResponse& response) {
  const v1::ResolveQuestion& question = asked.request.resolve();
  if (question.roots_size() != question.paths_size() ||
      static_cast<uint64_t>(question.roots_size()) > max_darts_) {
    return absl::InvalidArgumentError(
        absl::StrCat(question.roots_size(), " roots and ", question.paths_size(),
                     " paths of labels, expected as many, and at most ", max_darts_, " (--max-query-darts)"));
  }
  v1::ResolveAnswer& answer = *response.mutable_resolve();
  auto step = [&](Block3& block) -> absl::StatusOr<bool> {
    const uint64_t version = response.version() == 0 ? asked.request.version() : response.version();
    if (absl::Status s = CheckVersion(block, version); !s.ok()) return s;
    response.set_version(block.version());
    for (size_t k = 0; k < kDartsAStep && answer.darts_size() < question.roots_size(); ++k) {
      const int i = answer.darts_size();
      const auto d = block.Find({question.roots(i), question.paths(i)});
      answer.add_darts(d == Block3::Lcc::null_handle ? DartIndex::kNone : IndexOf(block.map(), d).value);
    }
    return answer.darts_size() == question.roots_size();
  };
  return host_->QuerySliced(asked.map(), asked.block(), step, asked.gone);
}

absl::Status BlockAnswers::Find(const Asked& asked, v1::AskBlockResponse& response) {
  absl::StatusOr<std::shared_ptr<const InitialCells>> initial = host_->Initial(asked.map(), asked.block());
  if (!initial.ok()) return initial.status();
  absl::StatusOr<std::shared_ptr<const CellIndex>> index =
      Index(asked.map(), asked.block(), asked.request.version(), asked.gone);
  if (!index.ok()) return index.status();
  response.set_version((*index)->version());
  v1::FindAnswer& answer = *response.mutable_find();
  int next = 0;
  // Cells of a mesh whose boxes meet that of the anchor that is looked at.
  std::vector<const CellIndex::Entry*> candidates;
  Box3 wanted;
  // Of the anchor that is looked at; whether it has many cells to weigh, for which the block is let go.
  std::optional<NearestSearch> nearest;
  bool weighs = false;
  auto add = [&](DartIndex d, double distance, const CellId& id) {
    answer.add_anchors(static_cast<uint32_t>(next));
    answer.add_darts(d.value);
    answer.add_distances(distance);
    answer.add_hi(id.hi());
    answer.add_lo(id.lo());
  };
  auto few = [&]() -> absl::Status {
    if (static_cast<uint64_t>(answer.darts_size()) <= max_darts_) return absl::OkStatus();
    return absl::ResourceExhaustedError(absl::StrCat("more than ", max_darts_, " darts (--max-query-darts)"));
  };
  auto find = [&](Block3& block, const v1::Anchor& anchor) -> absl::Status {
    auto& map = block.map();
    if (anchor.has_cell()) {
      absl::StatusOr<CellId> id = FromWire(anchor.cell());
      if (!id.ok()) return id.status();
      const DartIndex d = FindCell(block, **index, **initial, *id);
      if (d.valid()) add(d, 0, *id);
    } else if (anchor.has_point() || anchor.has_box()) {
      absl::StatusOr<Box3> box = BoxOf(anchor);
      if (!box.ok()) return box.status();
      if ((*initial)->mesh() != nullptr) {
        candidates = (*index)->Meeting(*box);
        wanted = *box;
        return absl::OkStatus();
      }
      for (const CellIndex::Entry* entry : (*index)->Meeting(*box)) add(entry->reference, 0, CellId());
    } else if (anchor.has_nearest_vertex()) {
      if (!IsFinite(anchor.nearest_vertex())) return BadPoint(anchor.nearest_vertex());
      nearest.emplace(**index, **initial, PointOf(anchor.nearest_vertex()));
      return absl::OkStatus();
    } else if (anchor.at_case() == v1::Anchor::kBlock) {
      for (auto it = map.darts().begin(); it != map.darts().end(); ++it) {
        if (static_cast<uint64_t>(answer.darts_size()) > max_darts_) break;
        add(IndexOf(map, it), 0, CellId());
      }
    } else {
      return absl::InvalidArgumentError("an anchor is a cell, a point, a box, a nearest vertex or a block");
    }
    return few();
  };
  // A step of the search for a nearest vertex; false when it has cells to weigh.
  auto search = [&](Block3& block) {
    if (!nearest->Step(block, kHexahedraAStep / kPartsAStep)) return true;
    if (nearest->done()) {
      const NearestVertex& v = nearest->nearest();
      if (v.dart.valid()) add(v.dart, v.distance, v.id);
      nearest.reset();
    } else if (nearest->ChoosesQuickly()) {
      nearest->Choose();
    } else {
      return false;
    }
    return true;
  };
  auto step = [&](Block3& block) -> absl::StatusOr<bool> {
    if (absl::Status s = CheckUnchanged(block, (*index)->version()); !s.ok()) return s;
    CellNames<Block3> names(block.map(), **initial);
    for (size_t k = 0; k < kPartsAStep && next < asked.request.find().anchors_size(); ++k) {
      if (nearest.has_value()) {
        weighs = !search(block);
        if (weighs) return true;
        if (absl::Status s = few(); !s.ok()) return s;
      } else if (candidates.empty()) {
        if (absl::Status s = find(block, asked.request.find().anchors(next)); !s.ok()) return s;
      } else {
        const DartIndex d = candidates.back()->reference;
        candidates.pop_back();
        const auto cell = block.map().attribute<3>(DartAt(block.map(), d));
        if (CellMeets(block, names, cell, wanted)) add(d, 0, CellId());
        if (absl::Status s = few(); !s.ok()) return s;
      }
      if (candidates.empty() && !nearest.has_value()) ++next;
    }
    return next == asked.request.find().anchors_size();
  };
  while (true) {
    if (absl::Status s = host_->QuerySliced(asked.map(), asked.block(), step, asked.gone); !s.ok()) return s;
    if (!weighs) return absl::OkStatus();
    nearest->Choose();
    weighs = false;
  }
}

}  // namespace ndmap::server

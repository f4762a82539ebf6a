// SPDX-License-Identifier: Apache-2.0
#include "client/sdk/navigator.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "client/sdk/column.h"

namespace ndmap {
namespace {

using internal::Column;

absl::Status Malformed(uint32_t block) {
  return absl::InternalError(
      absl::StrCat("the server of block ", block, " sent columns that do not fit together"));
}

absl::Status CheckColumns(const v1::FetchCellsResponse& r, uint32_t block_count) {
  const size_t darts = r.darts().size();
  const absl::Status bad = Malformed(r.block());
  if (darts % 4 != 0 || r.beta1().size() != darts || r.beta2().size() != darts || r.beta3().size() != darts ||
      r.vertices().size() != darts || r.cell_hi_size() != r.cell_darts_size() ||
      r.cell_lo_size() != r.cell_darts_size() || r.cell_states_size() != r.cell_darts_size() ||
      r.critical_size() != r.partner_blocks_size() || r.blocks_size() != r.versions_size() ||
      static_cast<size_t>(r.points_size()) * 4 != r.points_of().size() * 3) {
    return bad;
  }
  uint64_t sum = 0;
  for (uint32_t n : r.cell_darts()) sum += n;
  if (sum * 4 != darts) return bad;
  for (int i = 0; i < r.critical_size(); ++i) {
    if (r.critical(i) >= darts / 4 || r.partner_blocks(i) >= block_count) return bad;
  }
  for (uint32_t b : r.blocks()) {
    if (b >= block_count) return bad;
  }
  return absl::OkStatus();
}

}  // namespace

struct Navigator::BlockView {
  // 0: not met yet.
  uint64_t version = 0;
  internal::PagedTable<Links> links;
  internal::PagedTable<std::array<double, 3>> points;
};

Navigator::Navigator(MapHandle map) : map_(std::move(map)) {
  for (uint32_t b = 0; b < map_.info().block_count(); ++b) blocks_.push_back(std::make_unique<BlockView>());
}
Navigator::~Navigator() = default;

absl::StatusOr<Navigator::Dart> Navigator::DartOf(const v1::DartRef& dart) {
  const Dart result{dart.block(), dart.dart()};
  absl::StatusOr<const Links*> links = LinksOf(result);
  if (!links.ok()) return links.status();
  if (dart.version() != 0) {
    absl::MutexLock lock(&mutex_);
    if (absl::Status s = SetVersion(dart.block(), dart.version()); !s.ok()) return s;
  }
  return result;
}

absl::StatusOr<Navigator::Dart> Navigator::Beta(Dart dart, int i) {
  if (i < 0 || i > 3) return absl::InvalidArgumentError(absl::StrCat("beta ", i, ", expected 0 to 3"));
  absl::StatusOr<const Links*> links = LinksOf(dart);
  if (!links.ok()) return links.status();
  switch (i) {
    case 0:
      return Dart{dart.block, (*links)->beta0};
    case 1:
      return Dart{dart.block, (*links)->beta1.load(std::memory_order_relaxed)};
    case 2:
      return Dart{dart.block, (*links)->beta2};
    default:
      return Dart{(*links)->beta3_block, (*links)->beta3};
  }
}

absl::StatusOr<std::array<double, 3>> Navigator::Point(Dart dart) {
  absl::StatusOr<const Links*> links = LinksOf(dart);
  if (!links.ok()) return links.status();
  return *blocks_[dart.block]->points.Find((*links)->vertex);
}

absl::StatusOr<const Navigator::Cell*> Navigator::CellOf(Dart dart) {
  absl::StatusOr<const Links*> links = LinksOf(dart);
  if (!links.ok()) return links.status();
  return cells_.Find((*links)->cell);
}

void Navigator::Refresh() {
  absl::MutexLock lock(&mutex_);
  for (auto& block : blocks_) block = std::make_unique<BlockView>();
  cells_.Clear();
  counters_ = Counters();
}

Navigator::Counters Navigator::counters() const {
  absl::MutexLock lock(&mutex_);
  return counters_;
}

const Navigator::Links* Navigator::Known(Dart dart) const {
  if (dart.block >= blocks_.size()) return nullptr;
  const Links* links = blocks_[dart.block]->links.Find(dart.index);
  return links != nullptr && links->beta1.load(std::memory_order_acquire) != 0 ? links : nullptr;
}

absl::StatusOr<std::vector<v1::FetchCellsResponse>> Navigator::Ask(const Dart& dart, uint64_t version) const {
  v1::FetchCellsRequest request;
  request.mutable_dart()->set_block(dart.block);
  request.mutable_dart()->set_dart(dart.index);
  request.mutable_dart()->set_version(version);
  return map_.FetchCells(request);
}

absl::StatusOr<const Navigator::Links*> Navigator::Fetch(Dart dart) {
  if (dart.is_free()) return absl::InvalidArgumentError("a free beta is no dart");
  if (dart.block >= blocks_.size()) {
    return absl::NotFoundError(absl::StrCat("map '", map_.name(), "' has no block ", dart.block, ", it has ",
                                            blocks_.size(), " blocks"));
  }
  // Threads that need the same chunk wait here for the first of them.
  absl::MutexLock lock(&mutex_);
  if (const Links* links = Known(dart)) return links;
  absl::StatusOr<std::vector<v1::FetchCellsResponse>> parts = Ask(dart, blocks_[dart.block]->version);
  if (!parts.ok()) return parts.status();
  for (const v1::FetchCellsResponse& part : *parts) {
    if (part.block() != dart.block || (part.continued() && &part == &parts->front())) {
      return Malformed(dart.block);
    }
    if (absl::Status s = Check(part); !s.ok()) return s;
  }
  for (const v1::FetchCellsResponse& part : *parts) {
    if (absl::Status s = Add(part); !s.ok()) return s;
  }
  // Published when everything about them is written: links lead from one part to another.
  for (const v1::FetchCellsResponse& part : *parts) Publish(part);
  ++counters_.fetches;
  if (const Links* links = Known(dart)) return links;
  return Malformed(dart.block);
}

absl::Status Navigator::SetVersion(uint32_t block, uint64_t version) {
  uint64_t& known = blocks_[block]->version;
  if (known == 0) known = version;
  if (known == version) return absl::OkStatus();
  return absl::FailedPreconditionError(absl::StrCat("block ", block, " is at version ", version,
                                                    ", the view is of version ", known,
                                                    ": Refresh() it and ask for its darts again"));
}

absl::Status Navigator::Check(const v1::FetchCellsResponse& r) {
  if (absl::Status s = CheckColumns(r, static_cast<uint32_t>(blocks_.size())); !s.ok()) return s;
  if (absl::Status s = SetVersion(r.block(), r.version()); !s.ok()) return s;
  for (int i = 0; i < r.blocks_size(); ++i) {
    if (absl::Status s = SetVersion(r.blocks(i), r.versions(i)); !s.ok()) return s;
  }
  return absl::OkStatus();
}

absl::Status Navigator::Add(const v1::FetchCellsResponse& r) {
  BlockView& block = *blocks_[r.block()];
  const Column darts(r.darts()), beta1(r.beta1()), beta2(r.beta2()), beta3(r.beta3()), vertices(r.vertices());
  const Column points_of(r.points_of());
  for (size_t i = 0; i < points_of.size(); ++i) {
    const int at = static_cast<int>(3 * i);
    block.points.Make(points_of[i]) = {r.points(at), r.points(at + 1), r.points(at + 2)};
  }
  size_t d = 0;
  for (int c = 0; c < r.cell_darts_size(); ++c) {
    const bool goes_on = c == 0 && r.continued();
    const auto number = static_cast<uint32_t>(goes_on ? counters_.hexahedra - 1 : counters_.hexahedra++);
    Cell& cell = cells_.Make(number);
    cell.id.set_hi(r.cell_hi(c));
    cell.id.set_lo(r.cell_lo(c));
    cell.state = r.cell_states(c);
    cell.darts = r.cell_darts(c) + (goes_on ? cell.darts : 0);
    cell.number = number;
    for (uint32_t k = 0; k < r.cell_darts(c); ++k, ++d) {
      Links& links = block.links.Make(darts[d]);
      links.beta2 = beta2[d];
      links.beta3 = beta3[d];
      links.beta3_block = r.block();
      links.vertex = vertices[d];
      links.cell = number;
      block.links.Make(beta1[d]).beta0 = darts[d];
      if (block.points.Find(vertices[d]) == nullptr) return Malformed(r.block());
    }
  }
  for (int i = 0; i < r.critical_size(); ++i) {
    block.links.Make(darts[r.critical(i)]).beta3_block = r.partner_blocks(i);
  }
  counters_.darts += darts.size();
  counters_.bytes += r.ByteSizeLong();
  return absl::OkStatus();
}

void Navigator::Publish(const v1::FetchCellsResponse& r) {
  BlockView& block = *blocks_[r.block()];
  const Column darts(r.darts()), beta1(r.beta1());
  for (size_t i = 0; i < darts.size(); ++i) {
    block.links.Make(darts[i]).beta1.store(beta1[i], std::memory_order_release);
  }
}

}  // namespace ndmap

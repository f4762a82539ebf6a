// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/navigate/nearest_search.h"

#include <algorithm>

#include "core/algorithm/refine/frame.h"
#include "core/geometry/compare_distance.h"
#include "core/names/cell_names.h"

namespace ndmap {

NearestSearch::NearestSearch(const CellIndex& index, const InitialCells& initial, const Point3& point)
    : index_(index), initial_(initial), point_(point), far_(index.IsFar(point)), done_(index.size() == 0) {}

void NearestSearch::Choose() {
  if (far_) {
    for (const CellIndex::Entry* entry : index_.PerhapsNearest(point_)) chosen_.emplace_back(0, entry);
    return;
  }
  // All that are nearer than the last of before were looked at; of those equally far others may come first
  // now.
  const double looked_at = chosen_.empty() ? 0 : chosen_.back().first;
  chosen_ = index_.Nearest(point_, most_);
  const auto begin =
      std::lower_bound(chosen_.begin(), chosen_.end(), looked_at,
                       [](const auto& cell, double distance) { return cell.first < distance; });
  next_ = static_cast<size_t>(begin - chosen_.begin());
  most_ *= 4;
}

template <class BlockT>
bool NearestSearch::Step(BlockT& block, size_t budget) {
  // Distances of boxes and of vertices are both rounded, and small squares have lost digits.
  constexpr double kRounding = 1e-14, kSmall = 1e-290;
  if (chosen_.empty()) return true;
  CellNames<BlockT> names(block.map(), initial_);
  for (size_t k = 0; k < budget && next_ < chosen_.size(); ++k, ++next_) {
    const auto& [distance, entry] = chosen_[next_];
    if (distance > std::max(nearest_.distance * (1 + kRounding), kSmall)) {
      done_ = true;
      return true;
    }
    Look(block, names, *entry);
  }
  if (next_ < chosen_.size()) return false;
  done_ = far_ || next_ == index_.size();
  return true;
}

template bool NearestSearch::Step(Block2& block, size_t budget);
template bool NearestSearch::Step(Block3& block, size_t budget);

template <class BlockT, class Names>
void NearestSearch::Look(BlockT& block, Names& names, const CellIndex::Entry& entry) {
  auto& map = block.map();
  const size_t darts = names.Look(map.template attribute<BlockT::n>(DartAt(map, entry.reference)));
  for (size_t i = 0; i < darts; ++i) {
    const Point3 p = Frame<BlockT>::StartPoint(map, names.dart(i));
    const int order = nearest_.dart.valid() ? CompareDistance(point_, p, at_) : -1;
    if (order > 0) continue;
    const CellId id = names.Name(i, 0);
    if (order == 0 && !(id < nearest_.id)) continue;
    double squared = 0;
    for (size_t c = 0; c < 3; ++c) squared += (p[c] - point_[c]) * (p[c] - point_[c]);
    nearest_ = {squared, id, IndexOf(map, names.dart(i))};
    at_ = p;
  }
}

}  // namespace ndmap

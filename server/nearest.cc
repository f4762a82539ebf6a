// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/nearest.h"

#include <algorithm>
#include <iterator>
#include <limits>
#include <map>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/geometry/compare_distance.h"

namespace ndmap::server {
namespace {

// Candidates of one anchor that may be the nearest, as far as rounded distances tell.
std::vector<NearestOfBlock> Perhaps(std::vector<NearestOfBlock>::const_iterator begin,
                                    std::vector<NearestOfBlock>::const_iterator end) {
  double least = std::numeric_limits<double>::infinity();
  for (auto it = begin; it != end; ++it) least = std::min(least, it->distance);
  // Below it squares have lost digits.
  constexpr double kSmall = 1e-290;
  const double enough = std::max(least * (1 + 1e-14), kSmall);
  std::vector<NearestOfBlock> result;
  std::copy_if(begin, end, std::back_inserter(result),
               [enough](const NearestOfBlock& n) { return n.distance <= enough; });
  return result;
}

struct Candidate {
  NearestOfBlock vertex;
  Point3 point{};
};

absl::Status AskPoints(RemoteBlocks& blocks, const DartSet& set, std::vector<Candidate*>& wanted) {
  std::map<BlockId, std::vector<Candidate*>> by_block;
  for (Candidate* candidate : wanted) by_block[candidate->vertex.block].push_back(candidate);
  std::vector<v1::AskBlockRequest> requests;
  for (const auto& [block, candidates] : by_block) {
    v1::AskBlockRequest& request = requests.emplace_back();
    request.set_block(block.value);
    request.set_version(set.blocks.at(block).version);
    request.mutable_name()->set_all(true);
    for (const Candidate* candidate : candidates)
      request.mutable_name()->add_darts(candidate->vertex.dart.value);
  }
  absl::StatusOr<std::vector<v1::AskBlockResponse>> answers = blocks.Ask(std::move(requests));
  if (!answers.ok()) return answers.status();
  size_t k = 0;
  for (const auto& [block, candidates] : by_block) {
    const v1::AskBlockResponse& answer = (*answers)[k++];
    if (answer.version() != set.blocks.at(block).version)
      return absl::AbortedError(absl::StrCat("block ", block.value, " changed during the query"));
    if (static_cast<size_t>(answer.name().points_size()) != 3 * candidates.size())
      return absl::InternalError(absl::StrCat("block ", block.value, " did not tell all points"));
    for (size_t i = 0; i < candidates.size(); ++i) {
      for (size_t c = 0; c < 3; ++c)
        candidates[i]->point[c] = answer.name().points(static_cast<int>(3 * i + c));
    }
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status ChooseNearest(RemoteBlocks& blocks, const v1::FindQuestion& anchors,
                           std::vector<NearestOfBlock> found, DartSet& set) {
  std::stable_sort(found.begin(), found.end(),
                   [](const NearestOfBlock& a, const NearestOfBlock& b) { return a.anchor < b.anchor; });
  std::vector<std::vector<Candidate>> by_anchor;
  for (auto it = found.cbegin(); it != found.cend();) {
    const auto end = std::find_if(it, found.cend(), [it](const auto& n) { return n.anchor != it->anchor; });
    by_anchor.emplace_back();
    for (const NearestOfBlock& vertex : Perhaps(it, end)) by_anchor.back().push_back({vertex, {}});
    it = end;
  }
  std::vector<Candidate*> wanted;
  for (std::vector<Candidate>& candidates : by_anchor) {
    // Blocks that share the vertex agree on it.
    const bool one = std::all_of(candidates.begin(), candidates.end(), [&candidates](const Candidate& c) {
      return c.vertex.id == candidates.front().vertex.id;
    });
    if (one) {
      candidates.resize(1);
      continue;
    }
    for (Candidate& candidate : candidates) wanted.push_back(&candidate);
  }
  if (!wanted.empty()) {
    if (absl::Status status = AskPoints(blocks, set, wanted); !status.ok()) return status;
  }
  for (const std::vector<Candidate>& candidates : by_anchor) {
    const v1::Point& asked = anchors.anchors(static_cast<int>(candidates[0].vertex.anchor)).nearest_vertex();
    const Point3 point = {asked.x(), asked.y(), asked.z()};
    const auto nearest = std::min_element(candidates.begin(), candidates.end(),
                                          [&point](const Candidate& a, const Candidate& b) {
                                            const int order = CompareDistance(point, a.point, b.point);
                                            return order < 0 || (order == 0 && a.vertex.id < b.vertex.id);
                                          });
    set.blocks[nearest->vertex.block].darts.push_back(nearest->vertex.dart);
  }
  return absl::OkStatus();
}

}  // namespace ndmap::server

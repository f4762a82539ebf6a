// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/reference/map_image.h"

#include <algorithm>
#include <bit>
#include <utility>

#include "absl/container/flat_hash_map.h"
#include "absl/hash/hash.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

namespace ndmap::reference {
namespace {

constexpr const char* kBeta[3] = {"β1", "β2", "β3"};
// Rounds of neighbourhood hashing: each tells darts apart that differ one step further away.
constexpr int kRounds = 3;

std::string PointText(const std::array<uint64_t, 3>& bits) {
  return absl::StrFormat("(%.17g, %.17g, %.17g)", std::bit_cast<double>(bits[0]),
                         std::bit_cast<double>(bits[1]), std::bit_cast<double>(bits[2]));
}

std::string DartText(const MapImage& m, uint32_t d) {
  return absl::StrCat("dart ", PointText(m.point[m.vertex[d]]), " -> ",
                      PointText(m.point[m.vertex[m.beta[d][0]]]));
}

// A key for each dart from points, names and β within kRounds steps: equal for darts that correspond.
std::vector<uint64_t> Keys(const MapImage& m, bool named) {
  std::vector<uint64_t> keys(m.darts());
  for (uint32_t d = 0; d < m.darts(); ++d) {
    keys[d] = absl::HashOf(m.point[m.vertex[d]], named ? m.name[d] : std::array<uint64_t, 2>{});
  }
  for (int round = 0; round < kRounds; ++round) {
    std::vector<uint64_t> next(m.darts());
    for (uint32_t d = 0; d < m.darts(); ++d) {
      std::array<uint64_t, 4> around = {keys[d]};
      for (int i = 0; i < 3; ++i) around[i + 1] = m.beta[d][i] == MapImage::kFree ? 0 : keys[m.beta[d][i]];
      next[d] = absl::HashOf(around);
    }
    keys = std::move(next);
  }
  return keys;
}

class Matcher {
 public:
  Matcher(const MapImage& a, const MapImage& b)
      : a_(a),
        b_(b),
        named_(!a.name.empty() && !b.name.empty()),
        to_b_(a.darts(), MapImage::kFree),
        to_a_(b.darts(), MapImage::kFree),
        vertex_to_b_(a.point.size(), MapImage::kFree),
        vertex_to_a_(b.point.size(), MapImage::kFree) {}

  // Components are matched one after another. A greedy choice among equal components is safe: isomorphism
  // is an equivalence, so any one of them serves.
  absl::Status Run() {
    const std::vector<uint64_t> keys_a = Keys(a_, named_), keys_b = Keys(b_, named_);
    absl::flat_hash_map<uint64_t, std::vector<uint32_t>> candidates;
    for (uint32_t d = 0; d < b_.darts(); ++d) candidates[keys_b[d]].push_back(d);
    for (uint32_t first = 0; first < a_.darts(); ++first) {
      if (to_b_[first] != MapImage::kFree) continue;
      const uint32_t seed = RarestOfComponent(first, keys_a, candidates);
      if (absl::Status s = MatchComponent(seed, candidates[keys_a[seed]]); !s.ok()) return s;
    }
    return absl::OkStatus();
  }

 private:
  // The dart of the component of `first` with the fewest candidates, at once when it has none.
  uint32_t RarestOfComponent(uint32_t first, const std::vector<uint64_t>& keys,
                             const absl::flat_hash_map<uint64_t, std::vector<uint32_t>>& candidates) {
    if (seen_.empty()) seen_.resize(a_.darts());
    std::vector<uint32_t> stack = {first};
    seen_[first] = true;
    uint32_t best = first;
    size_t fewest = b_.darts() + 1;
    while (!stack.empty()) {
      const uint32_t d = stack.back();
      stack.pop_back();
      const auto found = candidates.find(keys[d]);
      const size_t count = found == candidates.end() ? 0 : found->second.size();
      if (count < fewest) best = d, fewest = count;
      for (const uint32_t e : a_.beta[d]) {
        if (e != MapImage::kFree && !seen_[e]) seen_[e] = true, stack.push_back(e);
      }
    }
    return best;
  }

  absl::Status MatchComponent(uint32_t seed, const std::vector<uint32_t>& candidates) {
    absl::Status last = absl::FailedPreconditionError(
        absl::StrCat("a's ", DartText(a_, seed), " has no counterpart in b", WhyNone(seed)));
    for (const uint32_t candidate : candidates) {
      if (to_a_[candidate] != MapImage::kFree) continue;
      last = TryFrom(seed, candidate);
      if (last.ok()) return last;
    }
    return last;
  }

  // What is the nearest in b to a dart without candidates: a missing point, a missing edge, or its
  // surroundings.
  std::string WhyNone(uint32_t seed) const {
    const auto start = a_.point[a_.vertex[seed]], end = a_.point[a_.vertex[a_.beta[seed][0]]];
    bool has_start = false, has_end = false;
    for (uint32_t d = 0; d < b_.darts(); ++d) {
      if (b_.point[b_.vertex[d]] != start) continue;
      has_start = true;
      has_end = has_end || b_.point[b_.vertex[b_.beta[d][0]]] == end;
    }
    if (!has_start) return ": b has no such start point";
    if (!has_end) return ": b has the start point but no such edge";
    return ": b has such an edge but its neighbours differ";
  }

  // Follows β1, β2, β3 in both maps at once from one pair. On failure undoes what it matched.
  absl::Status TryFrom(uint32_t seed, uint32_t candidate) {
    matched_.clear();
    matched_vertices_.clear();
    absl::Status status = Pair(seed, candidate);
    for (size_t next = 0; status.ok() && next < matched_.size(); ++next) status = PairAround(matched_[next]);
    if (!status.ok()) Undo();
    return status;
  }

  absl::Status PairAround(uint32_t d) {
    for (int i = 0; i < 3; ++i) {
      const uint32_t x = a_.beta[d][i], y = b_.beta[to_b_[d]][i];
      if ((x == MapImage::kFree) != (y == MapImage::kFree)) {
        return Differ(d, absl::StrCat(kBeta[i], " is free only in ", x == MapImage::kFree ? "a" : "b"));
      }
      if (x == MapImage::kFree) continue;
      if (absl::Status s = Pair(x, y); !s.ok()) return s;
    }
    return absl::OkStatus();
  }

  absl::Status Pair(uint32_t d, uint32_t e) {
    if (to_b_[d] == e && to_a_[e] == d) return absl::OkStatus();
    if (to_b_[d] != MapImage::kFree || to_a_[e] != MapImage::kFree) {
      return Differ(d, "the two maps close their orbits differently");
    }
    const uint32_t v = a_.vertex[d], w = b_.vertex[e];
    if (a_.point[v] != b_.point[w]) {
      return Differ(d, absl::StrCat("b has the point ", PointText(b_.point[w]), " at its origin"));
    }
    if (named_ && a_.name[d] != b_.name[e]) return Differ(d, "its volumes have different names");
    if (vertex_to_b_[v] != w || vertex_to_a_[w] != v) {
      if (vertex_to_b_[v] != MapImage::kFree || vertex_to_a_[w] != MapImage::kFree) {
        return Differ(d, "its origin is one vertex in one map and two in the other");
      }
      vertex_to_b_[v] = w;
      vertex_to_a_[w] = v;
      matched_vertices_.push_back(v);
    }
    to_b_[d] = e;
    to_a_[e] = d;
    matched_.push_back(d);
    return absl::OkStatus();
  }

  void Undo() {
    for (const uint32_t d : matched_) {
      to_a_[to_b_[d]] = MapImage::kFree;
      to_b_[d] = MapImage::kFree;
    }
    for (const uint32_t v : matched_vertices_) {
      vertex_to_a_[vertex_to_b_[v]] = MapImage::kFree;
      vertex_to_b_[v] = MapImage::kFree;
    }
  }

  absl::Status Differ(uint32_t d, const std::string& what) const {
    return absl::FailedPreconditionError(absl::StrCat("at a's ", DartText(a_, d), ": ", what));
  }

  const MapImage& a_;
  const MapImage& b_;
  const bool named_;
  std::vector<uint32_t> to_b_, to_a_, vertex_to_b_, vertex_to_a_;
  std::vector<uint32_t> matched_, matched_vertices_;
  std::vector<bool> seen_;
};

}  // namespace

absl::Status CompareImages(const MapImage& a, const MapImage& b) {
  absl::Status status = Matcher(a, b).Run();
  // Every dart of a has its own counterpart, so only b can have more.
  if (status.ok() && a.darts() == b.darts() && a.point.size() == b.point.size()) return status;
  return absl::FailedPreconditionError(
      absl::StrCat(status.ok() ? "all of a is in b, but b has more" : status.message(), "; a has ", a.darts(),
                   " darts and ", a.point.size(), " vertices, b has ", b.darts(), " darts and ",
                   b.point.size(), " vertices"));
}

}  // namespace ndmap::reference

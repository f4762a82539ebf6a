// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/algorithm/block_algorithm.h"

#include <utility>

#include "core/geometry/surface_index.h"

namespace ndmap {

void Report::Find(std::string sentence) {
  ++counts["findings"];
  if (findings.size() < kMaxFindings) findings.push_back(std::move(sentence));
}

void Report::Merge(const Report& other) {
  for (const auto& [name, count] : other.counts) counts[name] += count;
  digest.Add(other.digest);
  for (const std::string& sentence : other.findings) {
    if (findings.size() < kMaxFindings) findings.push_back(sentence);
  }
}

absl::StatusOr<std::shared_ptr<const SurfaceIndex>> Environment::Index(
    absl::FunctionRef<Box3()> region) const {
  if (surface == nullptr) return absl::FailedPreconditionError("the map has no surface");
  if (index_cache != nullptr && index_cache->index != nullptr) return index_cache->index;
  auto index = std::make_shared<const SurfaceIndex>(surface, region());
  if (index_cache != nullptr) index_cache->index = index;
  return index;
}

}  // namespace ndmap

// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/algorithm/block_algorithm.h"

#include <utility>

#include "core/geometry/surface_caches.h"

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

absl::StatusOr<std::shared_ptr<const SurfaceIndex>> Environment::Index(absl::FunctionRef<Box3()> look) const {
  if (surface == nullptr) return absl::FailedPreconditionError("the map has no surface");
  auto region = [&]() -> absl::StatusOr<Box3> { return bounds ? bounds() : look(); };
  if (index_cache != nullptr) return index_cache->Get(surface, region);
  return IndexCache().Get(surface, region);
}

absl::StatusOr<std::shared_ptr<const ParityIndex>> Environment::Parity() const {
  if (surface == nullptr) return absl::FailedPreconditionError("the map has no surface");
  return parity_cache != nullptr ? parity_cache->Get(surface) : ParityCache().Get(surface);
}

}  // namespace ndmap

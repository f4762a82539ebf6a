// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/algorithm/block_algorithm.h"

#include <utility>

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

}  // namespace ndmap

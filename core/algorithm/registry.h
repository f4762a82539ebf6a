// SPDX-License-Identifier: GPL-3.0-or-later
// The one list of distributed algorithms: a new one is a folder in core/algorithm and a line in registry.cc.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/algorithm/block_algorithm.h"
#include "core/algorithm/parameters.h"
#include "core/map/block.h"

namespace ndmap {

struct AlgorithmInfo {
  std::string name;
  // Whether it changes the map: jobs that do exclude each other.
  bool changes_map = false;
  // One line for --help and for errors.
  std::string summary;
};

// All algorithms, by name. The names: build, load, refine, classify, trim, check, hash, count, attributes.
const std::vector<AlgorithmInfo>& Algorithms();

// NOT_FOUND that lists the names there are.
absl::StatusOr<AlgorithmInfo> FindAlgorithm(absl::string_view name);

// An algorithm for one block. INVALID_ARGUMENT names the parameter that is wrong; FAILED_PRECONDITION: it
// makes no sense in a map of this dimension. The block outlives it.
absl::StatusOr<std::unique_ptr<BlockAlgorithm>> MakeAlgorithm(absl::string_view name,
                                                              const Parameters& parameters,
                                                              const Environment& environment, Block2& block);
absl::StatusOr<std::unique_ptr<BlockAlgorithm>> MakeAlgorithm(absl::string_view name,
                                                              const Parameters& parameters,
                                                              const Environment& environment,
                                                              Block2OnCgalStorage& block);
absl::StatusOr<std::unique_ptr<BlockAlgorithm>> MakeAlgorithm(absl::string_view name,
                                                              const Parameters& parameters,
                                                              const Environment& environment, Block3& block);
absl::StatusOr<std::unique_ptr<BlockAlgorithm>> MakeAlgorithm(absl::string_view name,
                                                              const Parameters& parameters,
                                                              const Environment& environment,
                                                              Block3OnCgalStorage& block);

}  // namespace ndmap

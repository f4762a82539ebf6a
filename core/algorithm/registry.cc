// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/algorithm/registry.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "core/algorithm/attributes/attributes.h"
#include "core/algorithm/build/build.h"
#include "core/algorithm/check/check.h"
#include "core/algorithm/classify/classify.h"
#include "core/algorithm/count/count.h"
#include "core/algorithm/hash/hash.h"
#include "core/algorithm/load/load.h"
#include "core/algorithm/refine/refine.h"
#include "core/algorithm/trim/trim.h"

namespace ndmap {
namespace {

template <class BlockT>
using Maker = absl::StatusOr<std::unique_ptr<BlockAlgorithm>> (*)(const Parameters&, const Environment&,
                                                                  BlockT&);

struct Entry {
  AlgorithmInfo info;
  Maker<Block3> flat;
  Maker<Block3OnCgalStorage> cgal;
};

template <template <class> class Algorithm>
Entry MakeEntry(const char* name, bool changes_map, const char* summary) {
  return {{name, changes_map, summary}, &Algorithm<Block3>::Make, &Algorithm<Block3OnCgalStorage>::Make};
}

const std::vector<Entry>& Entries() {
  static const auto& entries = *new std::vector<Entry>{
      MakeEntry<Build>("build", true, "make the initial grid of hexahedra"),
      MakeEntry<Load>("load", true, "make the cells of a mesh"),
      MakeEntry<Refine>("refine", true, "split hexahedra in eight where an oracle says so"),
      MakeEntry<Classify>("classify", true, "tell which hexahedra are cut, inside or outside"),
      MakeEntry<Trim>("trim", true, "erase the hexahedra that are not wanted"),
      MakeEntry<Check>("check", false, "check every property of the distributed map, block against block"),
      MakeEntry<Hash>("hash", false, "the canonical hash of the global map"),
      MakeEntry<Count>("count", false, "count cells by level and state"),
      MakeEntry<Attributes>("attributes", false, "give new cells the values of those they were made of"),
  };
  return entries;
}

absl::StatusOr<const Entry*> FindEntry(absl::string_view name) {
  std::string names;
  for (const Entry& entry : Entries()) {
    if (entry.info.name == name) return &entry;
    absl::StrAppend(&names, names.empty() ? "" : ", ", entry.info.name);
  }
  return absl::NotFoundError(absl::StrCat("no algorithm '", name, "', there are ", names));
}

}  // namespace

const std::vector<AlgorithmInfo>& Algorithms() {
  static const auto& infos = *[] {
    auto* list = new std::vector<AlgorithmInfo>;
    for (const Entry& entry : Entries()) list->push_back(entry.info);
    return list;
  }();
  return infos;
}

absl::StatusOr<AlgorithmInfo> FindAlgorithm(absl::string_view name) {
  absl::StatusOr<const Entry*> entry = FindEntry(name);
  if (!entry.ok()) return entry.status();
  return (*entry)->info;
}

absl::StatusOr<std::unique_ptr<BlockAlgorithm>> MakeAlgorithm(absl::string_view name,
                                                              const Parameters& parameters,
                                                              const Environment& environment, Block3& block) {
  absl::StatusOr<const Entry*> entry = FindEntry(name);
  if (!entry.ok()) return entry.status();
  return (*entry)->flat(parameters, environment, block);
}

absl::StatusOr<std::unique_ptr<BlockAlgorithm>> MakeAlgorithm(absl::string_view name,
                                                              const Parameters& parameters,
                                                              const Environment& environment,
                                                              Block3OnCgalStorage& block) {
  absl::StatusOr<const Entry*> entry = FindEntry(name);
  if (!entry.ok()) return entry.status();
  return (*entry)->cgal(parameters, environment, block);
}

}  // namespace ndmap

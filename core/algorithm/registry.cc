// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/algorithm/registry.h"

#include <tuple>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/algorithm/attributes/attributes.h"
#include "core/algorithm/build/build.h"
#include "core/algorithm/check/check.h"
#include "core/algorithm/classify/classify.h"
#include "core/algorithm/count/count.h"
#include "core/algorithm/hash/hash.h"
#include "core/algorithm/load/load.h"
#include "core/algorithm/load/load_polygons.h"
#include "core/algorithm/refine/refine.h"
#include "core/algorithm/trim/trim.h"

namespace ndmap {
namespace {

template <class BlockT>
using Maker = absl::StatusOr<std::unique_ptr<BlockAlgorithm>> (*)(const Parameters&, const Environment&,
                                                                  BlockT&);

// Null: it makes no sense in that dimension.
struct Entry {
  AlgorithmInfo info;
  std::tuple<Maker<Block2>, Maker<Block2OnCgalStorage>, Maker<Block3>, Maker<Block3OnCgalStorage>> makers;
};

// Of maps of dimension 3 alone.
template <template <class> class Algorithm>
Entry OfVolumes(const char* name, bool changes_map, const char* summary) {
  return {{name, changes_map, summary},
          {nullptr, nullptr, &Algorithm<Block3>::Make, &Algorithm<Block3OnCgalStorage>::Make}};
}

// One class for maps of dimension 2, one, mostly the same, for those of dimension 3.
template <template <class> class OfSurfaces, template <class> class OfVolumes = OfSurfaces>
Entry OfBoth(const char* name, bool changes_map, const char* summary) {
  return {{name, changes_map, summary},
          {&OfSurfaces<Block2>::Make, &OfSurfaces<Block2OnCgalStorage>::Make, &OfVolumes<Block3>::Make,
           &OfVolumes<Block3OnCgalStorage>::Make}};
}

const std::vector<Entry>& Entries() {
  static const auto& entries = *new std::vector<Entry>{
      OfVolumes<Build>("build", true, "make the initial grid of hexahedra"),
      OfBoth<LoadPolygons, Load>("load", true, "make the cells of a mesh"),
      OfVolumes<Refine>("refine", true, "split hexahedra in eight where an oracle says so"),
      OfVolumes<Classify>("classify", true, "tell which hexahedra are cut, inside or outside"),
      OfBoth<Trim>("trim", true, "erase the hexahedra that are not wanted"),
      OfBoth<Check>("check", false, "check every property of the distributed map, block against block"),
      OfBoth<Hash>("hash", false, "the canonical hash of the global map"),
      OfBoth<Count>("count", false, "count cells by level and state"),
      OfBoth<Attributes>("attributes", false, "give new cells the values of those they were made of"),
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

template <class BlockT>
absl::StatusOr<std::unique_ptr<BlockAlgorithm>> MakeFor(absl::string_view name, const Parameters& parameters,
                                                        const Environment& environment, BlockT& block) {
  absl::StatusOr<const Entry*> entry = FindEntry(name);
  if (!entry.ok()) return entry.status();
  const Maker<BlockT> make = std::get<Maker<BlockT>>((*entry)->makers);
  if (make == nullptr) {
    return absl::FailedPreconditionError(
        absl::StrCat(name, " works on maps of dimension 3, and this one has dimension ", int{BlockT::n}));
  }
  return make(parameters, environment, block);
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
                                                              const Environment& environment, Block2& block) {
  return MakeFor(name, parameters, environment, block);
}

absl::StatusOr<std::unique_ptr<BlockAlgorithm>> MakeAlgorithm(absl::string_view name,
                                                              const Parameters& parameters,
                                                              const Environment& environment,
                                                              Block2OnCgalStorage& block) {
  return MakeFor(name, parameters, environment, block);
}

absl::StatusOr<std::unique_ptr<BlockAlgorithm>> MakeAlgorithm(absl::string_view name,
                                                              const Parameters& parameters,
                                                              const Environment& environment, Block3& block) {
  return MakeFor(name, parameters, environment, block);
}

absl::StatusOr<std::unique_ptr<BlockAlgorithm>> MakeAlgorithm(absl::string_view name,
                                                              const Parameters& parameters,
                                                              const Environment& environment,
                                                              Block3OnCgalStorage& block) {
  return MakeFor(name, parameters, environment, block);
}

}  // namespace ndmap

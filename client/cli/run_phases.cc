// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/run_phases.h"

#include "client/cli/grid_options.h"

namespace ndmap::cli {
namespace {

// What must stay while there are hexahedra to refine: those on the surface. The sides alike, but where one is
// not wanted in the end.
std::string KeptMeanwhile(const std::string& keep) { return keep == "cut" ? "cut" : "inside,cut"; }

void AddErasing(std::vector<v1::Phase>& phases, const std::string& keep) {
  phases.push_back(MakePhase("classify"));
  phases.push_back(MakePhase("trim", {{"keep", keep}}));
}

// The child numbers of a part: every parts-th.
std::string ChildrenOf(uint32_t part, uint32_t parts) {
  std::string children;
  for (uint32_t child = part; child < 8; child += parts) children += static_cast<char>('0' + child);
  return children;
}

}  // namespace

bool ErasesEarly(bool async, int depth, const std::string& keep) {
  return !async && depth >= 2 && keep != "all";
}

uint32_t PartsFor(double hexahedra) {
  // About 100 MiB: below it nobody misses a quarter.
  constexpr double kWorthParts = 150'000;
  return hexahedra < kWorthParts ? 0 : kMostParts;
}

std::vector<v1::Phase> ErasingPhases(int depth, const std::string& keep, uint32_t parts,
                                     const PhaseParameters& parameters) {
  const v1::Phase level = RefinePhases(depth, false, parameters).back();
  std::vector<v1::Phase> phases;
  AddErasing(phases, KeptMeanwhile(keep));
  for (uint32_t part = 0; part < parts; ++part) {
    phases.push_back(level);
    if (parts > 1) (*phases.back().mutable_parameters())["children"] = ChildrenOf(part, parts);
    AddErasing(phases, part + 1 == parts ? keep : KeptMeanwhile(keep));
  }
  return phases;
}

}  // namespace ndmap::cli

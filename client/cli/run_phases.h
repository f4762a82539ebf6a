// SPDX-License-Identifier: GPL-3.0-or-later
// In which order `ndmap run` refines, classifies and erases.
//
// The surface's hexahedra alone are refined, so what is inside or outside stays as it is: what is not to be
// kept can be erased before the next hexahedra are made, and the final map is the same (docs/cli.md, run).
// The last level makes three quarters of all hexahedra, about a quarter of them to be erased: it is refined
// in parts, by child number, each followed by erasing.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "ndmap/v1/block_service.pb.h"

namespace ndmap::cli {

using PhaseParameters = std::vector<std::pair<std::string, std::string>>;

inline constexpr uint32_t kMostParts = 8;

// Whether there is anything to erase before the end: not with one phase for all levels, not where all is
// kept.
bool ErasesEarly(bool async, int depth, const std::string& keep);

// In how many parts to refine a last level of so many hexahedra; 0: it is too small to erase anything before
// its end. Each part costs a look at every hexahedron.
uint32_t PartsFor(double hexahedra);

// What follows when all levels but the last are refined: erasing, and the last level in 1 ... kMostParts
// parts, each with erasing; what is only kept meanwhile goes at the end. depth >= 1.
std::vector<v1::Phase> ErasingPhases(int depth, const std::string& keep, uint32_t parts,
                                     const PhaseParameters& parameters);

}  // namespace ndmap::cli

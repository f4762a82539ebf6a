// SPDX-License-Identifier: GPL-3.0-or-later
// Blocks' reports added up.
#pragma once

#include <vector>

#include "ndmap/v1/block_service.pb.h"
#include "ndmap/v1/coordinator.pb.h"

namespace ndmap::coordinator {

// Adds one block's report to the map's: counts are summed, digests added modulo 2^128, findings appended.
void MergeReport(const v1::Report& from, v1::Report& into);

// Fills in the reports, the sums and the CPU seconds between the processes' figures before and after.
void Summarise(const std::vector<v1::StartPhaseResponse>& before, std::vector<v1::FinishPhaseResponse> after,
               v1::PhaseResult& result);

}  // namespace ndmap::coordinator

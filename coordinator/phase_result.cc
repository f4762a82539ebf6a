// SPDX-License-Identifier: GPL-3.0-or-later
#include "coordinator/phase_result.h"

#include <algorithm>
#include <utility>

namespace ndmap::coordinator {
namespace {

constexpr int kMaxFindings = 20;

}  // namespace

void MergeReport(const v1::Report& from, v1::Report& into) {
  for (const auto& [name, count] : from.counts()) (*into.mutable_counts())[name] += count;
  const uint64_t lo = into.digest_lo() + from.digest_lo();
  into.set_digest_hi(into.digest_hi() + from.digest_hi() + (lo < from.digest_lo() ? 1 : 0));
  into.set_digest_lo(lo);
  for (const std::string& finding : from.findings()) {
    if (into.findings_size() < kMaxFindings) into.add_findings(finding);
  }
}

void Summarise(const std::vector<v1::StartPhaseResponse>& before, std::vector<v1::FinishPhaseResponse> after,
               v1::PhaseResult& result) {
  std::vector<v1::BlockReport> blocks;
  for (size_t i = 0; i < after.size(); ++i) {
    const v1::ProcessStats &first = before[i].process(), &last = after[i].process();
    result.set_user_seconds(result.user_seconds() + last.user_seconds() - first.user_seconds());
    result.set_system_seconds(result.system_seconds() + last.system_seconds() - first.system_seconds());
    for (v1::BlockReport& block : *after[i].mutable_blocks()) blocks.push_back(std::move(block));
  }
  std::sort(blocks.begin(), blocks.end(),
            [](const auto& a, const auto& b) { return a.progress().block() < b.progress().block(); });
  for (v1::BlockReport& block : blocks) {
    MergeReport(block.report(), *result.mutable_report());
    result.set_messages(result.messages() + block.progress().messages_sent());
    result.set_message_bytes(result.message_bytes() + block.progress().bytes_sent());
    *result.add_blocks() = std::move(block);
  }
}

}  // namespace ndmap::coordinator

// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/job_display.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "client/cli/text.h"

namespace ndmap::cli {
namespace {

int64_t Sum(const v1::JobProgress& progress, const std::string& name) {
  int64_t sum = 0;
  for (const v1::BlockProgress& block : progress.blocks()) {
    const auto found = block.counts().find(name);
    if (found != block.counts().end()) sum += found->second;
  }
  return sum;
}

}  // namespace

int64_t CountOf(const v1::Report& report, const std::string& name) {
  const auto found = report.counts().find(name);
  return found == report.counts().end() ? 0 : found->second;
}

std::string PhaseName(const v1::Phase& phase) {
  const auto level = phase.parameters().find("level");
  if (level == phase.parameters().end()) return phase.algorithm();
  const auto children = phase.parameters().find("children");
  std::string name = absl::StrCat(phase.algorithm(), " level ", level->second);
  if (children != phase.parameters().end()) absl::StrAppend(&name, "/", children->second);
  return name;
}

std::string PhaseOutcome(const v1::PhaseResult& result) {
  const auto count = [&](const char* name) { return FormatCount(CountOf(result.report(), name)); };
  const std::string& algorithm = result.phase().algorithm();
  std::string text;
  // Parts of these say nothing: a check is valid or cancelled, never both.
  if (result.cancelled() && (algorithm == "count" || algorithm == "check" || algorithm == "hash")) {
    return "cancelled";
  }
  if (algorithm == "build") text = absl::StrCat(count("hexahedra"), " hexahedra");
  if (algorithm == "refine") text = absl::StrCat(count("refined"), " refined of ", count("cells_tested"));
  if (algorithm == "classify") {
    text = absl::StrCat(count("cut"), " cut, ", count("inside"), " inside, ", count("outside"), " outside");
  }
  if (algorithm == "trim") text = absl::StrCat(count("removed"), " removed, ", count("hexahedra"), " left");
  if (algorithm == "count") text = absl::StrCat(count("darts"), " darts, ", count("vertices"), " vertices");
  if (algorithm == "check") {
    text = CountOf(result.report(), "findings") == 0 ? "valid" : absl::StrCat(count("findings"), " faults");
  }
  if (result.messages() > 0) {
    absl::StrAppend(&text, text.empty() ? "" : ", ", FormatCount(static_cast<int64_t>(result.messages())),
                    " messages");
  }
  if (CountOf(result.report(), "stopped_by_memory") > 0) absl::StrAppend(&text, ", memory limit reached");
  if (result.cancelled()) absl::StrAppend(&text, ", cancelled");
  return text;
}

void JobDisplay::EndPhases(const v1::Job& job) {
  if (names_.empty()) {
    for (const v1::Phase& phase : job.phases()) names_.push_back(PhaseName(phase));
  }
  for (; shown_ < static_cast<uint32_t>(job.results_size()); ++shown_) {
    const v1::PhaseResult& result = job.results(static_cast<int>(shown_));
    if (!phase_open_) progress_.Begin(PhaseName(result.phase()));
    progress_.End(PhaseOutcome(result), result.wall_seconds());
    phase_open_ = false;
    // The children of what was refined are the next level's cells; parts of a level are equal.
    if (result.phase().algorithm() == "refine" && !result.phase().parameters().contains("children")) {
      cells_ = cells_ == 0 ? 0 : static_cast<uint64_t>(CountOf(result.report(), "refined")) * 8;
    }
  }
}

void JobDisplay::Show(const v1::JobProgress& now, const JobHandle& job) {
  if (names_.empty() || now.phase_index() > shown_) {
    absl::StatusOr<v1::Job> state = job.Get();
    if (!state.ok()) return;
    EndPhases(*state);
  }
  if (HasEnded(now.state()) || now.phase_index() != shown_ || shown_ >= names_.size()) return;
  if (!phase_open_) {
    progress_.Begin(names_[shown_]);
    phase_open_ = true;
  }
  const int64_t tested = Sum(now, "cells_tested");
  const bool by_level = now.algorithm() == "refine" && names_[shown_] != "refine";
  const double fraction =
      by_level && cells_ > 0 ? static_cast<double>(tested) / static_cast<double>(cells_) : -1;
  const auto busy = std::count_if(now.blocks().begin(), now.blocks().end(),
                                  [](const v1::BlockProgress& block) { return !block.idle(); });
  std::string detail = absl::StrCat(busy, "/", now.blocks_size(), " blocks busy");
  if (now.algorithm() == "refine") {
    detail = absl::StrCat(FormatCount(Sum(now, "refined")), " refined, ", detail);
  }
  progress_.Update(fraction, detail);
}

absl::StatusOr<v1::Job> JobDisplay::Wait(const JobHandle& handle) {
  absl::StatusOr<v1::Job> job = handle.Wait([&](const v1::JobProgress& progress) { Show(progress, handle); });
  if (job.ok()) EndPhases(*job);
  progress_.Abandon();
  return job;
}

absl::StatusOr<v1::Job> WatchJob(Context& context, const JobHandle& handle, bool cancel_on_interrupt) {
  if (cancel_on_interrupt) {
    context.interrupts.SetHandlers(
        [&context, handle] {
          context.progress.Note(
              absl::StrCat("interrupted: cancelling job ", handle.id(), " (again: leave it alone)"));
          const absl::Status status = handle.Cancel();
          if (!status.ok()) context.progress.Note(status.message());
          return !status.ok();
        },
        [] {});
  }
  JobDisplay display(context.progress, 0);
  absl::StatusOr<v1::Job> job = display.Wait(handle);
  if (cancel_on_interrupt) context.interrupts.ClearHandlers();
  if (!job.ok()) return job;
  if (job->state() == v1::JOB_STATE_CANCELLED) {
    return absl::CancelledError(
        absl::StrCat("job ", handle.id(), " was cancelled; ",
                     job->kind() == "create" ? "the map was not made: delete it" : "the map is valid"));
  }
  absl::Status status = StatusOf(*job);
  if (!status.ok()) return status;
  return job;
}

absl::StatusOr<v1::Job> RunJob(Context& context, const MapHandle& map, const std::string& kind,
                               const std::vector<v1::Phase>& phases) {
  absl::StatusOr<JobHandle> handle = map.StartJob(kind, phases);
  if (!handle.ok()) return handle.status();
  return WatchJob(context, *handle, true);
}

}  // namespace ndmap::cli

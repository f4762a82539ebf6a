// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/client_query.h"

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "service/status.h"

namespace ndmap::server {
namespace {

constexpr absl::Duration kGrace = absl::Seconds(1);

absl::Duration TimeOf(const QueryLimits& limits, ClientQuery::Kind kind) {
  return kind == ClientQuery::Kind::kQuestion ? limits.max_query_time : limits.max_export_time;
}

// One more, if that is not too many.
bool Admit(std::atomic<uint32_t>& running, uint32_t most) {
  uint32_t now = running.load();
  while (now < most) {
    if (running.compare_exchange_weak(now, now + 1)) return true;
  }
  return false;
}

}  // namespace

ClientQuery::ClientQuery(QueryGate& gate, grpc::ServerContext* context, Kind kind)
    : gate_(gate),
      context_(context),
      kind_(kind),
      end_(absl::Now() + TimeOf(gate.limits_, kind)),
      admitted_(Admit(gate.running_, gate.limits_.max_queries)) {}

ClientQuery::~ClientQuery() {
  if (alarm_ != nullptr) {
    alarm_->Cancel();
    alarm_over_.WaitForNotification();
  }
  if (admitted_) --gate_.running_;
}

void ClientQuery::SetAlarm() {
  alarm_ = std::make_unique<grpc::Alarm>();
  alarm_->Set(absl::ToChronoTime(end_ + kGrace), [this](bool expired) {
    if (expired) context_->TryCancel();
    alarm_over_.Notify();
  });
}

bool ClientQuery::Fits(uint64_t bytes) {
  bytes_ += bytes;
  large_ = kind_ == Kind::kQuestion && bytes_ > gate_.limits_.max_response_bytes;
  return !large_;
}

absl::Status ClientQuery::Explain(const absl::Status& status) const {
  if (large_) {
    return absl::ResourceExhaustedError(absl::StrCat("the answer is over ", gate_.limits_.max_response_bytes,
                                                     " bytes (--max-response-bytes): ask for less"));
  }
  if (late_ && !status.ok()) {
    const char* const what = kind_ == Kind::kQuestion ? "the question"
                             : kind_ == Kind::kExport ? "the export"
                                                      : "reading or writing values";
    return absl::ResourceExhaustedError(absl::StrCat(
        what, " took longer than ", absl::FormatDuration(TimeOf(gate_.limits_, kind_)),
        kind_ == Kind::kQuestion ? " (--max-query-seconds): ask for less" : " (--max-export-seconds)"));
  }
  return status;
}

grpc::Status ClientQuery::Run(absl::FunctionRef<absl::Status(const Gone& gone)> answer) {
  if (!admitted_) {
    return service::ToGrpc(absl::ResourceExhaustedError(
        absl::StrCat("the server is answering ", gate_.limits_.max_queries,
                     " questions, the most at one time (--max-queries): ask again later")));
  }
  return service::ToGrpc(Explain(answer([this] {
    late_ = late_ || absl::Now() > end_;
    return late_ || context_->IsCancelled();
  })));
}

grpc::Status ClientQuery::Run(google::protobuf::Message& response,
                              absl::FunctionRef<absl::Status(const Gone& gone)> answer) {
  return Run([&](const Gone& gone) {
    absl::Status status = answer(gone);
    if (status.ok() && !Fits(response.ByteSizeLong())) response.Clear();
    return status;
  });
}

}  // namespace ndmap::server

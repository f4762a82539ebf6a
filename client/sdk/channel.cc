// SPDX-License-Identifier: Apache-2.0
#include "client/sdk/channel.h"

#include <grpcpp/create_channel.h>
#include <grpcpp/security/credentials.h>
#include <grpcpp/support/channel_arguments.h>

#include <algorithm>
#include <cstdint>

#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"

namespace ndmap::internal {
namespace {

constexpr absl::Duration kLongestPause = absl::Seconds(1);

}  // namespace

absl::Status CheckTarget(absl::string_view target) {
  const size_t colon = target.rfind(':');
  const absl::string_view host = target.substr(0, colon);
  uint32_t port = 0;
  const bool bracketed = absl::StrContains(host, '[') && !host.empty() && host.back() == ']';
  if (colon == absl::string_view::npos || host.empty() || (absl::StrContains(host, ':') && !bracketed) ||
      !absl::SimpleAtoi(target.substr(colon + 1), &port) || port < 1 || port > 65535) {
    return absl::InvalidArgumentError(
        absl::StrCat("'", target, "' is not HOST:PORT, for example 127.0.0.1:7000"));
  }
  return absl::OkStatus();
}

std::shared_ptr<grpc::Channel> MakeChannel(const std::string& target) {
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(kMaxMessageBytes);
  arguments.SetMaxSendMessageSize(kMaxMessageBytes);
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  // Equal to the services': a peer that is cut off is noticed while a long stream is silent.
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, 10000);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 5000);
  arguments.SetInt(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 100);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 2000);
  return grpc::CreateCustomChannel(target, grpc::InsecureChannelCredentials(), arguments);
}

void SetDeadline(grpc::ClientContext& context, absl::Duration timeout) {
  context.set_deadline(absl::ToChronoTime(absl::Now() + timeout));
}

namespace {

// gRPC's sentence about a failed connection is long; its end is what matters: "...: Connection refused". What
// the one who was asked says of another, whom it could not reach, begins otherwise and stays.
std::string Unreachable(absl::string_view message, absl::string_view who) {
  if (!absl::StartsWith(message, "failed to connect") && !absl::StartsWith(message, "DNS resolution")) {
    return absl::StrCat(who, ": ", message);
  }
  const size_t last = message.rfind(": ");
  return absl::StrCat(
      who, " cannot be reached: ", last == absl::string_view::npos ? message : message.substr(last + 2));
}

}  // namespace

absl::Status FromGrpc(const grpc::Status& status, absl::string_view who) {
  if (status.ok()) return absl::OkStatus();
  const auto code = static_cast<absl::StatusCode>(status.error_code());
  switch (status.error_code()) {
    case grpc::StatusCode::UNAVAILABLE:
      return absl::Status(code, Unreachable(status.error_message(), who));
    case grpc::StatusCode::DEADLINE_EXCEEDED:
      // gRPC's own words; others are of somebody whom the one who was asked waited for.
      if (!status.error_message().empty() && status.error_message() != "Deadline Exceeded")
        return absl::Status(code, absl::StrCat(who, ": ", status.error_message()));
      return absl::Status(code, absl::StrCat(who, " did not answer in time"));
    case grpc::StatusCode::UNIMPLEMENTED:
      return absl::Status(code, absl::StrCat(who, ": ",
                                             status.error_message().empty() ? "it does not know this call"
                                                                            : status.error_message()));
    default:
      return absl::Status(code, status.error_message());
  }
}

absl::Status Retry(const ClientOptions& options, const std::function<absl::Status()>& call) {
  absl::Duration pause = options.first_pause;
  for (int attempt = 1;; ++attempt) {
    absl::Status status = call();
    if (!absl::IsUnavailable(status) || attempt >= options.attempts) return status;
    absl::SleepFor(pause);
    pause *= 2;
  }
}

Retries::Retries(const ClientOptions& options)
    : options_(options), end_(absl::Now() + options.call_timeout), pause_(options.first_pause) {}

bool Retries::Again(const absl::Status& failure) {
  if (absl::IsUnavailable(failure)) {
    if (++unavailable_ >= options_.attempts) return false;
  } else if (!absl::IsAborted(failure) || absl::Now() + pause_ > end_) {
    return false;
  }
  absl::SleepFor(pause_);
  pause_ = std::min(2 * pause_, std::max(kLongestPause, options_.first_pause));
  return true;
}

}  // namespace ndmap::internal

// SPDX-License-Identifier: Apache-2.0
// The one place that makes channels, contexts and statuses of gRPC calls.
#pragma once

#include <grpcpp/channel.h>
#include <grpcpp/client_context.h>
#include <grpcpp/support/status.h>

#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "client/sdk/options.h"

namespace ndmap::internal {

// A message of the protocol is at most this long.
inline constexpr int kMaxMessageBytes = 16 << 20;

// INVALID_ARGUMENT unless `target` is HOST:PORT with a port of 1 ... 65535 ("[::1]:7000" for IPv6 numbers).
absl::Status CheckTarget(absl::string_view target);

// A channel that connects when it is first used. It never goes through a proxy.
std::shared_ptr<grpc::Channel> MakeChannel(const std::string& target);

// Gives a call its deadline.
void SetDeadline(grpc::ClientContext& context, absl::Duration timeout);

// The same code and sentence; `who` ("the coordinator at 127.0.0.1:7000") begins the sentences that gRPC
// itself makes when a server is not there or does not answer in time.
absl::Status FromGrpc(const grpc::Status& status, absl::string_view who);

// Calls `call` until it does not return UNAVAILABLE, options.attempts times at most. Only for what may be
// done twice.
absl::Status Retry(const ClientOptions& options, const std::function<absl::Status()>& call);

// Whether to try once more what may be done twice, and the pause before. Like Retry, and also after ABORTED
// ("try again in a moment": the map's attributes are being brought up to date), for options.call_timeout in
// all.
class Retries {
 public:
  explicit Retries(const ClientOptions& options);
  // After a failure: false if it is final, otherwise true after the pause.
  bool Again(const absl::Status& failure);

 private:
  const ClientOptions& options_;
  const absl::Time end_;
  absl::Duration pause_;
  int unavailable_ = 0;
};

// A unary call with a deadline. `method` is a member of a generated stub.
template <class Stub, class Request, class Response>
absl::Status CallOnce(Stub& stub,
                      grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                      const Request& request, Response* response, absl::Duration timeout,
                      absl::string_view who) {
  grpc::ClientContext context;
  SetDeadline(context, timeout);
  return FromGrpc((stub.*method)(&context, request, response), who);
}

// The same, tried again when the server does not answer: for idempotent calls.
template <class Stub, class Request, class Response>
absl::Status CallIdempotent(Stub& stub,
                            grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                            const Request& request, Response* response, const ClientOptions& options,
                            absl::string_view who) {
  return Retry(options, [&] {
    response->Clear();
    return CallOnce(stub, method, request, response, options.call_timeout, who);
  });
}

}  // namespace ndmap::internal

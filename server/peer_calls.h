// SPDX-License-Identifier: GPL-3.0-or-later
// The same question to all other servers of a map at once.
#pragma once

#include <grpcpp/client_context.h>
#include <grpcpp/server_context.h>

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/blocking_counter.h"
#include "absl/time/time.h"
#include "ndmap/v1/block_service.grpc.pb.h"
#include "server/block_host.h"
#include "server/peer_stubs.h"
#include "service/status.h"

namespace ndmap::server {

// Who asked: what is done on behalf of a client ends when it goes, or when its deadline is over.
class Caller {
 public:
  // Another server.
  explicit Caller(const grpc::ServerContext* context)
      : Caller(
            context, [context] { return context->IsCancelled(); }, absl::InfiniteFuture()) {}
  // A client that has until `end`.
  Caller(const grpc::ServerContext* context, std::function<bool()> gone, absl::Time end)
      : context_(context), gone_(std::move(gone)), end_(end) {}

  bool gone() const { return gone_(); }
  const std::function<bool()>& Gone() const { return gone_; }
  // For a call that is made for it.
  std::unique_ptr<grpc::ClientContext> Onward() const {
    auto context = grpc::ClientContext::FromServerContext(*context_);
    if (end_ != absl::InfiniteFuture()) context->set_deadline(absl::ToChronoTime(end_));
    return context;
  }

 private:
  const grpc::ServerContext* const context_;
  const std::function<bool()> gone_;
  const absl::Time end_;
};

// Each once.
std::vector<std::string> OtherServers(const BlockHost::MapInfo& info, const std::string& self);
// What was answered; of a server that was not reached, or in time, a sentence that begins with `who` ("the
// block server at HOST:PORT"): the client is to learn which one, and knows only the one that it asked.
absl::Status FromServer(const grpc::Status& status, absl::string_view who);
// The same of a server that was asked about a map of which it had blocks: UNAVAILABLE when it has them no
// more.
absl::Status FromPeer(const grpc::Status& status, const std::string& address);

template <class Request, class Response>
class PeerCalls {
 public:
  using Method = void (v1::BlockService::StubInterface::async_interface::*)(
      grpc::ClientContext*, const Request*, Response*, std::function<void(grpc::Status)>);
  using MakeContext = std::function<std::unique_ptr<grpc::ClientContext>()>;

  // Begins to ask. The request outlives the calls.
  PeerCalls(PeerStubs& peers, std::vector<std::string> addresses, const Request& request, Method method,
            const MakeContext& context)
      : addresses_(std::move(addresses)),
        calls_(addresses_.size()),
        left_(static_cast<int>(addresses_.size())) {
    for (size_t k = 0; k < calls_.size(); ++k) {
      Call& call = calls_[k];
      call.context = context();
      call.stub = peers.To(addresses_[k]);
      (call.stub->async()->*method)(call.context.get(), &request, &call.response,
                                    [this, &call](grpc::Status status) {
                                      call.status = std::move(status);
                                      left_.DecrementCount();
                                    });
    }
  }
  ~PeerCalls() {
    if (!waited_) {
      Cancel();
      left_.Wait();
    }
  }
  PeerCalls(const PeerCalls&) = delete;
  PeerCalls& operator=(const PeerCalls&) = delete;

  void Cancel() {
    for (Call& call : calls_) call.context->TryCancel();
  }
  // All answers, or the first error by server.
  absl::StatusOr<std::vector<Response>> Wait() {
    left_.Wait();
    waited_ = true;
    std::vector<Response> responses;
    for (size_t k = 0; k < calls_.size(); ++k) {
      if (!calls_[k].status.ok()) return FromPeer(calls_[k].status, addresses_[k]);
      responses.push_back(std::move(calls_[k].response));
    }
    return responses;
  }

 private:
  struct Call {
    std::unique_ptr<grpc::ClientContext> context;
    std::shared_ptr<v1::BlockService::Stub> stub;
    Response response;
    grpc::Status status;
  };
  const std::vector<std::string> addresses_;
  std::vector<Call> calls_;
  absl::BlockingCounter left_;
  bool waited_ = false;
};

}  // namespace ndmap::server

// SPDX-License-Identifier: GPL-3.0-or-later
// One call to each of several block servers at the same time.
#pragma once

#include <grpcpp/client_context.h>

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/container/flat_hash_map.h"
#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"
#include "ndmap/v1/block_service.grpc.pb.h"
#include "service/channel.h"
#include "service/connection_reason.h"
#include "service/status.h"

namespace ndmap::coordinator {

// Stubs of block servers, by address, made once.
class Stubs {
 public:
  std::shared_ptr<v1::BlockService::Stub> Get(const std::string& address) {
    absl::MutexLock lock(&mutex_);
    std::shared_ptr<v1::BlockService::Stub>& stub = stubs_[address];
    if (stub == nullptr) stub = v1::BlockService::NewStub(service::MakeChannel(address));
    return stub;
  }

 private:
  absl::Mutex mutex_;
  absl::flat_hash_map<std::string, std::shared_ptr<v1::BlockService::Stub>> stubs_ ABSL_GUARDED_BY(mutex_);
};

struct Target {
  uint32_t server_id = 0;
  uint64_t incarnation = 0;
  std::string address;
  std::shared_ptr<v1::BlockService::Stub> stub;

  std::string Name() const { return absl::StrCat("server ", server_id, " (", address, ")"); }
};

// While calls are under way, asked a few times a second for each server that has not answered; an error (the
// server is lost, the coordinator stops) ends its call.
using Watch = std::function<absl::Status(const Target&)>;

template <class Request, class Response>
using Method = void (v1::BlockService::StubInterface::async_interface::*)(grpc::ClientContext*,
                                                                          const Request*, Response*,
                                                                          std::function<void(grpc::Status)>);

// Sends request i to target i and waits for all answers. The first error, by target, with the server's name
// when the server could not be reached.
template <class Request, class Response>
absl::Status CallAll(const std::vector<Target>& targets, const std::vector<Request>& requests,
                     std::vector<Response>* responses, Method<Request, Response> method, const Watch& watch) {
  struct Call {
    grpc::ClientContext context;
    grpc::Status status;
    absl::Status ended;
    bool done = false;
  };
  constexpr absl::Duration kLook = absl::Milliseconds(200);
  absl::Mutex mutex;
  std::vector<Call> calls(targets.size());
  size_t left = targets.size();
  responses->assign(targets.size(), Response());
  for (size_t i = 0; i < targets.size(); ++i) {
    // A server that is only slow is waited for; the watch ends the call to one that is gone.
    (targets[i].stub->async()->*method)(&calls[i].context, &requests[i], &(*responses)[i],
                                        [&, i](grpc::Status status) {
                                          absl::MutexLock lock(&mutex);
                                          calls[i].status = std::move(status);
                                          calls[i].done = true;
                                          --left;
                                        });
  }
  auto all_done = [&left] { return left == 0; };
  while (true) {
    {
      absl::MutexLock lock(&mutex);
      if (mutex.AwaitWithTimeout(absl::Condition(&all_done), kLook)) break;
    }
    for (size_t i = 0; i < targets.size(); ++i) {
      {
        absl::MutexLock lock(&mutex);
        if (calls[i].done || !calls[i].ended.ok()) continue;
      }
      calls[i].ended = watch(targets[i]);
      if (!calls[i].ended.ok()) calls[i].context.TryCancel();
    }
  }
  for (size_t i = 0; i < targets.size(); ++i) {
    if (calls[i].status.ok()) continue;
    if (!calls[i].ended.ok()) return calls[i].ended;
    const absl::Status status = service::FromGrpc(calls[i].status);
    if (!absl::IsUnavailable(status)) return status;
    return absl::UnavailableError(
        absl::StrCat(targets[i].Name(), " is gone: ", service::ConnectionReason(status.message())));
  }
  return absl::OkStatus();
}

}  // namespace ndmap::coordinator

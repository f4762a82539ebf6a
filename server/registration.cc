// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/registration.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "service/channel.h"
#include "service/guarded.h"
#include "service/status.h"
#include "service/version.h"

namespace ndmap::server {

Registration::Registration(const std::string& coordinator, v1::RegisterServerRequest request,
                           Holdings holdings)
    : coordinator_(coordinator),
      request_(std::move(request)),
      holdings_(std::move(holdings)),
      stub_(v1::Coordinator::NewStub(service::MakeChannel(coordinator))) {}

Registration::~Registration() { Stop(); }

absl::Status Registration::Register(absl::Time deadline) {
  grpc::ClientContext context;
  context.set_deadline(absl::ToChronoTime(deadline));
  context.set_wait_for_ready(true);
  v1::RegisterServerResponse response;
  const grpc::Status status = stub_->RegisterServer(&context, request_, &response);
  if (status.error_code() == grpc::StatusCode::DEADLINE_EXCEEDED ||
      status.error_code() == grpc::StatusCode::UNAVAILABLE) {
    return absl::UnavailableError(absl::StrCat("no coordinator answers at ", coordinator_));
  }
  if (!status.ok()) return service::FromGrpc(status);
  registered_ = response;
  if (absl::Status s = service::CheckVersion(request_.version(), response.version()); !s.ok()) return s;
  spdlog::info("registered at {} as server {}", coordinator_, response.server_id());
  return absl::OkStatus();
}

absl::Status Registration::Begin(absl::Duration timeout) {
  absl::Status status = Register(absl::Now() + timeout);
  // A server that was killed at this address may have been this one: the end of its lease will tell.
  while (absl::IsAborted(status)) {
    spdlog::warn("{}", std::string(status.message()));
    status = Register(absl::Now() + timeout);
  }
  if (!status.ok()) return status;
  thread_ = std::thread([this] { KeepAlive(); });
  return absl::OkStatus();
}

void Registration::Stop() {
  {
    absl::MutexLock lock(&mutex_);
    stopping_ = true;
  }
  if (thread_.joinable()) thread_.join();
  SayGoodbye();
}

void Registration::SayGoodbye() {
  // Nobody waits long for a coordinator that is gone, too.
  constexpr absl::Duration kPatience = absl::Seconds(1);
  if (registered_.incarnation() == 0) return;
  grpc::ClientContext context;
  context.set_deadline(absl::ToChronoTime(absl::Now() + kPatience));
  v1::UnregisterServerRequest request;
  request.set_server_id(registered_.server_id());
  request.set_incarnation(registered_.incarnation());
  v1::UnregisterServerResponse response;
  const grpc::Status status = stub_->UnregisterServer(&context, request, &response);
  if (!status.ok())
    spdlog::info("the coordinator at {} was not told: {}", coordinator_, status.error_message());
  registered_.Clear();
}

void Registration::KeepAlive() {
  while (true) {
    const absl::Duration beat = absl::Milliseconds(std::max(registered_.lease_milliseconds(), 300u) / 4);
    {
      absl::MutexLock lock(&mutex_);
      mutex_.AwaitWithTimeout(absl::Condition(&stopping_), beat);
      if (stopping_) return;
    }
    const absl::Status status = service::Guarded([&]() -> absl::Status {
      Beat(beat);
      return absl::OkStatus();
    });
    if (!status.ok()) spdlog::warn("a heartbeat failed: {}", std::string(status.message()));
  }
}

void Registration::Beat(absl::Duration deadline) {
  grpc::ClientContext context;
  context.set_deadline(absl::ToChronoTime(absl::Now() + deadline));
  v1::HeartbeatRequest request;
  request.set_server_id(registered_.server_id());
  request.set_incarnation(registered_.incarnation());
  for (const auto& [map, number] : holdings_.maps()) {
    v1::MapNumber& here = *request.add_maps();
    here.set_map(map);
    here.set_number(number);
  }
  v1::HeartbeatResponse response;
  const grpc::Status status = stub_->Heartbeat(&context, request, &response);
  for (const v1::MapNumber& deleted : response.drop()) {
    spdlog::info("map \"{}\" was deleted: its blocks are dropped", deleted.map());
    holdings_.drop(deleted.map(), deleted.number());
  }
  if (status.error_code() == grpc::StatusCode::NOT_FOUND) {
    spdlog::warn("the coordinator at {} does not know this server any more: registering again", coordinator_);
    holdings_.drop_everything();
    if (absl::Status s = Register(absl::Now() + deadline); !s.ok())
      spdlog::warn("{}", std::string(s.message()));
  } else if (status.ok() != reachable_) {
    reachable_ = status.ok();
    if (reachable_) {
      spdlog::info("the coordinator at {} answers again", coordinator_);
    } else {
      spdlog::warn("the coordinator at {} does not answer: {}", coordinator_, status.error_message());
    }
  }
}

}  // namespace ndmap::server

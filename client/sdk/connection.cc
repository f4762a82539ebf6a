// SPDX-License-Identifier: Apache-2.0
#include "client/sdk/connection.h"

#include <utility>

#include "absl/strings/str_cat.h"

namespace ndmap::internal {

v1::Version SdkVersion() {
  v1::Version version;
  version.set_protocol(v1::PROTOCOL_CURRENT);
  version.set_release(NDMAP_RELEASE);
  version.set_program("sdk");
  return version;
}

std::string ServerName(const std::string& address) { return absl::StrCat("the block server at ", address); }

Connection::Connection(std::string target, ClientOptions options)
    : target_(std::move(target)),
      options_(options),
      name_(absl::StrCat("the coordinator at ", target_)),
      coordinator_(v1::Coordinator::NewStub(MakeChannel(target_))) {}

absl::StatusOr<std::shared_ptr<v1::BlockService::Stub>> Connection::BlockServer(const std::string& address) {
  {
    absl::MutexLock lock(&mutex_);
    auto known = servers_.find(address);
    if (known != servers_.end()) return known->second;
  }
  std::shared_ptr<v1::BlockService::Stub> stub = v1::BlockService::NewStub(MakeChannel(address));
  v1::GetVersionRequest request;
  *request.mutable_caller() = SdkVersion();
  v1::GetVersionResponse response;
  absl::Status status = Retry(options_, [&] {
    return CallOnce(*stub, &v1::BlockService::Stub::GetVersion, request, &response, options_.connect_timeout,
                    ServerName(address));
  });
  if (!status.ok()) return status;
  absl::MutexLock lock(&mutex_);
  return servers_.try_emplace(address, std::move(stub)).first->second;
}

}  // namespace ndmap::internal

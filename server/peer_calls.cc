// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/peer_calls.h"

#include <set>

#include "absl/strings/str_cat.h"

namespace ndmap::server {

std::vector<std::string> OtherServers(const BlockHost::MapInfo& info, const std::string& self) {
  std::set<std::string> others;
  for (const std::string& address : info.addresses) {
    if (!address.empty() && address != self) others.insert(address);
  }
  return {others.begin(), others.end()};
}

absl::Status FromPeer(const grpc::Status& status, const std::string& address) {
  if (status.ok()) return absl::OkStatus();
  const absl::Status plain = service::FromGrpc(status);
  switch (status.error_code()) {
    case grpc::StatusCode::UNAVAILABLE:
    case grpc::StatusCode::DEADLINE_EXCEEDED:
      return absl::Status(
          plain.code(), absl::StrCat("the block server at ", address, " does not answer: ", plain.message()));
    case grpc::StatusCode::NOT_FOUND:
      // It was asked about a map of which it had blocks.
      return absl::UnavailableError(
          absl::StrCat("the block server at ", address, " has lost its blocks: ", plain.message()));
    default:
      return plain;
  }
}

}  // namespace ndmap::server

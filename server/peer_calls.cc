// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/peer_calls.h"

#include <set>

#include "absl/strings/str_cat.h"
#include "service/connection_reason.h"

namespace ndmap::server {

std::vector<std::string> OtherServers(const BlockHost::MapInfo& info, const std::string& self) {
  std::set<std::string> others;
  for (const std::string& address : info.addresses) {
    if (!address.empty() && address != self) others.insert(address);
  }
  return {others.begin(), others.end()};
}

absl::Status FromServer(const grpc::Status& status, absl::string_view who) {
  const absl::Status plain = service::FromGrpc(status);
  if (!absl::IsUnavailable(plain) && !absl::IsDeadlineExceeded(plain)) return plain;
  return absl::Status(plain.code(),
                      absl::StrCat(who, " does not answer: ", service::ConnectionReason(plain.message())));
}

absl::Status FromPeer(const grpc::Status& status, const std::string& address) {
  const std::string who = absl::StrCat("the block server at ", address);
  if (status.error_code() != grpc::StatusCode::NOT_FOUND) return FromServer(status, who);
  return absl::UnavailableError(absl::StrCat(who, " has lost its blocks: ", status.error_message()));
}

}  // namespace ndmap::server

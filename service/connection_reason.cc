// SPDX-License-Identifier: GPL-3.0-or-later
#include "service/connection_reason.h"

#include "absl/strings/match.h"

namespace ndmap::service {

std::string ConnectionReason(absl::string_view message) {
  // "failed to connect to all addresses; last error: UNKNOWN: ipv4:127.0.0.1:1: Failed to connect to remote
  // host: Connection refused"
  const bool of_grpc =
      absl::StartsWith(message, "failed to connect") || absl::StartsWith(message, "DNS resolution");
  const size_t last = message.rfind(": ");
  return std::string(of_grpc && last != absl::string_view::npos ? message.substr(last + 2) : message);
}

}  // namespace ndmap::service

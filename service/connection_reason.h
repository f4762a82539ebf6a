// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "absl/strings/string_view.h"

namespace ndmap::service {

// What gRPC says of a peer that it could not reach, without the way to it: "Connection refused". What a peer
// itself has said stays as it is.
std::string ConnectionReason(absl::string_view message);

}  // namespace ndmap::service

// SPDX-License-Identifier: GPL-3.0-or-later
// Checks of what comes over the wire, alike in both services.
#pragma once

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

namespace ndmap::service {

inline constexpr size_t kMaxNameLength = 128;
inline constexpr uint32_t kMaxBlocks = 1 << 16;

// 1 to 128 characters of [A-Za-z0-9._-] that do not begin with a dot. INVALID_ARGUMENT says what `what`
// ("map") is given and what is expected.
absl::Status CheckName(absl::string_view what, absl::string_view name);

// "host:port" with a port of 0 to 65535 and a host of letters, digits, '.', '-', '_' or an IPv6 address in
// brackets.
absl::Status CheckAddress(absl::string_view address);

}  // namespace ndmap::service

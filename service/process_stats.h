// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "absl/strings/string_view.h"
#include "ndmap/v1/common.pb.h"

namespace ndmap::service {

// What the operating system says of this process now: resident and peak memory, CPU seconds.
v1::ProcessStats ReadProcessStats(absl::string_view program, absl::string_view address);

}  // namespace ndmap::service

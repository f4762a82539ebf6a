// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "ndmap/v1/common.pb.h"

namespace ndmap::service {

inline constexpr char kRelease[] = NDMAP_RELEASE;

v1::Version MakeVersion(absl::string_view program);

// FAILED_PRECONDITION with one sentence that names both when the protocols differ.
absl::Status CheckVersion(const v1::Version& own, const v1::Version& other);

}  // namespace ndmap::service

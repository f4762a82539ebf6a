// SPDX-License-Identifier: Apache-2.0
// Words of betas.
#pragma once

#include <cstdint>

#include "absl/status/status.h"
#include "absl/types/span.h"

namespace ndmap::internal {

// INVALID_ARGUMENT for a letter above 3.
absl::Status CheckWord(absl::Span<const uint8_t> word);

}  // namespace ndmap::internal

// SPDX-License-Identifier: GPL-3.0-or-later
// Whole files into memory and out, with errors that name the file.
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace ndmap::internal {

// The content of a regular file; of one whose name ends in .xz, decompressed. NOT_FOUND, PERMISSION_DENIED,
// INVALID_ARGUMENT for a directory, a device or broken compression, RESOURCE_EXHAUSTED above max_bytes (of
// content).
absl::StatusOr<std::string> ReadFileBytes(const std::string& path, uint64_t max_bytes);

// Replaces the file; what was written of it goes if writing fails.
absl::Status WriteFileBytes(const std::string& path, absl::string_view bytes);

// The content of an xz stream (or several, one after the other).
absl::StatusOr<std::string> DecompressXz(absl::string_view bytes, uint64_t max_bytes);

}  // namespace ndmap::internal

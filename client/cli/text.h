// SPDX-License-Identifier: GPL-3.0-or-later
// What people type and read: sizes, grids, words of betas; numbers in columns.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace ndmap::cli {

// "1GiB", "256 MiB", "1.5kB", "4096": bytes. Units: B, KiB, MiB, GiB, TiB, kB, KB, MB, GB, TB.
// INVALID_ARGUMENT naming the text for anything else, for 0 and for 2^63 and more.
absl::StatusOr<uint64_t> ParseBytes(absl::string_view text);
// "10x11x9".
absl::StatusOr<std::array<uint32_t, 3>> ParseGridCells(absl::string_view text);
// "1,2,3" or "123": letters 0 ... 3, at least one.
absl::StatusOr<std::vector<uint8_t>> ParseWord(absl::string_view text);
// "0:12", block and dart; the dart may be "any".
struct DartName {
  uint32_t block = 0;
  uint32_t dart = 0;
  bool any = false;
};
absl::StatusOr<DartName> ParseDart(absl::string_view text);

// "12.3 MiB", "512 B".
std::string FormatBytes(uint64_t bytes);
// "1,234,567".
std::string FormatCount(int64_t count);
// "0.42 s", "1 min 23 s".
std::string FormatSeconds(double seconds);

}  // namespace ndmap::cli

// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/text.h"

#include <cctype>
#include <cmath>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_split.h"

namespace ndmap::cli {
namespace {

constexpr std::pair<absl::string_view, double> kUnits[] = {
    {"", 1},
    {"B", 1},
    {"KiB", 1024.0},
    {"MiB", 1024.0 * 1024},
    {"GiB", 1024.0 * 1024 * 1024},
    {"TiB", 1024.0 * 1024 * 1024 * 1024},
    {"kB", 1e3},
    {"KB", 1e3},
    {"MB", 1e6},
    {"GB", 1e9},
    {"TB", 1e12},
};

}  // namespace

absl::StatusOr<uint64_t> ParseBytes(absl::string_view text) {
  size_t digits = 0;
  while (digits < text.size() && (absl::ascii_isdigit(text[digits]) || text[digits] == '.')) ++digits;
  const absl::string_view unit = absl::StripAsciiWhitespace(text.substr(digits));
  double number = 0;
  if (digits > 0 && absl::SimpleAtod(text.substr(0, digits), &number)) {
    for (const auto& [name, factor] : kUnits) {
      if (name != unit) continue;
      const double bytes = number * factor;
      if (bytes >= 1 && bytes < 0x1p63) return static_cast<uint64_t>(bytes);
    }
  }
  return absl::InvalidArgumentError(
      absl::StrCat("'", text, "' is not a size, for example 256MiB, 1GiB or a number of bytes"));
}

absl::StatusOr<std::array<uint32_t, 3>> ParseGridCells(absl::string_view text) {
  std::array<uint32_t, 3> cells{};
  const std::vector<absl::string_view> parts = absl::StrSplit(text, 'x');
  bool good = parts.size() == 3;
  for (size_t i = 0; good && i < 3; ++i) good = absl::SimpleAtoi(parts[i], &cells[i]) && cells[i] > 0;
  if (!good) {
    return absl::InvalidArgumentError(
        absl::StrCat("'", text, "' is not AxBxC with three numbers from 1, for example 10x11x9"));
  }
  return cells;
}

absl::StatusOr<std::vector<uint8_t>> ParseWord(absl::string_view text) {
  std::vector<uint8_t> word;
  bool comma = true;
  for (char c : text) {
    if (c >= '0' && c <= '3') {
      word.push_back(static_cast<uint8_t>(c - '0'));
      comma = false;
    } else if (c == ',' && !comma) {
      comma = true;
    } else {
      word.clear();
      break;
    }
  }
  if (word.empty() || comma) {
    return absl::InvalidArgumentError(
        absl::StrCat("'", text, "' is not a word of betas 0 ... 3, for example 1,2,3"));
  }
  return word;
}

absl::StatusOr<DartName> ParseDart(absl::string_view text) {
  DartName name;
  const std::pair<absl::string_view, absl::string_view> parts = absl::StrSplit(text, absl::MaxSplits(':', 1));
  name.any = parts.second == "any";
  if (!absl::SimpleAtoi(parts.first, &name.block) ||
      (!name.any && !absl::SimpleAtoi(parts.second, &name.dart))) {
    return absl::InvalidArgumentError(
        absl::StrCat("'", text, "' is not a dart, BLOCK:INDEX, for example 0:12 or 0:any"));
  }
  return name;
}

std::string FormatBytes(uint64_t bytes) {
  static constexpr const char* kNames[] = {"B", "KiB", "MiB", "GiB", "TiB", "PiB"};
  double value = static_cast<double>(bytes);
  int unit = 0;
  while (value >= 1024 && unit < 5) {
    value /= 1024;
    ++unit;
  }
  return unit == 0 ? absl::StrCat(bytes, " B") : absl::StrFormat("%.1f %s", value, kNames[unit]);
}

std::string FormatCount(int64_t count) {
  const std::string digits = absl::StrCat(count);
  const size_t first = digits[0] == '-' ? 1 : 0;
  std::string text;
  for (size_t i = 0; i < digits.size(); ++i) {
    if (i > first && (digits.size() - i) % 3 == 0) text.push_back(',');
    text.push_back(digits[i]);
  }
  return text;
}

std::string FormatSeconds(double seconds) {
  if (seconds < 100) return absl::StrFormat("%.2f s", seconds);
  const int64_t whole = std::llround(seconds);
  if (whole < 3600) return absl::StrFormat("%d min %d s", whole / 60, whole % 60);
  return absl::StrFormat("%d h %d min", whole / 3600, whole / 60 % 60);
}

}  // namespace ndmap::cli

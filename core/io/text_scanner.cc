// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/io/text_scanner.h"

#include <cmath>
#include <string>

#include "absl/strings/escaping.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"

namespace ndmap::internal {
namespace {

bool IsSpace(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f'; }

}  // namespace

std::string Shown(absl::string_view word) {
  constexpr size_t kLongest = 40;
  return absl::StrCat("'", absl::CHexEscape(word.substr(0, kLongest)), word.size() > kLongest ? "..." : "",
                      "'");
}

absl::Status CheckNumber(absl::string_view word) {
  double value;
  if (!absl::SimpleAtod(word, &value))
    return absl::InvalidArgumentError(absl::StrCat(Shown(word), " is not a number"));
  if (!std::isfinite(value)) {
    return absl::InvalidArgumentError(absl::StrCat("coordinate ", Shown(word), " is not finite"));
  }
  return absl::OkStatus();
}

bool TextScanner::NextLine() {
  words_.clear();
  while (words_.empty() && !rest_.empty()) {
    const size_t end = rest_.find('\n');
    absl::string_view line = rest_.substr(0, end);
    rest_.remove_prefix(end == absl::string_view::npos ? rest_.size() : end + 1);
    ++line_;
    if (comment_ != '\0') line = line.substr(0, line.find(comment_));
    for (size_t i = 0; i < line.size();) {
      if (IsSpace(line[i])) {
        ++i;
        continue;
      }
      size_t stop = i;
      while (stop < line.size() && !IsSpace(line[stop])) ++stop;
      words_.push_back(line.substr(i, stop - i));
      i = stop;
    }
  }
  return !words_.empty();
}

absl::Status TextScanner::Wrong(absl::string_view what) const {
  const bool last = rest_.find_first_not_of(" \t\r\n") == absl::string_view::npos;
  return absl::InvalidArgumentError(absl::StrCat(last ? "truncated in line " : "line ", line_, ": ", what));
}

absl::Status TextScanner::CheckCoordinate(size_t i) const {
  if (i >= words_.size()) return Wrong("a point needs three coordinates");
  // Not through Wrong: a bad number is a bad number, in the last line too.
  if (absl::Status s = CheckNumber(words_[i]); !s.ok()) {
    return absl::InvalidArgumentError(absl::StrCat("line ", line_, ": ", s.message()));
  }
  return absl::OkStatus();
}

absl::StatusOr<int64_t> TextScanner::Integer(size_t i, absl::string_view what) const {
  if (i >= words_.size()) return Wrong(absl::StrCat(what, " is missing"));
  int64_t value;
  if (!absl::SimpleAtoi(words_[i], &value)) {
    return absl::InvalidArgumentError(
        absl::StrCat("line ", line_, ": ", what, " ", Shown(words_[i]), " is not an integer"));
  }
  return value;
}

}  // namespace ndmap::internal

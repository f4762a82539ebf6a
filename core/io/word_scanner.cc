// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/io/word_scanner.h"

#include <cmath>

#include "absl/strings/ascii.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "core/io/text_scanner.h"

namespace ndmap::internal {

bool WordScanner::Word(absl::string_view* word) {
  binary_ = false;
  for (; at_ < bytes_.size(); ++at_) {
    const char c = bytes_[at_];
    if (c == comment_ && comment_ != '\0') at_ = std::min(bytes_.find('\n', at_), bytes_.size() - 1);
    if (bytes_[at_] == '\n') {
      ++line_;
    } else if (c != comment_ && !absl::ascii_isspace(c)) {
      break;
    }
  }
  const size_t begin = at_;
  while (at_ < bytes_.size() && !absl::ascii_isspace(bytes_[at_])) ++at_;
  word_ = *word = bytes_.substr(begin, at_ - begin);
  line_of_word_ = line_;
  ended_ = word_.empty();
  return !ended_;
}

bool WordScanner::Integer(int64_t* value) {
  absl::string_view word;
  return Word(&word) && absl::SimpleAtoi(word, value);
}

bool WordScanner::Real(double* value) {
  absl::string_view word;
  return Word(&word) && absl::SimpleAtod(word, value) && std::isfinite(*value);
}

bool WordScanner::Take(uint64_t bytes) {
  binary_ = true;
  ended_ = bytes > left();
  if (!ended_) at_ += bytes;
  return !ended_;
}

bool WordScanner::EndLine() {
  while (at_ < bytes_.size() && bytes_[at_] != '\n' && absl::ascii_isspace(bytes_[at_])) ++at_;
  ended_ = at_ == bytes_.size();
  word_ = bytes_.substr(at_, 1);
  line_of_word_ = line_;
  binary_ = false;
  if (ended_ || bytes_[at_] != '\n') return false;
  ++at_;
  ++line_;
  return true;
}

bool WordScanner::SkipBehind(absl::string_view text) {
  const size_t found = bytes_.find(text, at_);
  ended_ = found == absl::string_view::npos;
  const size_t stop = ended_ ? bytes_.size() : found + text.size();
  line_ += static_cast<size_t>(std::count(bytes_.begin() + at_, bytes_.begin() + stop, '\n'));
  at_ = stop;
  return !ended_;
}

void WordScanner::SkipNumbers() {
  absl::string_view word;
  while (true) {
    const size_t line = line_, at = at_;
    if (!Word(&word)) return;
    if (!absl::ascii_isalpha(word[0])) continue;
    line_ = line;
    at_ = at;
    return;
  }
}

std::string WordScanner::Here() const {
  return binary_ ? absl::StrCat("byte ", at_) : absl::StrCat("line ", line_of_word_);
}

absl::Status WordScanner::Expected(absl::string_view what) const {
  if (ended_) {
    return absl::InvalidArgumentError(
        absl::StrCat("truncated: the file ends in ", Here(), " where ", what, " should be"));
  }
  return absl::InvalidArgumentError(
      absl::StrCat(Here(), ": ", Shown(word_), " stands where ", what, " should be"));
}

absl::Status WordScanner::Wrong(absl::string_view what) const {
  return absl::InvalidArgumentError(absl::StrCat(Here(), ": ", what));
}

}  // namespace ndmap::internal

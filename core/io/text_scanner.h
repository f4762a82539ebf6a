// SPDX-License-Identifier: GPL-3.0-or-later
// Lines and words of a text file, and the sentences about what is wrong in them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace ndmap::internal {

class TextScanner {
 public:
  // `comment` begins a comment that ends with the line; '\0' for none.
  TextScanner(absl::string_view text, char comment) : rest_(text), comment_(comment) {}

  // Goes to the next line that has words; false at the end.
  bool NextLine();
  const std::vector<absl::string_view>& words() const { return words_; }
  absl::string_view word(size_t i) const { return words_[i]; }
  size_t line() const { return line_; }

  // INVALID_ARGUMENT "line N: ..."; "truncated in line N: ..." if nothing follows it.
  absl::Status Wrong(absl::string_view what) const;

  // That word i of the line is a finite number, or an integer, and there at all.
  absl::Status CheckCoordinate(size_t i) const;
  absl::StatusOr<int64_t> Integer(size_t i, absl::string_view what) const;

 private:
  absl::string_view rest_;
  char comment_;
  std::vector<absl::string_view> words_;
  size_t line_ = 0;
};

inline absl::Status Invalid(absl::string_view what) { return absl::InvalidArgumentError(what); }

// A word as it may be shown in a message: cut short, printable.
std::string Shown(absl::string_view word);

// OK, or what is wrong with a coordinate.
absl::Status CheckNumber(absl::string_view word);

}  // namespace ndmap::internal

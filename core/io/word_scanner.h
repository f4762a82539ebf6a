// SPDX-License-Identifier: GPL-3.0-or-later
// Words and numbers of a file in which line ends mean nothing, or binary numbers between words, and the
// sentences about what is wrong in them. Where a file needs its lines: text_scanner.h.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

namespace ndmap::internal {

class WordScanner {
 public:
  // `comment` begins a comment that ends with the line; '\0' for none.
  WordScanner(absl::string_view bytes, char comment) : bytes_(bytes), comment_(comment) {}

  // Each takes what comes next, and says whether that is there and what was asked for; if not, Expected tells
  // why. A real number must be finite.
  bool Word(absl::string_view* word);
  bool Integer(int64_t* value);
  bool Real(double* value);
  template <class T>
  bool Binary(T* value) {
    if (!Take(sizeof(T))) return false;
    char raw[sizeof(T)];
    std::memcpy(raw, bytes_.data() + at_ - sizeof(T), sizeof(T));
    if (swap_) std::reverse(raw, raw + sizeof(T));
    std::memcpy(value, raw, sizeof(T));
    return true;
  }
  // Goes over this many bytes.
  bool Take(uint64_t bytes);
  // Goes behind the end of the line, if nothing else is in it.
  bool EndLine();
  // Goes behind the next place where `text` stands.
  bool SkipBehind(absl::string_view text);
  // Goes over words up to, not including, the next that begins with a letter; true at the end, too.
  void SkipNumbers();

  void set_swap(bool swap) { swap_ = swap; }
  size_t position() const { return at_; }
  size_t left() const { return bytes_.size() - at_; }

  // After a failure, with what should have been there: "line 7: 'x' stands where the number of points should
  // be", or "truncated: the file ends ...".
  absl::Status Expected(absl::string_view what) const;
  // "line 7: ...", or "byte 77: ..." after binary numbers.
  absl::Status Wrong(absl::string_view what) const;

 private:
  std::string Here() const;

  absl::string_view bytes_;
  char comment_;
  bool swap_ = false;
  bool binary_ = false;  // What was read last.
  bool ended_ = false;
  size_t at_ = 0;
  size_t line_ = 1, line_of_word_ = 1;
  absl::string_view word_;
};

}  // namespace ndmap::internal

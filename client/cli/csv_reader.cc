// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/csv_reader.h"

#include <utility>

#include "absl/strings/str_cat.h"

namespace ndmap::cli {

absl::Status CsvReader::Wrong(absl::string_view what) const {
  return absl::InvalidArgumentError(absl::StrCat(name_, ", line ", line_of_row_, ": ", what));
}

absl::StatusOr<bool> CsvReader::Next(std::vector<std::string>* cells) {
  for (;;) {
    absl::StatusOr<bool> more = Row(cells);
    if (!more.ok() || !*more) return more;
    if (cells->size() > 1 || !cells->front().empty()) return true;
  }
}

absl::StatusOr<bool> CsvReader::Row(std::vector<std::string>* cells) {
  cells->assign(1, "");
  line_of_row_ = line_;
  bool quoted = false, any = false;
  size_t bytes = 0;
  for (int c = std::getc(stream_);; c = std::getc(stream_)) {
    if (c == EOF) {
      if (std::ferror(stream_)) return absl::UnavailableError(absl::StrCat(name_, " cannot be read"));
      if (quoted) return Wrong("the quotes do not end");
      break;
    }
    any = true;
    if (++bytes > kMostBytes) return Wrong(absl::StrCat("a row of more than ", kMostBytes, " bytes"));
    if (c == '\n') ++line_;
    if (quoted) {
      if (c != '"') {
        cells->back().push_back(static_cast<char>(c));
        continue;
      }
      const int next = std::getc(stream_);
      if (next == '"') {
        cells->back().push_back('"');
      } else {
        quoted = false;
        std::ungetc(next, stream_);
      }
    } else if (c == '"' && cells->back().empty()) {
      quoted = true;
    } else if (c == ',') {
      cells->emplace_back();
    } else if (c == '\n') {
      break;
    } else {
      cells->back().push_back(static_cast<char>(c));
    }
  }
  if (!cells->back().empty() && cells->back().back() == '\r') cells->back().pop_back();
  return any;
}

}  // namespace ndmap::cli

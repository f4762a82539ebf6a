// SPDX-License-Identifier: GPL-3.0-or-later
// Rows with commas from a stream, as CsvText writes them: cells in quotes may hold commas, quotes (twice) and
// line ends.
#pragma once

#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace ndmap::cli {

class CsvReader {
 public:
  // `name` begins errors: "values.csv". The stream stays the caller's.
  CsvReader(std::FILE* stream, std::string name) : stream_(stream), name_(std::move(name)) {}

  // False at the end. Empty lines are left out; a carriage return before a line's end is none of the cell.
  // INVALID_ARGUMENT for quotes that do not end and rows of more than kMostBytes; UNAVAILABLE when the stream
  // cannot be read.
  absl::StatusOr<bool> Next(std::vector<std::string>* cells);
  // "values.csv, line 7: ..." about the row that Next gave.
  absl::Status Wrong(absl::string_view what) const;

  static constexpr size_t kMostBytes = size_t{1} << 20;

 private:
  absl::StatusOr<bool> Row(std::vector<std::string>* cells);

  std::FILE* const stream_;
  const std::string name_;
  uint64_t line_ = 1, line_of_row_ = 1;
};

}  // namespace ndmap::cli

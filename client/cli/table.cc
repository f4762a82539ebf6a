// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/table.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"

namespace ndmap::cli {

Table::Table(std::vector<std::string> titles) {
  for (std::string& title : titles) {
    left_.push_back(!title.empty() && title[0] == '<');
    title = std::string(absl::StripPrefix(title, "<"));
  }
  rows_.push_back(std::move(titles));
}

void Table::Add(std::vector<std::string> cells) {
  cells.resize(left_.size());
  rows_.push_back(std::move(cells));
}

std::string Table::Text(bool total_row) const {
  std::vector<size_t> widths(left_.size(), 0);
  for (const auto& row : rows_) {
    for (size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], row[i].size());
  }
  size_t line = 2 * (widths.size() - 1);
  for (size_t width : widths) line += width;
  const std::string rule = std::string(line, '-') + "\n";
  std::string text;
  for (size_t r = 0; r < rows_.size(); ++r) {
    if (r == 1 || (total_row && r + 1 == rows_.size() && r > 1)) text += rule;
    std::string out;
    for (size_t i = 0; i < rows_[r].size(); ++i) {
      const std::string pad(widths[i] - rows_[r][i].size(), ' ');
      if (i > 0) out += "  ";
      absl::StrAppend(&out, left_[i] ? "" : pad, rows_[r][i], left_[i] ? pad : "");
    }
    while (!out.empty() && out.back() == ' ') out.pop_back();
    absl::StrAppend(&text, out, "\n");
  }
  return text;
}

}  // namespace ndmap::cli

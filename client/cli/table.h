// SPDX-License-Identifier: GPL-3.0-or-later
// Aligned tables for people.
#pragma once

#include <string>
#include <vector>

namespace ndmap::cli {

class Table {
 public:
  // Columns are aligned to the right, the first one to the left when its title begins with '<', which is not
  // shown.
  explicit Table(std::vector<std::string> titles);
  // As many cells as there are titles.
  void Add(std::vector<std::string> cells);
  // Titles, a rule, the rows; a rule before the last row if `total_row`. Ends with a line's end.
  std::string Text(bool total_row = false) const;

 private:
  std::vector<bool> left_;
  std::vector<std::vector<std::string>> rows_;
};

}  // namespace ndmap::cli

// SPDX-License-Identifier: GPL-3.0-or-later
// Cells and darts as people and programs read them.
#pragma once

#include <string>
#include <vector>

#include "client/cli/cell_arguments.h"
#include "client/cli/context.h"

namespace ndmap::cli {

// Everything that is known of a cell.
Json CellAsJson(const v1::CellDetails& cell);
// The same for people, with its vertices.
std::string CellAsText(const v1::CellDetails& cell);

// Cells as rows of a table or of CSV: id, level, state, canonical dart, darts, blocks, whether it is at the
// boundary of the map, and the mean of its vertices. CSV has also dimension, version and vertices.
class CellRows {
 public:
  // With `first` a column of that title stands before the others.
  CellRows(bool csv, unsigned dimension, std::string first = "");
  void Add(const v1::CellDetails& cell, const std::string& first = "");
  // A row in which there is no cell, of a table only.
  void AddNone(const std::string& first);
  // With its count below a table.
  std::string Text() const;

 private:
  bool csv_;
  unsigned dimension_;
  bool has_first_;
  size_t count_ = 0;
  // All 3-cells so far are.
  bool hexahedra_ = true;
  std::vector<std::vector<std::string>> rows_;
};

// The shortest text that reads back as the same number.
std::string ExactNumber(double number);
// Rows with commas; a cell that holds commas or quotes is quoted.
std::string CsvText(const std::vector<std::vector<std::string>>& rows);

Json DartAsJson(const v1::DartInfo& dart);
std::string DartAsText(const v1::DartInfo& dart);

}  // namespace ndmap::cli

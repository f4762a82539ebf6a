// SPDX-License-Identifier: GPL-3.0-or-later
// Options that say which cells are meant: --ids, --box, --all, --level.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "client/sdk/attributes.h"

namespace ndmap::cli {

// "2" or "1-3": the lowest and the highest level.
absl::StatusOr<std::pair<uint32_t, uint32_t>> ParseLevels(absl::string_view text);
CLI::Validator LevelsText();

struct CellChoice {
  std::vector<std::string> ids;
  std::vector<std::string> box;
  std::string levels;
  bool all = false;
};
// Exactly one of them must be given.
void AddCellChoice(CLI::App* command, CellChoice* choice);

// The cells of `dimension`: with a box those of the hexahedra that it meets.
absl::StatusOr<v1::CellSelection> SelectionOf(const CellChoice& choice, uint32_t dimension);

}  // namespace ndmap::cli

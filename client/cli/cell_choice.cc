// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/cell_choice.h"

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "client/cli/cell_arguments.h"
#include "client/sdk/explore.h"
#include "core/map/ids.h"

namespace ndmap::cli {

absl::StatusOr<std::pair<uint32_t, uint32_t>> ParseLevels(absl::string_view text) {
  const std::vector<absl::string_view> ends = absl::StrSplit(text, absl::MaxSplits('-', 1));
  std::pair<uint32_t, uint32_t> levels;
  if (absl::SimpleAtoi(ends.front(), &levels.first) && absl::SimpleAtoi(ends.back(), &levels.second) &&
      levels.first <= levels.second && levels.second <= CellId::kMaxLevel) {
    return levels;
  }
  return absl::InvalidArgumentError(
      absl::StrCat("'", text, "' are no levels, expected for example 2 or 0-3, up to ", CellId::kMaxLevel));
}

CLI::Validator LevelsText() {
  return CLI::Validator([](std::string& text) { return std::string(ParseLevels(text).status().message()); },
                        "");
}

void AddCellChoice(CLI::App* command, CellChoice* choice) {
  CLI::Option_group* group = command->add_option_group("cells", "which cells: exactly one of");
  group->add_option("--ids,--cell", choice->ids, "cells by id: v12:5 h12/0.3")->check(CellText());
  group
      ->add_option(
          "--box", choice->box,
          "lower and upper corner X,Y,Z: the hexahedra that the closed box meets, or their vertices, "
          "edges or faces")
      ->expected(2)
      ->check(PointText());
  group->add_option("--level", choice->levels, "every cell of this level, or of levels 0-3")
      ->check(LevelsText());
  group->add_flag("--all", choice->all, "every cell");
  group->require_option(1);
}

absl::StatusOr<v1::CellSelection> SelectionOf(const CellChoice& choice, uint32_t dimension) {
  if (choice.all) return AllCells();
  if (!choice.levels.empty()) {
    const auto levels = ParseLevels(choice.levels);
    if (!levels.ok()) return levels.status();
    return CellsOfLevels(levels->first, levels->second);
  }
  if (choice.box.size() == 2) {
    absl::StatusOr<Point> lo = ParsePoint(choice.box[0]), hi = ParsePoint(choice.box[1]);
    if (!lo.ok()) return lo.status();
    if (!hi.ok()) return hi.status();
    return CellsOf(IncidentCells(BoxAnchor(*lo, *hi), 3, dimension));
  }
  CellIds ids;
  for (const std::string& text : choice.ids) {
    absl::StatusOr<CellId> id = CellId::Parse(text);
    if (!id.ok()) return id.status();
    if (id->dimension() != dimension) {
      return absl::InvalidArgumentError(absl::StrCat(text, " is of dimension ", id->dimension(),
                                                     ", the values are of ", CellWord(dimension, true)));
    }
    ids.Add(id->hi(), id->lo());
  }
  return TheseCells(ids);
}

}  // namespace ndmap::cli

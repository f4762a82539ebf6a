// SPDX-License-Identifier: GPL-3.0-or-later
// What commands about cells take: ids, darts, points, and how to answer. All of it is checked before anybody
// is asked.
#pragma once

#include <CLI/CLI.hpp>
#include <array>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "client/cli/context.h"

namespace ndmap::cli {

using Point = std::array<double, 3>;

// "1,2.5,-3": three finite numbers. INVALID_ARGUMENT naming the text for anything else.
absl::StatusOr<Point> ParsePoint(absl::string_view text);
// The dimension of the cell that an id in text form names. INVALID_ARGUMENT if it is none.
absl::StatusOr<unsigned> DimensionOf(absl::string_view id);
// Whether this is meant to be a dart, "0:12", and not the id of a cell: it begins with a digit.
bool IsDart(absl::string_view text);

CLI::Validator PointText();
CLI::Validator CellText();
CLI::Validator CellOrDartText();
// Dimensions 0 ... 3.
CLI::Validator DimensionText();

// -o table|json|csv.
void AddOutputOption(CLI::App* command, std::string* output);
// Whether the answer is CSV. Makes -o json the same as --json; INVALID_ARGUMENT when they contradict.
absl::StatusOr<bool> WantsCsv(Context& context, const std::string& output);

// The anchor that the text names; asks for some dart of the block for "0:any".
absl::StatusOr<v1::Anchor> CellOrDartAnchor(const MapHandle& map, const std::string& text);

// "vertex", "edges", ...
std::string CellWord(unsigned dimension, bool many);

}  // namespace ndmap::cli

// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/cell_arguments.h"

#include <cmath>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "client/cli/grid_options.h"
#include "client/cli/text.h"
#include "client/sdk/explore.h"
#include "core/map/ids.h"

namespace ndmap::cli {
namespace {

// What a parser refuses, the validator refuses with the same sentence.
template <class Parse>
CLI::Validator ValidatorOf(Parse parse) {
  return CLI::Validator([parse](std::string& text) { return std::string(parse(text).status().message()); },
                        "");
}

}  // namespace

absl::StatusOr<Point> ParsePoint(absl::string_view text) {
  const std::vector<absl::string_view> parts = absl::StrSplit(text, ',');
  Point point{};
  bool good = parts.size() == 3;
  for (size_t i = 0; good && i < 3; ++i)
    good = absl::SimpleAtod(parts[i], &point[i]) && std::isfinite(point[i]);
  if (good) return point;
  return absl::InvalidArgumentError(
      absl::StrCat("'", text, "' is not a point: three finite numbers, for example 1,2.5,-3"));
}

absl::StatusOr<unsigned> DimensionOf(absl::string_view id) {
  absl::StatusOr<CellId> cell = CellId::Parse(id);
  if (!cell.ok()) return cell.status();
  return cell->dimension();
}

bool IsDart(absl::string_view text) { return !text.empty() && absl::ascii_isdigit(text[0]); }

CLI::Validator PointText() { return ValidatorOf(ParsePoint); }
CLI::Validator CellText() { return ValidatorOf(DimensionOf); }
CLI::Validator CellOrDartText() {
  return CLI::Validator(
      [](std::string& text) {
        const absl::Status status = IsDart(text) ? ParseDart(text).status() : DimensionOf(text).status();
        return std::string(status.message());
      },
      "");
}
CLI::Validator DimensionText() { return WholeNumber(0, 3); }

void AddOutputOption(CLI::App* command, std::string* output) {
  command->add_option("-o,--output", *output, "table (default), json or csv; --json is the same as -o json")
      ->check(OneOf({"table", "json", "csv"}));
}

absl::StatusOr<bool> WantsCsv(Context& context, const std::string& output) {
  if (context.json && !output.empty() && output != "json") {
    return absl::InvalidArgumentError(absl::StrCat("--json contradicts -o ", output));
  }
  context.json = context.json || output == "json";
  return output == "csv";
}

absl::StatusOr<v1::Anchor> CellOrDartAnchor(const MapHandle& map, const std::string& text) {
  if (!IsDart(text)) return CellAnchor(text);
  absl::StatusOr<DartName> dart = ParseDart(text);
  if (!dart.ok()) return dart.status();
  if (!dart->any) return DartAnchor(dart->block, dart->dart);
  absl::StatusOr<v1::DartInfo> some = map.AnyDart(dart->block);
  if (!some.ok()) return some.status();
  return DartAnchor(some->dart());
}

std::string CellWord(unsigned dimension, bool many) {
  static constexpr const char* kOne[] = {"vertex", "edge", "face", "hexahedron"};
  static constexpr const char* kMany[] = {"vertices", "edges", "faces", "hexahedra"};
  return (many ? kMany : kOne)[dimension & 3];
}

}  // namespace ndmap::cli

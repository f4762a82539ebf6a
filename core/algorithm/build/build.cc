// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/algorithm/build/build.h"

#include <string>

#include "absl/strings/numbers.h"
#include "absl/strings/str_split.h"
#include "core/algorithm/refine/oracle.h"

namespace ndmap {

absl::StatusOr<std::array<uint32_t, 3>> ParseCells(absl::string_view text) {
  const std::vector<absl::string_view> parts = absl::StrSplit(text, 'x');
  std::array<uint32_t, 3> cells{};
  bool good = parts.size() == 3;
  uint64_t product = 1;
  for (size_t c = 0; good && c < 3; ++c) {
    good = absl::SimpleAtoi(parts[c], &cells[c]) && cells[c] > 0;
    product *= good ? cells[c] : 0;
    good = good && product < (uint64_t{1} << 32);
  }
  if (!good) {
    return absl::InvalidArgumentError(
        absl::StrCat("'", text, "', expected a grid AxBxC of positive counts with fewer than 2^32 cells"));
  }
  return cells;
}

namespace {

absl::StatusOr<CornerFunction> BoxCorners(const Parameters& parameters,
                                          const std::array<uint32_t, 3>& cells) {
  GridShape grid;
  grid.cells = cells;
  for (auto [name, corner] : {std::pair<const char*, Point3*>{"lo", &grid.lo}, {"hi", &grid.hi}}) {
    absl::StatusOr<std::string> value = parameters.Text(name);
    if (!value.ok()) return value.status();
    absl::StatusOr<Point3> point = ParsePoint(*value);
    if (!point.ok()) return point.status();
    *corner = *point;
  }
  for (int c = 0; c < 3; ++c) {
    if (!(grid.lo[c] < grid.hi[c])) return absl::InvalidArgumentError("grid: 'lo' is not below 'hi'");
  }
  return [grid](uint32_t i, uint32_t j, uint32_t k) { return grid.Corner(i, j, k); };
}

absl::StatusOr<CornerFunction> ListedCorners(absl::string_view text, const std::array<uint32_t, 3>& cells) {
  const uint64_t nx = uint64_t{cells[0]} + 1, ny = uint64_t{cells[1]} + 1;
  const double expected = static_cast<double>(nx) * static_cast<double>(ny) * (cells[2] + 1.0);
  std::vector<Point3> points;
  for (absl::string_view word : absl::StrSplit(text, ' ', absl::SkipEmpty())) {
    absl::StatusOr<Point3> point = ParsePoint(word);
    if (!point.ok()) return point.status();
    points.push_back(*point);
  }
  if (static_cast<double>(points.size()) != expected) {
    return absl::InvalidArgumentError(
        absl::StrCat("parameter 'corners' has ", points.size(), " points, expected ", expected));
  }
  return [nx, ny, points = std::move(points)](uint32_t i, uint32_t j, uint32_t k) {
    return points[i + nx * (j + ny * k)];
  };
}

}  // namespace

absl::StatusOr<GridPlan> ParseGridParameters(const Parameters& parameters, uint32_t block_count) {
  absl::StatusOr<std::string> text = parameters.Text("cells");
  if (!text.ok()) return text.status();
  absl::StatusOr<std::array<uint32_t, 3>> cells = ParseCells(*text);
  if (!cells.ok()) return cells.status();
  absl::StatusOr<CornerFunction> corner = parameters.Has("corners")
                                              ? ListedCorners(parameters.TextOr("corners", ""), *cells)
                                              : BoxCorners(parameters, *cells);
  if (!corner.ok()) return corner.status();
  text = parameters.Text("assignment");
  if (!text.ok()) return text.status();
  const uint64_t count = uint64_t{(*cells)[0]} * (*cells)[1] * (*cells)[2];
  absl::StatusOr<Assignment> assignment = Assignment::Decode(*text, count);
  if (!assignment.ok()) return assignment.status();
  if (assignment->block_count() > block_count) {
    return absl::InvalidArgumentError(absl::StrCat("assignment names block ", assignment->block_count() - 1,
                                                   " of ", block_count, " blocks"));
  }
  return GridPlan{*cells, *std::move(corner), *std::move(assignment)};
}

Parameters GridParameters(const GridShape& grid, const Assignment& assignment) {
  Parameters parameters;
  parameters.Set("cells", absl::StrCat(grid.cells[0], "x", grid.cells[1], "x", grid.cells[2]))
      .Set("lo", FormatPoint(grid.lo))
      .Set("hi", FormatPoint(grid.hi))
      .Set("assignment", assignment.Encode());
  return parameters;
}

}  // namespace ndmap

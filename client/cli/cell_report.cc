// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/cell_report.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_replace.h"
#include "client/cli/table.h"
#include "client/cli/text.h"
#include "core/map/ids.h"

namespace ndmap::cli {
namespace {

std::string NameOfDart(const v1::DartRef& dart) { return absl::StrCat(dart.block(), ":", dart.dart()); }

std::string IdText(const v1::CellId& id) { return CellId::FromWords(id.hi(), id.lo()).ToString(); }

std::string Vertices(const v1::CellDetails& cell) {
  return absl::StrJoin(cell.vertices(), " ",
                       [](std::string* out, const v1::CellId& id) { out->append(IdText(id)); });
}

Point Mean(const v1::CellDetails& cell) {
  Point mean{};
  for (const v1::Point& p : cell.points()) {
    mean[0] += p.x();
    mean[1] += p.y();
    mean[2] += p.z();
  }
  for (double& x : mean) x /= std::max(1, cell.points_size());
  return mean;
}

const char* YesOrNo(bool yes) { return yes ? "yes" : "no"; }

}  // namespace

std::string ExactNumber(double number) { return Json(number).dump(); }

Json CellAsJson(const v1::CellDetails& cell) {
  Json vertices = Json::array();
  for (int i = 0; i < std::min(cell.vertices_size(), cell.points_size()); ++i) {
    const v1::Point& p = cell.points(i);
    vertices.push_back({{"vertex", IdText(cell.vertices(i))}, {"point", {p.x(), p.y(), p.z()}}});
  }
  return {{"cell", cell.text()},
          {"dimension", cell.dimension()},
          {"kind", cell.kind().empty() ? Json(nullptr) : Json(cell.kind())},
          {"level", cell.level()},
          {"state", cell.state().empty() ? Json(nullptr) : Json(cell.state())},
          {"dart", NameOfDart(cell.dart())},
          {"version", cell.dart().version()},
          {"darts", cell.darts()},
          {"blocks", std::vector<uint32_t>(cell.blocks().begin(), cell.blocks().end())},
          {"boundary", cell.boundary()},
          {"vertices", std::move(vertices)}};
}

std::string CellAsText(const v1::CellDetails& cell) {
  std::string text =
      absl::StrFormat("%s: %s of level %d%s\n", cell.text(),
                      cell.kind().empty() ? CellWord(cell.dimension(), false) : cell.kind(), cell.level(),
                      cell.state().empty() ? "" : absl::StrCat(", ", cell.state()));
  absl::StrAppend(&text, "dart      ", NameOfDart(cell.dart()), " at version ", cell.dart().version(),
                  ", the canonical one of ", cell.darts(), "\n", "blocks    ",
                  absl::StrJoin(cell.blocks(), " "), "\n", "boundary  ", YesOrNo(cell.boundary()), "\n\n");
  Table table({"<vertex", "x", "y", "z"});
  for (int i = 0; i < std::min(cell.vertices_size(), cell.points_size()); ++i) {
    const v1::Point& p = cell.points(i);
    table.Add({IdText(cell.vertices(i)), absl::StrCat(p.x()), absl::StrCat(p.y()), absl::StrCat(p.z())});
  }
  return text + table.Text();
}

CellRows::CellRows(bool csv, unsigned dimension, std::string first)
    : csv_(csv), dimension_(dimension), has_first_(!first.empty()) {
  std::vector<std::string> titles;
  if (csv) {
    titles = {"cell",   "dimension", "level",    "state", "dart", "version", "darts",
              "blocks", "boundary",  "vertices", "x",     "y",    "z"};
  } else {
    titles = {"<cell", "level", "<state", "dart", "darts", "blocks", "boundary", "x", "y", "z"};
    if (dimension != 3) titles.erase(titles.begin() + 2);
    if (has_first_) first.insert(0, "<");
  }
  if (has_first_) titles.insert(titles.begin(), std::move(first));
  rows_.push_back(std::move(titles));
}

void CellRows::Add(const v1::CellDetails& cell, const std::string& first) {
  ++count_;
  hexahedra_ = hexahedra_ && (cell.kind().empty() || cell.kind() == "hexahedron");
  const Point at = Mean(cell);
  const std::string blocks = absl::StrJoin(cell.blocks(), " ");
  std::vector<std::string> row;
  if (has_first_) row.push_back(first);
  row.push_back(cell.text());
  if (csv_) row.push_back(absl::StrCat(cell.dimension()));
  row.push_back(absl::StrCat(cell.level()));
  if (csv_ || dimension_ == 3) row.push_back(cell.state());
  row.push_back(NameOfDart(cell.dart()));
  if (csv_) row.push_back(absl::StrCat(cell.dart().version()));
  row.insert(row.end(), {absl::StrCat(cell.darts()), blocks, YesOrNo(cell.boundary())});
  if (csv_) row.push_back(Vertices(cell));
  for (double x : at) row.push_back(csv_ ? ExactNumber(x) : absl::StrCat(x));
  rows_.push_back(std::move(row));
}

void CellRows::AddNone(const std::string& first) {
  if (!csv_) rows_.push_back({first, "none"});
}

std::string CellRows::Text() const {
  if (csv_) return CsvText(rows_);
  Table table(rows_[0]);
  for (size_t i = 1; i < rows_.size(); ++i) table.Add(rows_[i]);
  const std::string word = hexahedra_ ? CellWord(dimension_, count_ != 1) : count_ == 1 ? "cell" : "cells";
  return absl::StrCat(rows_.size() == 1 ? "" : table.Text(), FormatCount(static_cast<int64_t>(count_)), " ",
                      word, "\n");
}

std::string CsvText(const std::vector<std::vector<std::string>>& rows) {
  std::string text;
  for (const std::vector<std::string>& row : rows) {
    absl::StrAppend(
        &text,
        absl::StrJoin(row, ",",
                      [](std::string* out, const std::string& cell) {
                        const bool plain = cell.find_first_of(",\"\n") == std::string::npos;
                        if (plain) {
                          out->append(cell);
                        } else {
                          absl::StrAppend(out, "\"", absl::StrReplaceAll(cell, {{"\"", "\"\""}}), "\"");
                        }
                      }),
        "\n");
  }
  return text;
}

Json DartAsJson(const v1::DartInfo& dart) {
  return {{"dart", NameOfDart(dart.dart())},
          {"block", dart.dart().block()},
          {"index", dart.dart().dart()},
          {"version", dart.dart().version()},
          {"point", {dart.x(), dart.y(), dart.z()}},
          {"hexahedron", dart.cell()},
          {"level", dart.level()},
          {"critical", dart.critical()}};
}

std::string DartAsText(const v1::DartInfo& dart) {
  return absl::StrFormat("%d:%d at (%g, %g, %g) of %s%s", dart.dart().block(), dart.dart().dart(), dart.x(),
                         dart.y(), dart.z(), dart.cell(), dart.critical() ? ", critical" : "");
}

}  // namespace ndmap::cli

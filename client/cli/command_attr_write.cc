// SPDX-License-Identifier: GPL-3.0-or-later
// attr write: values from CSV or from VTU files.
#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <utility>

#include "absl/cleanup/cleanup.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "client/cli/attribute_text.h"
#include "client/cli/cell_arguments.h"
#include "client/cli/command_attr.h"
#include "client/cli/csv_reader.h"
#include "client/cli/values_from_vtu.h"
#include "core/io/piece_fields.h"
#include "core/map/ids.h"

namespace ndmap::cli {
namespace {

struct WriteOptions {
  std::string map, name, from, array;
};

// Which columns of a CSV file hold what.
struct FileColumns {
  size_t id = 0;
  std::vector<size_t> values;
};

absl::StatusOr<FileColumns> ColumnsOf(const CsvReader& csv, const std::vector<std::string>& titles,
                                      const v1::Attribute& attribute, const std::string& name) {
  const auto find = [&](const std::string& title) {
    return static_cast<size_t>(std::find(titles.begin(), titles.end(), title) - titles.begin());
  };
  FileColumns columns;
  columns.id = std::min(find("id"), find("cell"));
  for (const std::string& title : Titles(name, attribute.type())) columns.values.push_back(find(title));
  const auto there = [&](size_t column) { return column < titles.size(); };
  if (there(columns.id) && std::all_of(columns.values.begin(), columns.values.end(), there)) return columns;
  // A vector in one column, as 1,2,3.
  columns.values = {find(name)};
  if (there(columns.id) && there(columns.values[0])) return columns;
  return csv.Wrong(absl::StrCat("titles ", absl::StrJoin(titles, ","), ", expected id,",
                                absl::StrJoin(Titles(name, attribute.type()), ",")));
}

absl::StatusOr<ValuesByCell> ReadCsv(std::FILE* stream, const std::string& file,
                                     const v1::Attribute& attribute, const std::string& name) {
  CsvReader csv(stream, file);
  std::vector<std::string> row;
  absl::StatusOr<bool> more = csv.Next(&row);
  if (!more.ok()) return more.status();
  if (!*more) return csv.Wrong("is empty, expected titles and a row a cell");
  absl::StatusOr<FileColumns> columns = ColumnsOf(csv, row, attribute, name);
  if (!columns.ok()) return columns.status();
  const size_t width = row.size();
  ValuesByCell read;
  ColumnBuilder builder(attribute.type());
  for (more = csv.Next(&row); more.ok() && *more; more = csv.Next(&row)) {
    if (row.size() != width)
      return csv.Wrong(absl::StrCat(row.size(), " cells in this row, there are ", width, " titles"));
    absl::StatusOr<CellId> id = CellId::Parse(row[columns->id]);
    if (!id.ok()) return csv.Wrong(id.status().message());
    if (id->dimension() != attribute.dimension()) {
      return csv.Wrong(absl::StrCat(row[columns->id], " is of dimension ", id->dimension(), ", ",
                                    attribute.name(), " is of ", CellWord(attribute.dimension(), true)));
    }
    std::vector<absl::string_view> texts;
    for (size_t column : columns->values) texts.push_back(row[column]);
    if (absl::Status s = builder.Add(texts); !s.ok()) return csv.Wrong(s.message());
    read.cells.Add(id->hi(), id->lo());
  }
  if (!more.ok()) return more.status();
  read.values = builder.Take();
  return read;
}

absl::StatusOr<ValuesByCell> ReadValues(Context& context, const MapHandle& map, const WriteOptions& options,
                                        const v1::Attribute& attribute) {
  const std::string& name = options.array.empty() ? attribute.name() : options.array;
  if (options.from.empty()) return ReadCsv(stdin, "standard input", attribute, name);
  if (absl::EndsWithIgnoreCase(options.from, ".vtu") || absl::EndsWithIgnoreCase(options.from, ".pvtu"))
    return ValuesFromVtu(options.from, map.info(), attribute,
                         options.array.empty() ? FieldName(attribute.name()) : options.array);
  std::FILE* file = std::fopen(options.from.c_str(), "rb");
  if (file == nullptr) {
    return absl::NotFoundError(absl::StrCat(options.from, " cannot be read: ", std::strerror(errno)));
  }
  const absl::Cleanup close = [file] { std::fclose(file); };
  return ReadCsv(file, options.from, attribute, name);
}

absl::StatusOr<int> Write(Context& context, const WriteOptions& options) {
  absl::StatusOr<MapHandle> map = context.OpenMap(options.map);
  if (!map.ok()) return map.status();
  const auto& attributes = map->info().attributes();
  absl::StatusOr<v1::Attribute> attribute =
      FindAttribute({attributes.begin(), attributes.end()}, map->name(), options.name);
  if (!attribute.ok()) return attribute.status();
  absl::StatusOr<ValuesByCell> read = ReadValues(context, *map, options, *attribute);
  if (!read.ok()) return read.status();
  return PrintWritten(context, map->name(), *attribute,
                      map->WriteAttribute(options.name, read->cells, read->values));
}

}  // namespace

void AddWriteCommand(CLI::App& attr, Action& action) {
  auto options = std::make_shared<WriteOptions>();
  CLI::App* command =
      AddCommand(attr, "write", "values from CSV or VTU files (exit code 1: some ids are not there)",
                 "ndmap attr write bunny height --from heights.csv");
  command->add_option("MAP", options->map, "name of the map")->required();
  command->add_option("NAME", options->name, "name of the attribute")->required();
  command->add_option("--from", options->from,
                      "CSV file with titles id,NAME, or .vtu or .pvtu file (default: CSV on standard input)");
  command->add_option("--array", options->array, "column or array with the values (default: NAME)");
  command->callback(
      [&action, options] { action = [options](Context& context) { return Write(context, *options); }; });
}

}  // namespace ndmap::cli

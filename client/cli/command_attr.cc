// SPDX-License-Identifier: GPL-3.0-or-later
// Attributes of cells: attr define, drop, list, read, set. (attr write: command_attr_write.cc.)
#include "client/cli/command_attr.h"

#include <cstdio>
#include <memory>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "client/cli/attribute_text.h"
#include "client/cli/cell_arguments.h"
#include "client/cli/cell_choice.h"
#include "client/cli/cell_report.h"
#include "client/cli/grid_options.h"
#include "client/cli/job_display.h"
#include "client/cli/map_report.h"
#include "client/cli/table.h"
#include "client/cli/text.h"
#include "core/map/ids.h"

namespace ndmap::cli {
namespace {

struct AttrOptions {
  std::string map, name, type = "double", split = "copy", fill, value, output;
  uint32_t dimension = 3;
  bool has_dimension = false;
  std::vector<std::string> names;
  CellChoice cells;
};
using Shared = std::shared_ptr<AttrOptions>;

void AddMapArgument(CLI::App* command, const Shared& options) {
  command->add_option("MAP", options->map, "name of the map")->required();
}
void AddNameArgument(CLI::App* command, const Shared& options) {
  command->add_option("NAME", options->name, "name of the attribute")->required();
}
CLI::Option* AddDimensionOption(CLI::App* command, const Shared& options, const std::string& what) {
  return command->add_option("--dim", options->dimension, what)->check(DimensionText());
}

absl::StatusOr<int> PrintJobOf(Context& context, const absl::StatusOr<JobHandle>& handle) {
  if (!handle.ok()) return handle.status();
  absl::StatusOr<v1::Job> job = WatchJob(context, *handle, false);
  if (!job.ok()) return job.status();
  context.Print(JobAsJson(*job), JobAsText(*job));
  return 0;
}

absl::StatusOr<int> Define(Context& context, const MapHandle& map, const AttrOptions& options) {
  NewAttribute attribute(options.name);
  const v1::ValueType type = ValueTypeOf(options.type);
  attribute.OnCells(options.dimension).OfType(type).Split(SplitRuleOf(options.split));
  if (!options.fill.empty()) {
    absl::StatusOr<AttributeColumn> fill = OneValue(type, options.fill);
    if (!fill.ok()) {
      return absl::InvalidArgumentError(absl::StrCat("--fill: ", fill.status().message()));
    }
    if (type == v1::VALUE_TYPE_DOUBLE) attribute.Fill(fill->doubles[0]);
    if (type == v1::VALUE_TYPE_INT64) attribute.Fill(fill->integers[0]);
    if (type == v1::VALUE_TYPE_VEC3)
      attribute.Fill(std::array<double, 3>{fill->doubles[0], fill->doubles[1], fill->doubles[2]});
    if (type == v1::VALUE_TYPE_CATEGORY) attribute.Fill(fill->categories[0]);
  }
  return PrintJobOf(context, map.DefineAttribute(attribute));
}

absl::StatusOr<int> Drop(Context& context, const MapHandle& map, const AttrOptions& options) {
  return PrintJobOf(context, map.DropAttribute(options.name));
}

// What a definition's fill value is, as a column.
AttributeColumn FillOf(const v1::Attribute& attribute) {
  AttributeColumn column;
  column.type = attribute.type();
  const v1::Values& fill = attribute.fill();
  column.doubles.assign(fill.doubles().begin(), fill.doubles().end());
  column.integers.assign(fill.integers().begin(), fill.integers().end());
  column.codes.assign(fill.codes().begin(), fill.codes().end());
  column.categories.assign(fill.categories().begin(), fill.categories().end());
  if (column.size() == 1 && (column.codes.empty() || column.codes[0] < column.categories.size()))
    return column;
  const bool text = attribute.type() == v1::VALUE_TYPE_CATEGORY;
  return OneValue(attribute.type(), text                                      ? ""
                                    : attribute.type() == v1::VALUE_TYPE_VEC3 ? "0,0,0"
                                                                              : "0")
      .value_or(AttributeColumn());
}

absl::StatusOr<int> ListAttributes(Context& context, const MapHandle& map, const AttrOptions& options,
                                   bool csv) {
  std::vector<std::vector<std::string>> rows = {{"name", "cells", "type", "split", "fill"}};
  Table table({"<name", "<cells", "<type", "<split", "fill"});
  Json all = Json::array();
  for (const v1::Attribute& attribute : map.info().attributes()) {
    const AttributeColumn fill = FillOf(attribute);
    const std::string text = fill.size() == 1 ? ValueText(fill, 0) : "";
    rows.push_back({attribute.name(), CellWord(attribute.dimension(), true), NameOf(attribute.type()),
                    NameOf(attribute.split()), text});
    if (!csv) table.Add(rows.back());
    all.push_back({{"name", attribute.name()},
                   {"dimension", attribute.dimension()},
                   {"type", NameOf(attribute.type())},
                   {"split", NameOf(attribute.split())},
                   {"fill", fill.size() == 1 ? ValueAsJson(fill, 0) : Json(nullptr)}});
  }
  context.Print({{"map", map.name()}, {"attributes", std::move(all)}}, csv                ? CsvText(rows)
                                                                       : rows.size() == 1 ? "no attributes\n"
                                                                                          : table.Text());
  return 0;
}

// The dimension of all names, told or known. FAILED_PRECONDITION of cells when they are of several.
absl::StatusOr<uint32_t> DimensionOfNames(const MapHandle& map, const AttrOptions& options) {
  std::vector<v1::Attribute> known(map.info().attributes().begin(), map.info().attributes().end());
  uint32_t dimension = options.dimension;
  std::string first;
  for (const std::string& name : options.names) {
    if (absl::StartsWith(name, "@")) continue;
    absl::StatusOr<v1::Attribute> attribute = FindAttribute(known, map.name(), name);
    if (!attribute.ok()) return attribute.status();
    if ((!first.empty() || options.has_dimension) && attribute->dimension() != dimension) {
      return absl::InvalidArgumentError(
          absl::StrCat(name, " is of ", CellWord(attribute->dimension(), true), ", ",
                       first.empty() ? absl::StrCat("--dim ", dimension) : first, " of ",
                       CellWord(dimension, true), ": read them one after the other"));
    }
    first = name;
    dimension = attribute->dimension();
  }
  return dimension;
}

// Rows of cells and values. CSV is printed part by part: it may be long.
class ValueRows {
 public:
  ValueRows(Context& context, bool csv) : context_(context), csv_(csv) {}

  void Add(const CellValues& part) {
    if (titles_.empty()) {
      titles_ = {csv_ ? "id" : "<cell"};
      for (const AttributeColumn& column : part.columns) {
        for (std::string& title : Titles(column.name, column.type))
          titles_.push_back((!csv_ && column.type == v1::VALUE_TYPE_CATEGORY ? "<" : "") + title);
      }
      if (csv_ && !context_.json) Put({titles_});
    }
    std::vector<std::vector<std::string>> rows;
    size_t next_missing = 0;
    for (size_t i = 0; i < part.cells.size(); ++i) {
      std::string id = CellId::FromWords(part.cells.hi[i], part.cells.lo[i]).ToString();
      if (next_missing < part.missing.size() && part.missing[next_missing] == i) {
        ++next_missing;
        ++missing_;
        if (missing_ids_.size() < 10) missing_ids_.push_back(std::move(id));
        continue;
      }
      ++count_;
      if (context_.json) {
        Json cell{{"cell", std::move(id)}};
        for (const AttributeColumn& column : part.columns) cell[column.name] = ValueAsJson(column, i);
        cells_.push_back(std::move(cell));
        continue;
      }
      std::vector<std::string> row = {std::move(id)};
      for (const AttributeColumn& column : part.columns) {
        for (std::string& text : ValueTexts(column, i)) row.push_back(std::move(text));
      }
      rows.push_back(std::move(row));
    }
    if (csv_) {
      if (!rows.empty()) Put(rows);
    } else {
      for (auto& row : rows) rows_.push_back(std::move(row));
    }
  }

  void Finish(const MapHandle& map, const std::vector<std::string>& names, uint32_t dimension) {
    if (csv_ && !context_.json) {
      // Without cells nobody told the types.
      if (titles_.empty()) {
        std::vector<std::string> titles = {"id"};
        titles.insert(titles.end(), names.begin(), names.end());
        Put({titles});
      }
      return;
    }
    std::string text;
    if (!rows_.empty()) {
      Table table(titles_);
      for (auto& row : rows_) table.Add(std::move(row));
      text = table.Text();
    }
    absl::StrAppend(&text, FormatCount(static_cast<int64_t>(count_)), " ", CellWord(dimension, count_ != 1),
                    "\n");
    context_.Print({{"map", map.name()}, {"dimension", dimension}, {"count", count_}, {"cells", cells_}},
                   text);
  }
  absl::Status Missing(const std::string& map) const {
    return missing_ == 0 ? absl::OkStatus() : MissingError(map, missing_, missing_ids_);
  }

 private:
  static void Put(const std::vector<std::vector<std::string>>& rows) {
    const std::string text = CsvText(rows);
    std::fwrite(text.data(), 1, text.size(), stdout);
  }

  Context& context_;
  const bool csv_;
  std::vector<std::string> titles_;
  std::vector<std::vector<std::string>> rows_;
  Json cells_ = Json::array();
  uint64_t count_ = 0, missing_ = 0;
  std::vector<std::string> missing_ids_;
};

absl::StatusOr<int> Read(Context& context, const MapHandle& map, const AttrOptions& options, bool csv) {
  absl::StatusOr<uint32_t> dimension = DimensionOfNames(map, options);
  if (!dimension.ok()) return dimension.status();
  absl::StatusOr<v1::CellSelection> select = SelectionOf(options.cells, *dimension);
  if (!select.ok()) return select.status();
  ValueRows rows(context, csv);
  AttributeReader reader = map.ReadAttributes(*dimension, options.names, *std::move(select));
  for (absl::StatusOr<CellValues>& part : reader) {
    if (!part.ok()) return part.status();
    rows.Add(*part);
  }
  rows.Finish(map, options.names, *dimension);
  if (absl::Status s = rows.Missing(map.name()); !s.ok()) return s;
  return 0;
}

absl::StatusOr<int> Set(Context& context, const MapHandle& map, const AttrOptions& options) {
  absl::StatusOr<v1::Attribute> attribute = FindAttribute(
      {map.info().attributes().begin(), map.info().attributes().end()}, map.name(), options.name);
  if (!attribute.ok()) return attribute.status();
  absl::StatusOr<AttributeColumn> value = OneValue(attribute->type(), options.value);
  if (!value.ok()) return value.status();
  absl::StatusOr<v1::CellSelection> select = SelectionOf(options.cells, attribute->dimension());
  if (!select.ok()) return select.status();
  return PrintWritten(context, map.name(), *attribute, map.SetAttribute(options.name, *select, *value));
}

using AttrAnswer = std::function<absl::StatusOr<int>(Context&, const MapHandle&, const AttrOptions&)>;
using AnswerInRows = std::function<absl::StatusOr<int>(Context&, const MapHandle&, const AttrOptions&, bool)>;

// A command below "attr" about a map.
CLI::App* AddBelow(CLI::App& attr, Action& action, const char* name, const char* what, const char* example,
                   const Shared& options, AttrAnswer answer) {
  CLI::App* command = AddCommand(attr, name, what, example);
  AddMapArgument(command, options);
  command->callback([&action, options, answer = std::move(answer)] {
    action = [options, answer](Context& context) -> absl::StatusOr<int> {
      absl::StatusOr<MapHandle> map = context.OpenMap(options->map);
      if (!map.ok()) return map.status();
      return answer(context, *map, *options);
    };
  });
  return command;
}
// The same with -o.
CLI::App* AddBelowInRows(CLI::App& attr, Action& action, const char* name, const char* what,
                         const char* example, const Shared& options, AnswerInRows answer) {
  CLI::App* command =
      AddBelow(attr, action, name, what, example, options,
               [answer](Context& context, const MapHandle& map, const AttrOptions& o) -> absl::StatusOr<int> {
                 absl::StatusOr<bool> csv = WantsCsv(context, o.output);
                 if (!csv.ok()) return csv.status();
                 return answer(context, map, o, *csv);
               });
  AddOutputOption(command, &options->output);
  return command;
}

void AddDefine(CLI::App& attr, Action& action) {
  auto options = std::make_shared<AttrOptions>();
  CLI::App* command =
      AddBelow(attr, action, "define", "a new attribute, with its fill value on every cell",
               "ndmap attr define bunny temperature --dim 0 --split mean --fill 20", options, Define);
  AddNameArgument(command, options);
  AddDimensionOption(command, options, "of the cells: 0 vertices, 1 edges, 2 faces, 3 hexahedra")
      ->capture_default_str();
  command->add_option("--type", options->type, "of the values: double, int64, vec3 or category")
      ->check(OneOf(ValueTypeNames()))
      ->capture_default_str();
  command->add_option("--split", options->split, "what new cells get: copy, mean, midpoint, zero or divide")
      ->check(OneOf(SplitRuleNames()))
      ->capture_default_str();
  command->add_option("--fill", options->fill, "what every cell has at first (default: 0, or no text)");
}

}  // namespace

absl::StatusOr<int> PrintWritten(Context& context, const std::string& map, const v1::Attribute& attribute,
                                 const absl::StatusOr<v1::WriteAttributeResponse>& answer) {
  if (!answer.ok()) return answer.status();
  const std::vector<std::string> missing(answer->missing_ids().begin(), answer->missing_ids().end());
  Json json{{"map", map},
            {"attribute", attribute.name()},
            {"written", answer->written()},
            {"missing", answer->missing()},
            {"missing_ids", missing}};
  context.Print(json, absl::StrCat(FormatCount(static_cast<int64_t>(answer->written())), " ",
                                   CellWord(attribute.dimension(), answer->written() != 1), " written\n"));
  if (answer->missing() > 0) return MissingError(map, answer->missing(), missing);
  return 0;
}

void AddAttributeCommands(CLI::App& app, Action& action) {
  CLI::App* attr = AddCommand(app, "attr", "attributes of cells: define, drop, list, read, write, set",
                              "ndmap attr list bunny");
  attr->require_subcommand(1);
  AddDefine(*attr, action);

  auto drop = std::make_shared<AttrOptions>();
  AddNameArgument(AddBelow(*attr, action, "drop", "forget an attribute and its values",
                           "ndmap attr drop bunny temperature", drop, Drop),
                  drop);

  AddBelowInRows(*attr, action, "list", "the attributes of a map", "ndmap attr list bunny -o csv",
                 std::make_shared<AttrOptions>(), ListAttributes);

  auto read = std::make_shared<AttrOptions>();
  CLI::App* command =
      AddBelowInRows(*attr, action, "read", "values of cells (exit code 1: the map has not all of the ids)",
                     "ndmap attr read bunny temperature @point --all -o csv", read, Read);
  command
      ->add_option("NAME", read->names,
                   "attributes, or @point, @level, @block, and of hexahedra @volume, @state")
      ->required();
  CLI::Option* dimension =
      AddDimensionOption(command, read, "of the cells, when no attribute tells it (default: 3)");
  command->parse_complete_callback([read, dimension] { read->has_dimension = dimension->count() > 0; });
  AddCellChoice(command, &read->cells);

  AddWriteCommand(*attr, action);

  auto set = std::make_shared<AttrOptions>();
  command = AddBelow(*attr, action, "set", "one value for many cells (exit code 1: some ids are not there)",
                     "ndmap attr set bunny material rock --box 0,0,0 1,1,1", set, Set);
  AddNameArgument(command, set);
  command->add_option("VALUE", set->value, "a number, three as 1,2,3, or a text")->required();
  AddCellChoice(command, &set->cells);
}

}  // namespace ndmap::cli

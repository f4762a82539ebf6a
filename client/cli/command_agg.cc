// SPDX-License-Identifier: GPL-3.0-or-later
// agg: counts, sums, extremes, histograms and integrals of attributes.
#include <cmath>
#include <memory>
#include <optional>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_split.h"
#include "absl/strings/strip.h"
#include "client/cli/attribute_text.h"
#include "client/cli/cell_arguments.h"
#include "client/cli/cell_choice.h"
#include "client/cli/cell_report.h"
#include "client/cli/context.h"
#include "client/cli/table.h"
#include "client/cli/text.h"

namespace ndmap::cli {
namespace {

struct AggregateOptions {
  std::string map, name, by, histogram, levels, output;
  std::optional<uint32_t> dimension;
  bool integral = false;
};

struct Histogram {
  uint32_t bins = 0;
  double lo = 0, hi = 0;
};
absl::StatusOr<Histogram> ParseHistogram(absl::string_view text) {
  const std::vector<absl::string_view> parts = absl::StrSplit(text, ':');
  Histogram h;
  if (parts.size() == 3 && absl::SimpleAtoi(parts[0], &h.bins) && h.bins > 0 && h.bins <= 65536 &&
      absl::SimpleAtod(parts[1], &h.lo) && absl::SimpleAtod(parts[2], &h.hi) && std::isfinite(h.lo) &&
      std::isfinite(h.hi) && h.lo < h.hi) {
    return h;
  }
  return absl::InvalidArgumentError(absl::StrCat(
      "'", text,
      "' is no histogram, expected BINS:LO:HI with 1 to 65536 bins and LO < HI, for example 10:0:1"));
}

constexpr absl::string_view kCategory = "category:";
std::string CheckBy(const std::string& by) {
  if (by == "level" || by == "block" || (absl::StartsWith(by, kCategory) && by.size() > kCategory.size()))
    return "";
  return absl::StrCat("'", by, "', expected level, block or category:NAME");
}

absl::StatusOr<v1::AggregateRequest> Question(const MapHandle& map, const AggregateOptions& options) {
  v1::AggregateRequest question;
  question.set_name(options.name);
  question.set_dimension(options.dimension.value_or(3));
  const std::string category =
      absl::StartsWith(options.by, kCategory) ? options.by.substr(kCategory.size()) : "";
  question.set_group_by(options.by == "level"   ? v1::GROUP_BY_LEVEL
                        : options.by == "block" ? v1::GROUP_BY_BLOCK
                        : category.empty()      ? v1::GROUP_BY_NOTHING
                                                : v1::GROUP_BY_CATEGORY);
  question.set_category(category);
  // What is an attribute tells the dimension.
  for (const std::string& name : {category, options.name}) {
    if (name.empty() || name[0] == '@') continue;
    absl::StatusOr<v1::Attribute> attribute =
        FindAttribute({map.info().attributes().begin(), map.info().attributes().end()}, map.name(), name);
    if (!attribute.ok()) return attribute.status();
    if (options.dimension.has_value() && attribute->dimension() != *options.dimension) {
      return absl::InvalidArgumentError(absl::StrCat(name, " is of ", CellWord(attribute->dimension(), true),
                                                     ", --dim ", *options.dimension, " of ",
                                                     CellWord(*options.dimension, true)));
    }
    question.set_dimension(attribute->dimension());
  }
  if (!options.histogram.empty()) {
    absl::StatusOr<Histogram> h = ParseHistogram(options.histogram);
    if (!h.ok()) return h.status();
    question.set_bins(h->bins);
    question.set_histogram_lo(h->lo);
    question.set_histogram_hi(h->hi);
  }
  question.set_integral(options.integral);
  if (!options.levels.empty()) {
    const auto levels = ParseLevels(options.levels);
    if (!levels.ok()) return levels.status();
    question.set_by_level(true);
    question.set_lowest_level(levels->first);
    question.set_highest_level(levels->second);
  }
  return question;
}

template <class Field>
Json List(const Field& field) {
  return Json(std::vector<typename Field::value_type>(field.begin(), field.end()));
}

Json AsJson(const v1::Aggregate& group, const v1::AggregateRequest& question) {
  Json json{{"group", group.group()}, {"count", group.count()}};
  if (!question.name().empty() && group.sum_size() > 0) {
    json["not_finite"] = List(group.not_finite());
    json["sum"] = List(group.sum());
    if (group.has_integer_sum()) json["integer_sum"] = group.integer_sum();
    json["min"] = List(group.min());
    json["max"] = List(group.max());
  }
  if (question.integral()) {
    json["integral"] = List(group.integral());
    json["volume"] = group.volume();
  }
  if (question.bins() > 0) {
    json["histogram"] = List(group.histogram());
    json["below"] = List(group.below());
    json["above"] = List(group.above());
  }
  return json;
}

template <class Field>
std::string At(const Field& field, int component, bool exact) {
  if (component >= field.size()) return "";
  const double x = static_cast<double>(field.Get(component));
  return exact ? NumberText(x) : absl::StrCat(x);
}

// Rows: one a group and component; counts of categories have no further columns.
std::vector<std::vector<std::string>> Rows(const std::vector<v1::Aggregate>& groups,
                                           const v1::AggregateRequest& question, bool csv) {
  int components = 0;
  for (const v1::Aggregate& group : groups) components = std::max(components, group.sum_size());
  std::vector<std::string> titles = {csv ? "group" : "<group", "count"};
  if (components > 1) titles.insert(titles.begin() + 1, "component");
  if (components > 0) titles.insert(titles.end(), {"sum", "mean", "min", "max", "not_finite"});
  if (question.integral()) titles.insert(titles.end(), {"integral", "volume"});
  std::vector<std::vector<std::string>> rows = {titles};
  for (const v1::Aggregate& group : groups) {
    for (int c = 0; c < std::max(1, components); ++c) {
      std::vector<std::string> row = {!csv && question.group_by() == v1::GROUP_BY_NOTHING ? "all"
                                                                                          : group.group()};
      if (components > 1) row.push_back(absl::StrCat(c));
      row.push_back(csv ? absl::StrCat(group.count()) : FormatCount(static_cast<int64_t>(group.count())));
      if (components > 0) {
        const uint64_t bad = c < group.not_finite_size() ? group.not_finite(c) : 0;
        const double values = static_cast<double>(group.count() - std::min(bad, group.count()));
        row.push_back(group.has_integer_sum() ? absl::StrCat(group.integer_sum()) : At(group.sum(), c, csv));
        row.push_back(c >= group.sum_size() || values == 0 ? ""
                      : csv                                ? NumberText(group.sum(c) / values)
                                                           : absl::StrCat(group.sum(c) / values));
        row.push_back(At(group.min(), c, csv));
        row.push_back(At(group.max(), c, csv));
        row.push_back(absl::StrCat(bad));
      }
      if (question.integral()) {
        row.push_back(At(group.integral(), c, csv));
        row.push_back(csv ? NumberText(group.volume()) : absl::StrCat(group.volume()));
      }
      rows.push_back(std::move(row));
    }
  }
  return rows;
}

// Rows: one a bin.
std::vector<std::vector<std::string>> Bins(const v1::Aggregate& group, const v1::AggregateRequest& question,
                                           bool csv) {
  const int bins = static_cast<int>(question.bins());
  const int components = bins > 0 ? group.histogram_size() / bins : 0;
  std::vector<std::vector<std::string>> rows = {{"from", "to"}};
  for (int c = 0; c < components; ++c) {
    rows[0].push_back(components == 1 ? "count" : absl::StrCat("count:", c));
  }
  const auto add = [&](std::string from, std::string to, const auto& count_of) {
    std::vector<std::string> row = {std::move(from), std::move(to)};
    for (int c = 0; c < components; ++c) row.push_back(absl::StrCat(count_of(c)));
    rows.push_back(std::move(row));
  };
  const auto edge = [&](int bin) {
    const double x = question.histogram_lo() +
                     (question.histogram_hi() - question.histogram_lo()) * bin / std::max(1, bins);
    return csv ? NumberText(x) : absl::StrCat(x);
  };
  add("-inf", edge(0), [&](int c) { return c < group.below_size() ? group.below(c) : 0; });
  for (int bin = 0; bin < bins; ++bin)
    add(edge(bin), edge(bin + 1), [&](int c) { return group.histogram(c * bins + bin); });
  add(edge(bins), "inf", [&](int c) { return c < group.above_size() ? group.above(c) : 0; });
  return rows;
}

std::string TableText(const std::vector<std::vector<std::string>>& rows) {
  Table table(rows[0]);
  for (size_t i = 1; i < rows.size(); ++i) table.Add(rows[i]);
  return table.Text();
}

// CSV of a histogram: its rows, with the group before them.
std::string AsCsv(const std::vector<v1::Aggregate>& groups, const v1::AggregateRequest& question) {
  if (question.bins() == 0) return CsvText(Rows(groups, question, true));
  std::vector<std::vector<std::string>> all;
  for (const v1::Aggregate& group : groups) {
    std::vector<std::vector<std::string>> rows = Bins(group, question, true);
    for (size_t i = 0; i < rows.size(); ++i) {
      if (i == 0 && !all.empty()) continue;
      rows[i].insert(rows[i].begin(), i == 0 ? "group" : group.group());
      all.push_back(std::move(rows[i]));
    }
  }
  return CsvText(all);
}

std::string AsText(const std::vector<v1::Aggregate>& groups, const v1::AggregateRequest& question) {
  if (groups.empty()) return "no cells\n";
  std::string text = TableText(Rows(groups, question, false));
  for (const v1::Aggregate& group : groups) {
    if (question.bins() == 0 || group.histogram_size() == 0) continue;
    absl::StrAppend(&text, "\n", groups.size() > 1 ? absl::StrCat(group.group(), "\n") : "",
                    TableText(Bins(group, question, false)));
  }
  return text;
}

absl::StatusOr<int> Aggregate(Context& context, const AggregateOptions& options) {
  absl::StatusOr<bool> csv = WantsCsv(context, options.output);
  if (!csv.ok()) return csv.status();
  absl::StatusOr<MapHandle> map = context.OpenMap(options.map);
  if (!map.ok()) return map.status();
  absl::StatusOr<v1::AggregateRequest> question = Question(*map, options);
  if (!question.ok()) return question.status();
  absl::StatusOr<std::vector<v1::Aggregate>> groups = map->Aggregate(*question);
  if (!groups.ok()) return groups.status();
  Json all = Json::array();
  for (const v1::Aggregate& group : *groups) all.push_back(AsJson(group, *question));
  Json json{{"map", map->name()},
            {"name", options.name},
            {"dimension", question->dimension()},
            {"by", options.by.empty() ? Json(nullptr) : Json(options.by)},
            {"groups", std::move(all)}};
  if (question->bins() > 0) {
    json["bins"] = {
        {"count", question->bins()}, {"lo", question->histogram_lo()}, {"hi", question->histogram_hi()}};
  }
  context.Print(json, *csv ? AsCsv(*groups, *question) : AsText(*groups, *question));
  return 0;
}

}  // namespace

void AddAggregateCommand(CLI::App& app, Action& action) {
  auto options = std::make_shared<AggregateOptions>();
  CLI::App* command =
      AddCommand(app, "agg", "count, sum, mean, extremes, histogram and integral of an attribute",
                 "ndmap agg bunny temperature --by level --histogram 10:0:100");
  command->add_option("MAP", options->map, "name of the map")->required();
  command->add_option("NAME", options->name,
                      "attribute, or @level, @block, @point, @volume (default: cells are only counted)");
  command->add_option("--dim", options->dimension, "of the cells, when no attribute tells it (default: 3)")
      ->check(DimensionText());
  command->add_option("--by", options->by, "a row for each level, block or category:NAME")
      ->check(CLI::Validator([](std::string& text) { return CheckBy(text); }, ""));
  command->add_option("--level", options->levels, "only cells of this level, or of levels 0-3")
      ->check(LevelsText());
  command->add_option("--histogram", options->histogram, "BINS:LO:HI, bins of equal width")
      ->check(CLI::Validator(
          [](std::string& text) { return std::string(ParseHistogram(text).status().message()); }, ""));
  command->add_flag("--integral", options->integral, "also the integral over the volume");
  AddOutputOption(command, &options->output);
  command->callback(
      [&action, options] { action = [options](Context& context) { return Aggregate(context, *options); }; });
}

}  // namespace ndmap::cli

// SPDX-License-Identifier: GPL-3.0-or-later
// beta: a walk on the global map by Proposition 1, step by step.
#include <memory>

#include "absl/strings/str_cat.h"
#include "client/cli/cell_report.h"
#include "client/cli/context.h"
#include "client/cli/text.h"

namespace ndmap::cli {
namespace {

// The walk, begun again when the map changed under it while it went from block to block.
absl::StatusOr<Traced> TraceWord(const MapHandle& map, const DartName& name, absl::Span<const uint8_t> word) {
  constexpr int kAttempts = 20;
  v1::BetaStart start;
  if (name.any) {
    start.set_any_dart(true);
  } else {
    start.mutable_dart()->set_block(name.block);
    start.mutable_dart()->set_dart(name.dart);
  }
  absl::StatusOr<Traced> traced = map.Trace(name.block, start, word);
  for (int i = 1; i < kAttempts && absl::IsAborted(traced.status()); ++i) {
    traced = map.Trace(name.block, start, word);
  }
  return traced;
}

absl::StatusOr<int> Beta(Context& context, const std::string& name, const std::string& dart,
                         const std::string& word_text) {
  absl::StatusOr<DartName> dart_name = ParseDart(dart);
  if (!dart_name.ok()) return dart_name.status();
  absl::StatusOr<std::vector<uint8_t>> word = ParseWord(word_text);
  if (!word.ok()) return word.status();
  absl::StatusOr<Client> client = context.Connect();
  if (!client.ok()) return client.status();
  absl::StatusOr<MapHandle> map = client->OpenMap(name);
  if (!map.ok()) return map.status();
  const absl::StatusOr<Traced> traced = TraceWord(*map, *dart_name, *word);
  if (!traced.ok()) return traced.status();

  Json json{{"map", name}, {"word", *word}, {"start", DartAsJson(traced->start)}, {"steps", Json::array()}};
  std::string text = absl::StrCat("start  ", DartAsText(traced->start), "\n");
  uint32_t block_crossings = 0, server_crossings = 0;
  for (size_t i = 0; i < traced->steps.size(); ++i) {
    const Traced::Step& step = traced->steps[i];
    absl::StatusOr<std::string> server = map->AddressOf(step.at.dart().block());
    if (!server.ok()) return server.status();
    Json entry = DartAsJson(step.at);
    entry["beta"] = int{(*word)[i]};
    entry["server"] = *server;
    entry["crossed_block"] = step.crossed_block;
    entry["crossed_server"] = step.crossed_server;
    json["steps"].push_back(std::move(entry));
    absl::StrAppend(&text, "beta ", int{(*word)[i]}, " ", DartAsText(step.at));
    if (step.crossed_block) absl::StrAppend(&text, "; crossed to block ", step.at.dart().block());
    if (step.crossed_server) absl::StrAppend(&text, " on another service, ", *server);
    text += "\n";
    block_crossings += step.crossed_block ? 1 : 0;
    server_crossings += step.crossed_server ? 1 : 0;
  }
  if (traced->free) {
    absl::StrAppend(&text, "beta ", int{(*word)[traced->steps.size()]},
                    ": the dart is free, this is the boundary of the map\n");
  }
  const v1::DartInfo& last = traced->steps.empty() ? traced->start : traced->steps.back().at;
  json["end"] = traced->free ? "free" : "arrived";
  json["dart"] = absl::StrCat(last.dart().block(), ":", last.dart().dart());
  json["used"] = traced->steps.size();
  json["block_crossings"] = block_crossings;
  json["server_crossings"] = server_crossings;
  context.Print(json, text);
  return 0;
}

}  // namespace

void AddBetaCommand(CLI::App& app, Action& action) {
  struct Options {
    std::string map, dart, word;
  };
  auto options = std::make_shared<Options>();
  CLI::App* command =
      AddCommand(app, "beta", "walk on the global map, dart by dart, across blocks and services",
                 "ndmap beta bunny 0:any 1,2,3");
  command->add_option("MAP", options->map, "name of the map")->required();
  command->add_option("DART", options->dart, "BLOCK:INDEX, or BLOCK:any for some dart of the block")
      ->required();
  command->add_option("WORD", options->word, "betas 0 ... 3, applied from the first to the last: 1,2,3")
      ->required();
  command->callback([&action, options] {
    action = [options](Context& context) {
      return Beta(context, options->map, options->dart, options->word);
    };
  });
}

}  // namespace ndmap::cli

// SPDX-License-Identifier: GPL-3.0-or-later
// beta: a walk on the global map by Proposition 1, step by step.
#include <memory>

#include "absl/strings/str_cat.h"
#include "client/cli/cell_report.h"
#include "client/cli/context.h"
#include "client/cli/text.h"

namespace ndmap::cli {
namespace {

struct Step {
  Walked walked;
  std::string server;
};

// The dart that the user named, as it is now.
absl::StatusOr<v1::DartInfo> StartDart(const MapHandle& map, const DartName& name) {
  if (name.any) return map.AnyDart(name.block);
  v1::DartRef start;
  start.set_block(name.block);
  start.set_dart(name.dart);
  absl::StatusOr<std::vector<Walked>> walked = map.Beta({start}, {});
  if (!walked.ok()) return walked.status();
  return walked->front().at;
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
  absl::StatusOr<v1::DartInfo> at = StartDart(*map, *dart_name);
  if (!at.ok()) return at.status();

  Json json{{"map", name}, {"word", *word}, {"start", DartAsJson(*at)}, {"steps", Json::array()}};
  std::string text = absl::StrCat("start  ", DartAsText(*at), "\n");
  uint32_t block_crossings = 0, server_crossings = 0;
  bool free = false;
  for (uint8_t letter : *word) {
    absl::StatusOr<std::vector<Walked>> walked = map->Beta({at->dart()}, {letter});
    if (!walked.ok()) return walked.status();
    const Walked& step = walked->front();
    free = step.free;
    if (free) {
      absl::StrAppend(&text, "beta ", int{letter}, ": the dart is free, this is the boundary of the map\n");
      break;
    }
    absl::StatusOr<std::string> server = map->AddressOf(step.at.dart().block());
    if (!server.ok()) return server.status();
    Json entry = DartAsJson(step.at);
    entry["beta"] = int{letter};
    entry["server"] = *server;
    entry["crossed_block"] = step.block_crossings > 0;
    entry["crossed_server"] = step.server_crossings > 0;
    json["steps"].push_back(std::move(entry));
    absl::StrAppend(&text, "beta ", int{letter}, " ", DartAsText(step.at));
    if (step.block_crossings > 0) absl::StrAppend(&text, "; crossed to block ", step.at.dart().block());
    if (step.server_crossings > 0) absl::StrAppend(&text, " on another service, ", *server);
    text += "\n";
    block_crossings += step.block_crossings;
    server_crossings += step.server_crossings;
    *at = step.at;
  }
  json["end"] = free ? "free" : "arrived";
  json["dart"] = absl::StrCat(at->dart().block(), ":", at->dart().dart());
  json["used"] = json["steps"].size();
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

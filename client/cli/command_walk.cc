// SPDX-License-Identifier: GPL-3.0-or-later
// walk: by hand over the global map.
#include <unistd.h>

#include <cstdio>
#include <memory>
#include <utility>

#include "client/cli/cell_arguments.h"
#include "client/cli/context.h"
#include "client/cli/key_reader.h"
#include "client/cli/walk_session.h"

namespace ndmap::cli {
namespace {

// On standard output at once, or nowhere with --json.
void Say(const Context& context, const std::string& text) {
  if (context.json) return;
  std::fwrite(text.data(), 1, text.size(), stdout);
  std::fflush(stdout);
}

absl::StatusOr<int> Walk(Context& context, const std::string& name, const std::string& start) {
  absl::StatusOr<MapHandle> map = context.OpenMap(name);
  if (!map.ok()) return map.status();
  WalkSession session(*std::move(map));
  absl::StatusOr<std::string> text = session.Start(start);
  if (!text.ok()) return text.status();
  KeyReader keys(STDIN_FILENO, context.interrupts);
  if (keys.terminal()) Say(context, WalkSession::Keys());
  Say(context, *text);
  while (!session.ended()) {
    const std::optional<char> key = keys.Next();
    if (!key.has_value()) break;
    text = session.Press(*key);
    if (!text.ok()) return text.status();
    Say(context, *text);
  }
  if (context.json) context.Print(session.ToJson(), "");
  return 0;
}

}  // namespace

void AddWalkCommand(CLI::App& app, Action& action) {
  struct Options {
    std::string map, start;
  };
  auto options = std::make_shared<Options>();
  CLI::App* command = AddCommand(
      app, "walk",
      "walk on the global map by hand: keys 0-3 apply betas, b goes back, c shows the cells around, q ends",
      "ndmap walk bunny h12/0.3, or echo 1213c | ndmap walk bunny");
  command->add_option("MAP", options->map, "name of the map")->required();
  command
      ->add_option("START", options->start, "a dart, BLOCK:INDEX or BLOCK:any, or a cell (default: any dart)")
      ->check(CellOrDartText());
  command->callback([&action, options] {
    action = [options](Context& context) { return Walk(context, options->map, options->start); };
  });
}

}  // namespace ndmap::cli

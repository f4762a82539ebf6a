// SPDX-License-Identifier: GPL-3.0-or-later
// What every subcommand gets, and how it is entered in the command line.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/cli/interrupt.h"
#include "client/cli/progress.h"
#include "client/sdk/client.h"

namespace ndmap::cli {

using Json = nlohmann::ordered_json;

struct Context {
  Interrupts& interrupts;
  Progress& progress;
  bool json = false;
  // HOST:PORT of --coordinator or NDMAP_COORDINATOR; empty if neither was given.
  std::string coordinator;

  // The one object of --json, or the text for people, on standard output.
  void Print(const Json& object, const std::string& text) const;
  // The cluster that the user named.
  absl::StatusOr<Client> Connect() const;
  // A map of it.
  absl::StatusOr<MapHandle> OpenMap(const std::string& name) const;
};

// What the user asked for: 0 if it was done, another exit code if it was done and the answer is no (an
// invalid map).
using Action = std::function<absl::StatusOr<int>(Context&)>;

// Each enters subcommands; parsing one of them sets `action`.
void AddRunCommand(CLI::App& app, Action& action);
void AddUpCommand(CLI::App& app, Action& action);
void AddSampleCommand(CLI::App& app, Action& action);
void AddMapCommands(CLI::App& app, Action& action);
void AddJobCommands(CLI::App& app, Action& action);
void AddBetaCommand(CLI::App& app, Action& action);
void AddCellCommands(CLI::App& app, Action& action);
void AddAttributeCommands(CLI::App& app, Action& action);
void AddAggregateCommand(CLI::App& app, Action& action);
void AddWalkCommand(CLI::App& app, Action& action);
void AddInspectCommand(CLI::App& app, Action& action);
void AddCompletionCommand(CLI::App& app, Action& action);
void AddVersionCommand(CLI::App& app, Action& action);

// A subcommand with an example below its help.
CLI::App* AddCommand(CLI::App& app, const std::string& name, const std::string& what,
                     const std::string& example);

}  // namespace ndmap::cli

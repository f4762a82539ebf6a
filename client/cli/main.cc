// SPDX-License-Identifier: GPL-3.0-or-later
// The command line `ndmap`. Exit codes: 0 done, 1 not done or the answer is no, 2 a wrong command line, 128 +
// n ended by signal n.
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "client/cli/context.h"

namespace {

using namespace ndmap::cli;

constexpr int kFailed = 1;
constexpr int kWrongUse = 2;

// The command that was named, for errors: "ndmap run", "ndmap attr read".
std::string NameOf(const CLI::App& app) {
  const auto commands = app.get_subcommands();
  return commands.empty() ? app.get_name() : absl::StrCat(app.get_name(), " ", NameOf(*commands[0]));
}

int Fail(const std::string& who, absl::string_view what, int code) {
  std::fprintf(stderr, "%s: %s\n", who.c_str(), absl::StrReplaceAll(what, {{"\n", " "}}).c_str());
  return code;
}

// "-.5,0,0" is a point and not an option, which the parser sees by the digit that we put in: "-0.5,0,0".
std::vector<std::string> WithDigits(int argc, char** argv) {
  std::vector<std::string> arguments(argv, argv + argc);
  for (std::string& argument : arguments) {
    if (argument.size() > 2 && argument.compare(0, 2, "-.") == 0 && absl::ascii_isdigit(argument[2]))
      argument.insert(1, "0");
  }
  return arguments;
}

int Main(int argc, char** argv) {
  // gRPC's own log says nothing that our errors do not.
  setenv("GRPC_VERBOSITY", "NONE", 0);
  Interrupts interrupts;
  CLI::App app("Distributed adaptive hexahedral meshes from closed surfaces", "ndmap");
  app.footer(
      "ndmap COMMAND --help tells more of a command.\n"
      "Example: ndmap sample bumpy-torus -o torus.off && ndmap run torus.off --blocks 4 --depth 4 -o "
      "out/torus");
  app.require_subcommand(0, 1);
  bool json = false;
  std::string coordinator;
  app.add_flag("--json", json, "one JSON object on standard output, everything else on standard error");
  app.add_option("--coordinator", coordinator, "HOST:PORT of a running cluster's coordinator")
      ->envname("NDMAP_COORDINATOR");
  Action action;
  AddRunCommand(app, action);
  AddUpCommand(app, action);
  AddMapCommands(app, action);
  AddJobCommands(app, action);
  AddBetaCommand(app, action);
  AddCellCommands(app, action);
  AddAttributeCommands(app, action);
  AddAggregateCommand(app, action);
  AddWalkCommand(app, action);
  AddInspectCommand(app, action);
  AddSampleCommand(app, action);
  AddVersionCommand(app, action);
  AddCompletionCommand(app, action);
  const std::vector<std::string> arguments = WithDigits(argc, argv);
  std::vector<const char*> pointers;
  for (const std::string& argument : arguments) pointers.push_back(argument.c_str());
  try {
    app.parse(argc, pointers.data());
  } catch (const CLI::CallForHelp& help) {
    return app.exit(help);
  } catch (const CLI::CallForAllHelp& help) {
    return app.exit(help);
  } catch (const CLI::ParseError& error) {
    return Fail(NameOf(app), absl::StrCat(error.what(), " (", NameOf(app), " --help)"), kWrongUse);
  }
  if (!action) return Fail("ndmap", "no command was given (ndmap --help lists them)", kWrongUse);
  Progress progress(stderr, Progress::IsTerminal(stderr), false);
  Context context{interrupts, progress, json, coordinator};
  const absl::StatusOr<int> code = action(context);
  progress.Abandon();
  if (code.ok() && (std::fflush(stdout) != 0 || std::ferror(stdout) != 0)) {
    return Fail(NameOf(app), "standard output cannot be written", kFailed);
  }
  if (code.ok()) return *code;
  return Fail(NameOf(app), code.status().message(), kFailed);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return Main(argc, argv);
  } catch (const std::exception& error) {
    return Fail("ndmap", error.what(), kFailed);
  }
}

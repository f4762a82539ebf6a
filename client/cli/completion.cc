// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/completion.h"

#include <memory>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_replace.h"
#include "client/cli/context.h"
#include "client/cli/grid_options.h"

namespace ndmap::cli {
namespace {

// "--depth", "-o".
std::vector<std::string> NamesOf(const CLI::Option& option) {
  std::vector<std::string> names;
  for (const std::string& name : option.get_snames()) names.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) names.push_back("--" + name);
  return names;
}

bool TakesValue(const CLI::Option& option) { return option.get_items_expected_max() > 0; }

// What may be given, of a program below a command: that has a --help of its own.
std::vector<const CLI::Option*> Given(const CLI::App& app, bool below) {
  return app.get_options([&](const CLI::Option* option) { return !below || option != app.get_help_ptr(); });
}

std::vector<std::string> OptionsOf(const CLI::App& app, bool below = false) {
  std::vector<std::string> all;
  for (const CLI::Option* option : Given(app, below)) {
    for (std::string& name : NamesOf(*option)) all.push_back(std::move(name));
  }
  return all;
}

std::vector<const CLI::App*> CommandsOf(const CLI::App& app) { return app.get_subcommands(nullptr); }

// Options before the command whose value is no command: "--coordinator|--other".
std::string ValueOptions(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options()) {
    if (!TakesValue(*option)) continue;
    for (std::string& name : NamesOf(*option)) names.push_back(std::move(name));
  }
  return absl::StrJoin(names, "|");
}

// Within single quotes, in [...] of a zsh specification.
std::string ZshText(const std::string& text) {
  return absl::StrReplaceAll(
      text, {{"'", "'\\''"}, {"[", "\\["}, {"]", "\\]"}, {":", "\\:"}, {"\\", "\\\\"}, {"\n", " "}});
}

// Lines of _arguments for the options of `app`.
std::string ZshOptions(const CLI::App& app, const std::string& indent, bool below = false) {
  std::string text;
  for (const CLI::Option* option : Given(app, below)) {
    for (const std::string& name : NamesOf(*option)) {
      absl::StrAppend(&text, indent, "'", name, "[", ZshText(option->get_description()), "]",
                      TakesValue(*option) ? ":value:_files" : "", "' \\\n");
    }
  }
  return text;
}

}  // namespace

std::string BashCompletion(const CLI::App& app) {
  const std::string& program = app.get_name();
  std::vector<std::string> names;
  std::string cases;
  const std::string everywhere = absl::StrJoin(OptionsOf(app, true), " ");
  for (const CLI::App* command : CommandsOf(app)) {
    names.push_back(command->get_name());
    absl::StrAppend(&cases, "    ", command->get_name(), ") words='", absl::StrJoin(OptionsOf(*command), " "),
                    " ", everywhere, "' ;;\n");
  }
  return absl::StrCat(
      "# bash completion for ", program, ": eval \"$(", program, " completion bash)\"\n", "_", program,
      "() {\n", "  local word=${COMP_WORDS[COMP_CWORD]} command= words= i\n",
      "  for ((i = 1; i < COMP_CWORD; ++i)); do\n", "    case ${COMP_WORDS[i]} in\n      ", ValueOptions(app),
      ") ((++i)) ;;\n      -*) ;;\n      *) command=${COMP_WORDS[i]}; break ;;\n    esac\n  done\n",
      "  case $command in\n    '') words='", absl::StrJoin(names, " "), " ",
      absl::StrJoin(OptionsOf(app), " "), "' ;;\n", cases,
      "  esac\n  COMPREPLY=()\n  if [[ -z $command || $word == -* ]]; then\n",
      "    COMPREPLY=($(compgen -W \"$words\" -- \"$word\"))\n  fi\n}\n", "complete -o default -F _", program,
      " ", program, "\n");
}

std::string ZshCompletion(const CLI::App& app) {
  const std::string& program = app.get_name();
  std::string names, cases;
  for (const CLI::App* command : CommandsOf(app)) {
    absl::StrAppend(&names, "    '", command->get_name(), ":", ZshText(command->get_description()), "'\n");
    absl::StrAppend(&cases, "    ", command->get_name(), ")\n      _arguments \\\n",
                    ZshOptions(*command, "        "), ZshOptions(app, "        ", true),
                    "        '*:argument:_files'\n      ;;\n");
  }
  return absl::StrCat(
      "#compdef ", program, "\n# zsh completion for ", program, ": eval \"$(", program,
      " completion zsh)\"\n", "_", program, "() {\n  local -a commands\n  commands=(\n", names,
      "  )\n  local curcontext=$curcontext state line\n  _arguments -C \\\n", ZshOptions(app, "    "),
      "    '1:command:->command' \\\n    '*::argument:->argument'\n",
      "  if [[ $state == command ]]; then\n    _describe command commands\n    return\n  fi\n",
      "  case $line[1] in\n", cases,
      "  esac\n}\n# Loaded by name the file is the function's first call, otherwise it is entered.\n",
      "if [[ ${funcstack[1]-} == _", program, " ]]; then\n  _", program, " \"$@\"\nelse\n  compdef _",
      program, " ", program, "\nfi\n");
}

void AddCompletionCommand(CLI::App& app, Action& action) {
  auto shell = std::make_shared<std::string>();
  CLI::App* command = AddCommand(app, "completion", "a script that completes this command line in a shell",
                                 "ndmap completion bash > ~/.local/share/bash-completion/completions/ndmap");
  command->add_option("SHELL", *shell, "bash or zsh")->required()->check(OneOf({"bash", "zsh"}));
  command->callback([&app, &action, shell] {
    action = [&app, shell](Context& context) -> absl::StatusOr<int> {
      const std::string script = *shell == "bash" ? BashCompletion(app) : ZshCompletion(app);
      context.Print({{"shell", *shell}, {"script", script}}, script);
      return 0;
    };
  });
}

}  // namespace ndmap::cli

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
  std::vector<const CLI::Option*> given =
      app.get_options([&](const CLI::Option* option) { return !below || option != app.get_help_ptr(); });
  for (const CLI::App* group : app.get_subcommands([](const CLI::App* a) { return a->get_name().empty(); })) {
    for (const CLI::Option* option : group->get_options()) given.push_back(option);
  }
  return given;
}

std::vector<std::string> OptionsOf(const CLI::App& app, bool below = false) {
  std::vector<std::string> all;
  for (const CLI::Option* option : Given(app, below)) {
    for (std::string& name : NamesOf(*option)) all.push_back(std::move(name));
  }
  return all;
}

// Groups of options are commands without a name.
std::vector<const CLI::App*> CommandsOf(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App* command) { return !command->get_name().empty(); });
}

// Whether the first thing to be said after the command is the name of a map that is there.
bool BeginsWithMap(const CLI::App& command) {
  for (const CLI::Option* option : command.get_options()) {
    if (option->get_positional()) return option->get_name(true) == "MAP" && command.get_name() != "create";
  }
  return false;
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
  std::vector<std::string> names, parents;
  std::string cases;
  const std::string everywhere = absl::StrJoin(OptionsOf(app, true), " ");
  const auto add_case = [&](const std::string& name, const CLI::App& command, const std::string& more) {
    absl::StrAppend(&cases, "    ", name, ") words='", more, absl::StrJoin(OptionsOf(command), " "), " ",
                    everywhere, "'", BeginsWithMap(command) ? " map=yes" : "", " ;;\n");
  };
  for (const CLI::App* command : CommandsOf(app)) {
    names.push_back(command->get_name());
    std::string below;
    for (const CLI::App* sub : CommandsOf(*command)) {
      absl::StrAppend(&below, sub->get_name(), " ");
      add_case(absl::StrCat("'", command->get_name(), " ", sub->get_name(), "'"), *sub, "");
    }
    if (!below.empty()) parents.push_back(command->get_name());
    add_case(command->get_name(), *command, below);
  }
  // What follows an option with a value is no command.
  std::string values;
  for (const CLI::Option* option : Given(app, false)) {
    if (!TakesValue(*option)) continue;
    for (const std::string& name : NamesOf(*option)) {
      if (name != "--coordinator") absl::StrAppend(&values, "      ", name, ") ((++i)) ;;\n");
    }
  }
  return absl::StrCat(
      "# bash completion for ", program, ": eval \"$(", program, " completion bash)\"\n",
      // Bash takes HOST:PORT for three words.
      "_", program, "_coordinator() {\n  at=${COMP_WORDS[++i]}\n",
      "  while [[ ${COMP_WORDS[i + 1]-} == : ]]; do at+=:${COMP_WORDS[i + 2]-}; ((i += 2)); done\n}\n", "_",
      program, "() {\n  local word=${COMP_WORDS[COMP_CWORD]} command= words= open=yes map= at= i\n",
      "  for ((i = 1; i < COMP_CWORD; ++i)); do\n    case ${COMP_WORDS[i]} in\n", "      --coordinator) _",
      program, "_coordinator ;;\n", values, "      -*) ;;\n",
      "      *) command=\"${command:+$command }${COMP_WORDS[i]}\"\n        case $command in\n          ",
      parents.empty() ? "''" : absl::StrJoin(parents, "|"),
      ") ;;\n          *) open=; break ;;\n        esac ;;\n    esac\n  done\n",
      "  case $command in\n    '') words='", absl::StrJoin(names, " "), " ",
      absl::StrJoin(OptionsOf(app), " "), "' ;;\n", cases, "  esac\n",
      "  # Something other than an option has come: it was the map.\n",
      "  for ((++i; i < COMP_CWORD; ++i)); do\n    case ${COMP_WORDS[i]} in\n      --coordinator) _", program,
      "_coordinator ;;\n", values, "      -*) ;;\n      *) map= ;;\n    esac\n  done\n  COMPREPLY=()\n",
      "  if [[ -n $map && $word != -* ]]; then\n",
      "    words=$(timeout 2 \"${COMP_WORDS[0]}\" maps --names ${at:+--coordinator \"$at\"} 2>/dev/null)\n",
      "    open=yes\n  fi\n  if [[ -n $open || $word == -* ]]; then\n",
      "    COMPREPLY=($(compgen -W \"$words\" -- \"$word\"))\n  fi\n}\n", "complete -o default -F _", program,
      " ", program, "\n");
}

std::string ZshCompletion(const CLI::App& app) {
  const std::string& program = app.get_name();
  const auto described = [](const CLI::App& parent) {
    std::string names;
    for (const CLI::App* command : CommandsOf(parent)) {
      absl::StrAppend(&names, "    '", command->get_name(), ":", ZshText(command->get_description()), "'\n");
    }
    return names;
  };
  const auto arguments = [&](const CLI::App& command) {
    return absl::StrCat(
        "      _arguments \\\n", ZshOptions(command, "        "), ZshOptions(app, "        ", true),
        BeginsWithMap(command) ? absl::StrCat("        '1:map:_", program, "_maps' \\\n") : "",
        "        '*:argument:_files'\n");
  };
  std::string cases;
  for (const CLI::App* command : CommandsOf(app)) {
    absl::StrAppend(&cases, "    ", command->get_name(), ")\n");
    if (CommandsOf(*command).empty()) {
      absl::StrAppend(&cases, arguments(*command), "      ;;\n");
      continue;
    }
    absl::StrAppend(
        &cases, "      commands=(\n", described(*command), "      )\n      _arguments -C \\\n",
        ZshOptions(*command, "        "), ZshOptions(app, "        ", true),
        "        '1:command:->command' \\\n        '*::argument:->argument'\n",
        "      if [[ $state == command ]]; then\n        _describe command commands\n        return\n",
        "      fi\n      case $line[1] in\n");
    for (const CLI::App* sub : CommandsOf(*command))
      absl::StrAppend(&cases, "      ", sub->get_name(), ")\n", arguments(*sub), "      ;;\n");
    absl::StrAppend(&cases, "      esac\n      ;;\n");
  }
  return absl::StrCat(
      "#compdef ", program, "\n# zsh completion for ", program, ": eval \"$(", program,
      " completion zsh)\"\n", "_", program, "_maps() {\n  local -a maps\n",
      "  maps=(${(f)\"$(timeout 2 $program maps --names $at 2>/dev/null)\"})\n  compadd -a maps\n}\n", "_",
      program, "() {\n  local program=$words[1] i\n  local -a at commands\n",
      "  i=${words[(i)--coordinator]}\n  (( i < $#words )) && at=(--coordinator $words[i+1])\n",
      "  commands=(\n", described(app),
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

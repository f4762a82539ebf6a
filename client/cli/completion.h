// SPDX-License-Identifier: GPL-3.0-or-later
// Completion scripts for shells, made from the command line's own description.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace ndmap::cli {

// Complete subcommands, and options after a dash; files otherwise.
std::string BashCompletion(const CLI::App& app);
std::string ZshCompletion(const CLI::App& app);

}  // namespace ndmap::cli

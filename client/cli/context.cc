// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/context.h"

#include <cstdio>

#include "absl/strings/str_cat.h"

namespace ndmap::cli {

void Context::Print(const Json& object, const std::string& text) const {
  const std::string out = json ? object.dump(1) + "\n" : text;
  std::fwrite(out.data(), 1, out.size(), stdout);
  std::fflush(stdout);
}

absl::StatusOr<Client> Context::Connect() const {
  if (coordinator.empty()) {
    return absl::InvalidArgumentError(
        "no coordinator: give --coordinator HOST:PORT or set NDMAP_COORDINATOR (ndmap up starts one)");
  }
  return Client::Connect(coordinator);
}

absl::StatusOr<MapHandle> Context::OpenMap(const std::string& name) const {
  absl::StatusOr<Client> client = Connect();
  if (!client.ok()) return client.status();
  return client->OpenMap(name);
}

CLI::App* AddCommand(CLI::App& app, const std::string& name, const std::string& what,
                     const std::string& example) {
  CLI::App* command = app.add_subcommand(name, what);
  command->footer(absl::StrCat(
      "--json and --coordinator HOST:PORT may stand anywhere (ndmap --help).\nExample: ", example));
  command->fallthrough();
  return command;
}

}  // namespace ndmap::cli

// SPDX-License-Identifier: Apache-2.0
#include "workbench/command_line/command_line.hpp"

#include "workbench/live/daemon_client.hpp"

namespace loopwarden::workbench {

void add_socket_option(CLI::App& sub, std::string& socket) {
  socket = DaemonClient::kDefaultSocket;
  sub.add_option("--socket", socket, "the daemon's control socket")
      ->envname("LOOPWARDEN_SOCKET")
      ->capture_default_str();
}

CLI::Option* add_json_flag(CLI::App& sub, bool& json) {
  return sub.add_flag("--json", json, "print the result as JSON");
}

void refuse_negative_counts(CLI::App& app) {
  for (CLI::App* sub : app.get_subcommands([](CLI::App*) { return true; })) {
    refuse_negative_counts(*sub);
    for (CLI::Option* option : sub->get_options()) {
      if (!option->get_type_name().starts_with("UINT")) continue;
      option->check([](const std::string& value) {
        return value.starts_with('-') ? "must not be negative (got " + value + ")" : std::string();
      });
    }
  }
}

}  // namespace loopwarden::workbench

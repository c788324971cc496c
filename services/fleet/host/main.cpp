// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <csignal>
#include <utility>

#include "config/command_line/service.hpp"
#include "config/diagnostic.hpp"
#include "services/fleet/host/fleet_host.hpp"
#include "services/fleet/host/host_config.hpp"
#include "base/exit_code.hpp"
#include "base/signals.hpp"
#include "base/standard_streams.hpp"

namespace {

using namespace loopwarden;

constexpr const char* kFooter =
    "Exit codes: 0 done, 64 usage, 74 I/O, 78 bad configuration.\n"
    "Example: loopwarden-fleet --broker mqtt://localhost --database postgresql:///loopwarden "
    "--groups North,South";

int run(const fleet::CommandLine& command_line, bool check) {
  auto loaded = fleet::read_host_config(command_line);
  fmt::print(stderr, "{}", config::to_text(loaded.diagnostics));
  if (!loaded) return kExitConfiguration;
  if (check) {
    fmt::print(
        "broker {}, {}, no errors\n", to_text(*loaded->broker),
        loaded->groups.empty() ? "all groups" : fmt::format("{} groups", loaded->groups.size()));
    return kExitOk;
  }
  base::block_signals({SIGTERM, SIGINT});
  config::log_to_stderr("loopwarden-fleet", loaded->log_level);
  return fleet::FleetHost(std::move(*loaded)).run();
}

int run_command_line(int argc, char** argv) {
  CLI::App cli("loopwarden-fleet - Sparkplug B host: a plant's boxes into PostgreSQL",
               "loopwarden-fleet");
  fleet::CommandLine command_line;
  bool check = false;
  cli.add_option("--broker", command_line.broker, "mqtt://HOST[:PORT] or mqtts://HOST[:PORT]");
  cli.add_option("--database", command_line.database, "postgresql://[USER@]HOST[:PORT]/NAME");
  cli.add_option("--groups", command_line.groups,
                 "groups to serve, A,B,...; default: all, served as one")
      ->delimiter(',');
  cli.add_option("--config", command_line.config_file,
                 "fleet.yaml: the same, TLS, passwords, retention");
  cli.add_flag("--check", check, "validate the configuration and exit");
  cli.set_version_flag("--version,-V", LOOPWARDEN_VERSION);
  cli.footer(kFooter);
  return config::run_service(cli, {argv + 1, argv + argc},
                             [&] { return run(command_line, check); });
}

}  // namespace

int main(int argc, char** argv) {
  base::StandardStreams streams;
  return streams.finish(run_command_line(argc, argv));
}

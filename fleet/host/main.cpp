// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <csignal>
#include <exception>
#include <string>
#include <vector>

#include "config/diagnostic.hpp"
#include "fleet/host/fleet_host.hpp"
#include "fleet/host/host_config.hpp"
#include "hal/os/exit_code.hpp"
#include "hal/os/standard_streams.hpp"

namespace {

using loopwarden::kExitConfiguration;
using loopwarden::kExitIo;
using loopwarden::kExitOk;
using loopwarden::kExitUsage;
namespace fleet = loopwarden::fleet;

constexpr const char* kFooter =
    "Exit codes: 0 done, 64 usage, 74 I/O, 78 bad configuration.\n"
    "Example: loopwarden-fleet --broker mqtt://localhost --database postgresql:///loopwarden "
    "--groups North,South";

void block_signals() {
  sigset_t set;
  sigemptyset(&set);
  for (const int s : {SIGTERM, SIGINT}) sigaddset(&set, s);
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
}

void open_log(const std::string& level) {
  spdlog::set_default_logger(spdlog::stderr_logger_mt("loopwarden-fleet"));
  spdlog::set_level(spdlog::level::from_str(level));
  spdlog::set_pattern("%Y-%m-%dT%H:%M:%S.%eZ %l %v", spdlog::pattern_time_type::utc);
}

int run(const fleet::CommandLine& command_line, bool check) {
  auto config = fleet::read_host_config(command_line);
  fmt::print(stderr, "{}", loopwarden::config::to_text(config.diagnostics));
  if (!config) return kExitConfiguration;
  if (check) {
    fmt::print(
        "broker {}, {}, no errors\n", to_text(*config->broker),
        config->groups.empty() ? "all groups" : fmt::format("{} groups", config->groups.size()));
    return kExitOk;
  }
  block_signals();
  open_log(config->log_level);
  return fleet::FleetHost(std::move(*config)).run();
}

// "; did you mean '--check'?" for the first word that no option answers to.
std::string hint(const CLI::App& cli, const std::vector<std::string>& words) {
  std::vector<std::string> known;
  for (const CLI::Option* option : cli.get_options()) {
    for (const std::string& name : option->get_lnames()) known.push_back("--" + name);
  }
  for (const std::string& word : words) {
    const std::string name = word.substr(0, word.find('='));
    if (!name.starts_with("--") || cli.get_option_no_throw(name) != nullptr) continue;
    return fmt::format("loopwarden-fleet: unknown option '{}'{}\n",
                       loopwarden::config::quotable(name),
                       loopwarden::config::suggestion(name, known));
  }
  return {};
}

int run_command_line(int argc, char** argv) {
  CLI::App cli("loopwarden-fleet - Sparkplug B host: a plant's boxes into PostgreSQL",
               "loopwarden-fleet");
  fleet::CommandLine command_line;
  bool check = false;
  cli.add_option("--broker", command_line.broker, "mqtt://HOST[:PORT] or mqtts://HOST[:PORT]");
  cli.add_option("--database", command_line.database, "postgresql://[USER@]HOST[:PORT]/NAME");
  cli.add_option("--groups", command_line.groups, "groups to serve, A,B,...; without: all, as one")
      ->delimiter(',');
  cli.add_option("--config", command_line.config_file,
                 "fleet.yaml: the same, TLS, passwords, retention");
  cli.add_flag("--check", check, "validate the configuration and exit");
  cli.set_version_flag("--version,-V", LOOPWARDEN_VERSION);
  cli.footer(kFooter);
  const std::string unknown = hint(cli, {argv + 1, argv + argc});
  if (!unknown.empty()) {
    fmt::print(stderr, "{}", unknown);
    return kExitUsage;
  }
  try {
    cli.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return cli.exit(e) == 0 ? kExitOk : kExitUsage;
  }
  try {
    return run(command_line, check);
  } catch (const std::exception& e) {
    fmt::print(stderr, "loopwarden-fleet: {}\n", e.what());
    return kExitIo;
  }
}

}  // namespace

int main(int argc, char** argv) {
  loopwarden::hal::os::StandardStreams streams;
  return streams.finish(run_command_line(argc, argv));
}

// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <csignal>
#include <fmt/format.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <exception>
#include <string>

#include "config/config_reader.hpp"
#include "daemon/app.hpp"
#include "daemon/specialists.hpp"

namespace {

constexpr int kExitOk = 0;
constexpr int kExitUsage = 64;
constexpr int kExitIo = 74;
constexpr int kExitConfiguration = 78;

constexpr const char* kFooter =
    "Exit codes: 0 done, 64 usage, 74 I/O, 78 bad configuration.\n"
    "Signals: SIGTERM and SIGINT send every output to its stop action and end; SIGHUP reads the\n"
    "configuration again and keeps running on the old one if the new has errors.\n"
    "Example: loopwardend --config /etc/loopwardend --check";

// Signals are taken by the main thread alone, at a place of its choosing.
void block_signals() {
  sigset_t set;
  sigemptyset(&set);
  for (const int s : {SIGTERM, SIGINT, SIGHUP}) sigaddset(&set, s);
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);  // a file-size limit is a full disk, not an end
}

void open_log(const std::string& level) {
  spdlog::set_default_logger(spdlog::stderr_logger_mt("loopwardend"));
  spdlog::set_level(spdlog::level::from_str(level));
  spdlog::set_pattern("%Y-%m-%dT%H:%M:%S.%eZ %l %v", spdlog::pattern_time_type::utc);
}

int run(const std::string& directory, bool check, bool safe) {
  namespace config = loopwarden::config;
  auto configuration = config::read_configuration(directory);
  fmt::print(stderr, "{}", config::to_text(configuration.diagnostics));
  if (!configuration) return kExitConfiguration;
  if (safe) {
    open_log(configuration->daemon.log_level);
    return loopwarden::daemon::drive_to_stop_actions(*configuration);
  }
  auto specialists = loopwarden::daemon::load_specialists(*configuration);
  fmt::print(stderr, "{}", config::to_text(specialists.diagnostics));
  if (!specialists) return kExitConfiguration;
  if (check) {
    fmt::print("{}: {} loop{}, no errors\n", directory, configuration->loops.size(),
               configuration->loops.size() == 1 ? "" : "s");
    return kExitOk;
  }
  open_log(configuration->daemon.log_level);
  return loopwarden::daemon::App(std::move(*configuration), directory, *specialists).run();
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App cli("loopwardend - runs flow loops and watches their control valves", "loopwardend");
  std::string directory;
  bool check = false;
  bool safe = false;
  cli.add_option("--config", directory, "folder with loopwardend.yaml and loops.d/*.yaml")
      ->required();
  auto* check_flag = cli.add_flag("--check", check, "validate the configuration and exit");
  cli.add_flag("--safe", safe, "send every output to its stop action once and exit")
      ->excludes(check_flag);
  cli.set_version_flag("--version", LOOPWARDEN_VERSION);
  cli.footer(kFooter);
  try {
    cli.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return cli.exit(e) == 0 ? kExitOk : kExitUsage;
  }
  block_signals();
  try {
    return run(directory, check, safe);
  } catch (const std::exception& e) {
    fmt::print(stderr, "loopwardend: {}\n", e.what());
    return kExitIo;
  }
}

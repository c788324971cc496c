// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <csignal>
#include <fmt/format.h>
#include <malloc.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <memory>
#include <random>
#include <string>
#include <utility>

#include "config/command_line/service.hpp"
#include "config/validation/validation.hpp"
#include "daemon/app/lifecycle.hpp"
#include "daemon/app/log_queue.hpp"
#include "daemon/app/restart_pause.hpp"
#include "daemon/app/stop_actions.hpp"
#include "daemon/app/watchdog.hpp"
#include "daemon/probe/probe.hpp"
#include "base/exit_code.hpp"
#include "base/signals.hpp"
#include "base/standard_streams.hpp"
#include "daemon/registers/register_map.hpp"

namespace {

using loopwarden::kExitConfiguration;
using loopwarden::kExitOk;

constexpr const char* kFooter =
    "Exit codes: 0 done, 64 usage, 74 I/O, 78 bad configuration.\n"
    "A loop whose own files have errors stays out of service with an alarm; the others run.\n"
    "Signals: SIGTERM and SIGINT send every output to its stop action and end; SIGHUP reads the\n"
    "configuration again and keeps running on the old one if the new has errors.\n"
    "Example: loopwardend --config /etc/loopwardend --check";

std::shared_ptr<loopwarden::daemon::LogQueue> open_log(const std::string& level) {
  auto queue = std::make_shared<loopwarden::daemon::LogQueue>(STDERR_FILENO);
  spdlog::set_default_logger(std::make_shared<spdlog::logger>("loopwardend", queue));
  // Errors inside spdlog, such as lack of memory, would otherwise bypass the queue.
  spdlog::set_error_handler([](const std::string&) {});
  spdlog::set_level(spdlog::level::from_str(level));
  spdlog::set_formatter(loopwarden::config::log_formatter());
  return queue;
}

// Waits before the loops start after repeated failures. Returns false if a signal ends the wait.
bool wait_before_start(const loopwarden::daemon::RestartPause& starts) {
  std::random_device random;
  const double chance = std::uniform_real_distribution<double>()(random);
  const auto pause =
      starts.count_start(std::chrono::steady_clock::now().time_since_epoch(), chance);
  if (pause.count() == 0) return true;
  spdlog::warn("starts in {:.0f} s, after repeated failures; the outputs have their stop actions",
               static_cast<double>(pause.count()) / 1000.0);
  return loopwarden::base::wait_for_signal({SIGTERM, SIGINT}, pause) == 0;
}

// Runs the loops until a signal. The program ends also if a disk or the log's reader hangs then.
int run_loops(loopwarden::config::Configuration configuration, const std::string& directory,
              const loopwarden::config::Specialists& specialists) {
  const auto log = open_log(configuration.daemon.log_level);
  const loopwarden::daemon::RestartPause starts(
      std::filesystem::path(configuration.daemon.runtime_directory) / "starts");
  if (loopwarden::daemon::has_service_manager() && !wait_before_start(starts)) return kExitOk;
  auto app = std::make_unique<loopwarden::daemon::App>(std::move(configuration), directory,
                                                       specialists, [log] { return log->lost(); });
  const int exit_code = app->run();
  const bool ended = app->ended();
  if (ended) {
    app.reset();
    starts.forget();
  }
  // Hanging threads still use objects that the destructors would free.
  if (!log->stop_for(std::chrono::seconds(2)) || !ended) ::_exit(exit_code);
  return exit_code;
}

int say_sound(const std::string& directory,
              const loopwarden::config::Configuration& configuration) {
  const std::size_t loops = configuration.loops.size();
  fmt::print("{}: {} loop{}, no errors\n", directory, loops, loops == 1 ? "" : "s");
  constexpr std::size_t kMost = loopwarden::registers::kMostLoops;
  if (loops > kMost) {
    fmt::print("{} of them, from {} on, have no block in the register map\n", loops - kMost,
               configuration.loops[kMost].name);
  }
  return kExitOk;
}

int run(const std::string& directory, bool check, bool safe) {
  namespace config = loopwarden::config;
  // Only the main thread takes these signals, at a place of its choice.
  loopwarden::base::block_signals({SIGTERM, SIGINT, SIGHUP});
  auto [reading, specialists] = config::validate(directory);
  fmt::print(stderr, "{}", config::to_text(reading.diagnostics));
  if (safe) {
    if (reading.outputs.empty() && !reading.sound) return kExitConfiguration;
    const auto log = open_log(reading.configuration.daemon.log_level);
    return loopwarden::daemon::drive_to_stop_actions(reading.outputs);
  }
  if (check)
    return reading.sound ? say_sound(directory, reading.configuration) : kExitConfiguration;
  if (!reading.runnable) return kExitConfiguration;
  config::Configuration configuration = std::move(reading.configuration);
  // The daemon runs for years with the memory that it has from here on.
  reading = {};
  ::malloc_trim(0);
  return run_loops(std::move(configuration), directory, specialists);
}

int run_command_line(int argc, char** argv) {
  CLI::App cli("loopwardend - runs flow loops and watches their control valves", "loopwardend");
  std::string directory;
  bool check = false;
  bool safe = false;
  bool probe = false;
  cli.add_option("--config", directory, "folder with loopwardend.yaml and loops.d/*.yaml")
      ->required();
  auto* check_flag = cli.add_flag("--check", check, "validate the configuration and exit");
  cli.add_flag("--safe", safe, "send every output to its stop action once and exit")
      ->excludes(check_flag);
  cli.add_flag(
         "--probe", probe,
         "read registers for `loopwarden setup`, by lines of the standard input; writes to no "
         "device")
      ->excludes(check_flag)
      ->excludes("--safe");
  cli.set_version_flag("--version,-V", LOOPWARDEN_VERSION);
  cli.footer(kFooter);
  return loopwarden::config::run_service(cli, {argv + 1, argv + argc}, [&] {
    if (!probe) return run(directory, check, safe);
    return loopwarden::daemon::probe::serve(directory, STDIN_FILENO, std::chrono::seconds(60));
  });
}

}  // namespace

int main(int argc, char** argv) {
  loopwarden::base::StandardStreams streams;
  return streams.finish(run_command_line(argc, argv));
}

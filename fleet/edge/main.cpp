// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <signal.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>
#include <systemd/sd-daemon.h>

#include <atomic>
#include <csignal>
#include <cstdio>
#include <exception>
#include <string>
#include <utility>

#include "fleet/edge/edge_config.hpp"
#include "fleet/edge/edge_node.hpp"
#include "hal/os/exit_code.hpp"

namespace {

using loopwarden::kExitConfiguration;
using loopwarden::kExitIo;
using loopwarden::kExitOk;
using loopwarden::kExitUsage;
namespace config = loopwarden::config;
namespace edge = loopwarden::edge;

constexpr const char* kFooter =
    "Exit codes: 0 done, 64 usage, 74 I/O, 78 bad configuration.\n"
    "Example: loopwarden-edge --config /etc/loopwarden-edge/edge.yaml --check";

volatile std::sig_atomic_t quit = 0;

void take_signals() {
  struct sigaction action {};
  action.sa_handler = [](int) { quit = 1; };
  for (const int number : {SIGTERM, SIGINT}) sigaction(number, &action, nullptr);
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);  // a file-size limit is a full disk, not an end
}

void open_log(const std::string& level) {
  spdlog::set_default_logger(spdlog::stderr_logger_mt("loopwarden-edge"));
  spdlog::set_level(spdlog::level::from_str(level));
  spdlog::set_pattern("%Y-%m-%dT%H:%M:%S.%eZ %l %v", spdlog::pattern_time_type::utc);
}

int run(const std::string& file, bool check) {
  auto loaded = edge::read_edge_file(file);
  fmt::print(stderr, "{}", config::to_text(loaded.diagnostics));
  if (!loaded) return kExitConfiguration;
  if (check) {
    fmt::print("{}: no errors\n", file);
    return kExitOk;
  }
  open_log(loaded->log_level);
  edge::EdgeNode node(std::move(*loaded));
  node.start();
  sd_notify(0, "READY=1");
  while (quit == 0) {
    node.round();
    sd_notify(0, ("WATCHDOG=1\nSTATUS=" + node.status()).c_str());
  }
  sd_notify(0, "STOPPING=1");
  node.end();
  return kExitOk;
}

int run_command_line(int argc, char** argv) {
  CLI::App cli("loopwarden-edge - the box as a Sparkplug B edge node, each loop a device",
               "loopwarden-edge");
  std::string file;
  bool check = false;
  cli.add_option("--config", file, "edge.yaml")->required();
  cli.add_flag("--check", check, "validate the configuration and exit");
  cli.set_version_flag("--version,-V", LOOPWARDEN_VERSION);
  cli.footer(kFooter);
  try {
    cli.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return cli.exit(e) == 0 ? kExitOk : kExitUsage;
  }
  take_signals();
  try {
    return run(file, check);
  } catch (const std::exception& e) {
    fmt::print(stderr, "loopwarden-edge: {}\n", e.what());
    return kExitIo;
  }
}

}  // namespace

int main(int argc, char** argv) {
  const int exit_code = run_command_line(argc, argv);
  // What was printed and not taken is an error too.
  const bool taken = std::fflush(stdout) == 0 && std::ferror(stdout) == 0;
  return exit_code == kExitOk && !taken ? kExitIo : exit_code;
}

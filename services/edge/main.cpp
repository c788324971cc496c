// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <systemd/sd-daemon.h>

#include <chrono>
#include <csignal>
#include <optional>
#include <string>
#include <utility>

#include "config/command_line/service.hpp"
#include "config/diagnostic.hpp"
#include "services/edge/edge_config.hpp"
#include "services/edge/edge_node.hpp"
#include "base/exit_code.hpp"
#include "base/signals.hpp"
#include "base/standard_streams.hpp"

namespace {

using namespace loopwarden;

constexpr const char* kFooter =
    "Exit codes: 0 done, 64 usage, 74 I/O, 78 bad configuration.\n"
    "Example: loopwarden-edge --config /etc/loopwarden-edge/edge.yaml --check";

bool end_asked() {
  return base::wait_for_signal({SIGTERM, SIGINT}, std::chrono::milliseconds(0)) != 0;
}

int run(const std::string& file, bool check) {
  auto loaded = edge::read_edge_file(file);
  fmt::print(stderr, "{}", config::to_text(loaded.diagnostics));
  if (!loaded) return kExitConfiguration;
  if (check) {
    fmt::print("{}: no errors\n", file);
    return kExitOk;
  }
  base::block_signals({SIGTERM, SIGINT});
  config::log_to_stderr("loopwarden-edge", loaded->log_level);
  std::optional<edge::EdgeNode> opened;
  try {
    opened.emplace(std::move(*loaded));
  } catch (const sqlite::Error& e) {
    if (!e.other_version()) throw;
    spdlog::error("{}", e.what());
    return kExitConfiguration;
  }
  edge::EdgeNode& node = *opened;
  node.start();
  sd_notify(0, "READY=1");
  while (!end_asked()) {
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
  return config::run_service(cli, {argv + 1, argv + argc}, [&] { return run(file, check); });
}

}  // namespace

int main(int argc, char** argv) {
  base::StandardStreams streams;
  return streams.finish(run_command_line(argc, argv));
}

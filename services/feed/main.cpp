// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <systemd/sd-daemon.h>

#include <chrono>
#include <csignal>
#include <string>
#include <utility>

#include "base/exit_code.hpp"
#include "base/signals.hpp"
#include "base/standard_streams.hpp"
#include "config/command_line/service.hpp"
#include "config/diagnostic.hpp"
#include "services/feed/browse.hpp"
#include "services/feed/feed_config.hpp"
#include "services/feed/feeder.hpp"

namespace {

using namespace loopwarden;

constexpr const char* kFooter =
    "Exit codes: 0 done, 64 usage, 74 I/O, 78 bad configuration.\n"
    "Example: loopwarden-feed --config /etc/loopwarden-feed/feed.yaml --check";
constexpr std::chrono::seconds kBetweenReports{5};  // to systemd

bool end_asked() {
  return base::wait_for_signal({SIGTERM, SIGINT}, std::chrono::milliseconds(0)) != 0;
}

struct Options {
  std::string file;
  bool check = false;
  std::string browse;  // group
  int seconds = 60;
};

int run(const Options& options) {
  const std::string& file = options.file;
  auto loaded = feed::read_feed_file(
      file, options.browse.empty() ? feed::Values::needed : feed::Values::not_needed);
  fmt::print(stderr, "{}", config::to_text(loaded.diagnostics));
  if (!loaded) return kExitConfiguration;
  if (options.check) {
    fmt::print("{}: no errors\n", file);
    return kExitOk;
  }
  if (!options.browse.empty()) {
    return feed::browse(std::move(*loaded), options.browse, std::chrono::seconds(options.seconds));
  }
  base::block_signals({SIGTERM, SIGINT});
  config::log_to_stderr("loopwarden-feed", loaded->log_level);
  feed::Feeder feeder(std::move(*loaded));
  feeder.start();
  sd_notify(0, "READY=1");
  std::chrono::steady_clock::time_point report_again{};
  while (!end_asked()) {
    feeder.round();
    if (std::chrono::steady_clock::now() < report_again) continue;
    report_again = std::chrono::steady_clock::now() + kBetweenReports;
    sd_notify(0, ("WATCHDOG=1\nSTATUS=" + feeder.status()).c_str());
  }
  sd_notify(0, "STOPPING=1");
  feeder.end();
  spdlog::info("ended: {}", feeder.status());
  return kExitOk;
}

int run_command_line(int argc, char** argv) {
  CLI::App cli("loopwarden-feed - values of MQTT and Sparkplug B for loops that are watched",
               "loopwarden-feed");
  Options options;
  cli.add_option("--config", options.file, "feed.yaml")->required();
  cli.add_flag("--check", options.check, "validate the configuration and exit");
  CLI::Option* group = cli.add_option(
      "--browse", options.browse,
      "print the names in the births of this Sparkplug group's edge nodes, as CSV, and exit");
  cli.add_option("--seconds", options.seconds, "time to listen, s; default 60")
      ->needs(group)
      ->check(CLI::Range(1, 3600));
  cli.set_version_flag("--version,-V", LOOPWARDEN_VERSION);
  cli.footer(kFooter);
  return config::run_service(cli, {argv + 1, argv + argc}, [&] { return run(options); });
}

}  // namespace

int main(int argc, char** argv) {
  base::StandardStreams streams;
  return streams.finish(run_command_line(argc, argv));
}

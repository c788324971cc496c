// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <csignal>
#include <string>
#include <utility>

#include "config/command_line/service.hpp"
#include "config/diagnostic.hpp"
#include "services/notify/app/commands.hpp"
#include "base/exit_code.hpp"
#include "base/signals.hpp"
#include "base/standard_streams.hpp"

namespace {

using namespace loopwarden;

constexpr const char* kFooter =
    "Exit codes: 0 done, 64 usage, 74 I/O (also: a test did not go out), 78 bad configuration.\n"
    "Examples:\n"
    "  loopwarden-notify --config /etc/loopwarden-notify/notify.yaml --check\n"
    "  loopwarden-notify --config /etc/loopwarden-notify/notify.yaml --test mail\n"
    "  loopwarden-notify --config /etc/loopwarden-notify/notify.yaml --list 20";

constexpr std::size_t kListed = 50;

struct Options {
  std::string config;
  bool check = false;
  std::string only;  // the channel to test
  bool test = false;
  std::size_t most = 0;  // notifications to list; 0: not given
  bool list = false;
  bool json = false;
};

int run(const Options& options) {
  auto loaded = notify::read_notify_file(options.config);
  fmt::print(stderr, "{}", config::to_text(loaded.diagnostics));
  if (!loaded) return kExitConfiguration;
  if (options.check) {
    fmt::print("{}: {} channel{}, {} route{}, no errors\n", options.config, loaded->channels.size(),
               loaded->channels.size() == 1 ? "" : "s", loaded->rules.routes.size(),
               loaded->rules.routes.size() == 1 ? "" : "s");
    return kExitOk;
  }
  if (options.list) {
    const std::size_t most = options.most == 0 ? kListed : options.most;
    return notify::list_notifications(*loaded, most, options.json);
  }
  if (options.test) return notify::test_channels(*loaded, options.only);
  base::block_signals({SIGTERM, SIGINT});
  config::log_to_stderr("loopwarden-notify", loaded->log_level);
  return notify::watch(std::move(*loaded));
}

// The value of --test or --list is optional, and must not be taken for another option's value.
void add_options(CLI::App& cli, Options& options, CLI::Option*& test, CLI::Option*& list) {
  cli.add_option("--config", options.config, "the configuration, notify.yaml")->required();
  auto* check = cli.add_flag("--check", options.check, "validate the configuration and exit");
  test = cli.add_option("--test", options.only,
                        "send a test message through each channel, or this one, and exit")
             ->expected(0, 1)
             ->type_name("[CHANNEL]")
             ->excludes(check);
  list = cli.add_option("--list", options.most, "print the newest notifications (50) and exit")
             ->expected(0, 1)
             ->type_name("[N]")
             ->check(CLI::Range(1, 20'000))
             ->excludes(check)
             ->excludes(test);
  cli.add_flag("--json", options.json, "with --list: one JSON object a line")->needs(list);
}

int run_command_line(int argc, char** argv) {
  CLI::App cli("loopwarden-notify - reports alarms to people and programs", "loopwarden-notify");
  Options options;
  CLI::Option* test = nullptr;
  CLI::Option* list = nullptr;
  add_options(cli, options, test, list);
  cli.set_version_flag("--version,-V", LOOPWARDEN_VERSION);
  cli.footer(kFooter);
  return config::run_service(cli, {argv + 1, argv + argc}, [&] {
    options.test = test->count() > 0;
    options.list = list->count() > 0;
    return run(options);
  });
}

}  // namespace

int main(int argc, char** argv) {
  base::StandardStreams streams;
  return streams.finish(run_command_line(argc, argv));
}

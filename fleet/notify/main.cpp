// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <curl/curl.h>
#include <fmt/format.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <csignal>
#include <exception>
#include <string>
#include <vector>

#include "config/diagnostic.hpp"
#include "fleet/notify/app/commands.hpp"
#include "hal/os/exit_code.hpp"
#include "hal/os/standard_streams.hpp"

namespace {

using loopwarden::kExitConfiguration;
using loopwarden::kExitIo;
using loopwarden::kExitOk;
using loopwarden::kExitUsage;
namespace notify = loopwarden::notify;

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
  std::size_t most = 0;  // notifications to list; 0: none given
  bool list = false;
  bool json = false;
};

void block_signals() {
  sigset_t set;
  sigemptyset(&set);
  for (const int s : {SIGTERM, SIGINT}) sigaddset(&set, s);
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
}

void open_log(const std::string& level) {
  spdlog::set_default_logger(spdlog::stderr_logger_mt("loopwarden-notify"));
  spdlog::set_level(spdlog::level::from_str(level));
  spdlog::set_pattern("%Y-%m-%dT%H:%M:%S.%eZ %l %v", spdlog::pattern_time_type::utc);
}

int run(const Options& options) {
  auto config = notify::read_notify_file(options.config);
  fmt::print(stderr, "{}", loopwarden::config::to_text(config.diagnostics));
  if (!config) return kExitConfiguration;
  if (options.check) {
    fmt::print("{}: {} channel{}, {} route{}, no errors\n", options.config, config->channels.size(),
               config->channels.size() == 1 ? "" : "s", config->rules.routes.size(),
               config->rules.routes.size() == 1 ? "" : "s");
    return kExitOk;
  }
  if (options.list) {
    const std::size_t most = options.most == 0 ? kListed : options.most;
    return notify::list_notifications(*config, most, options.json);
  }
  if (options.test) return notify::test_channels(*config, options.only);
  block_signals();
  open_log(config->log_level);
  return notify::watch(std::move(*config));
}

// What stands at --test or --list, or nothing, may not be taken for another option's value.
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

// "; did you mean '--check'?" for the first word that no option answers to.
std::string hint(const CLI::App& cli, const std::vector<std::string>& words) {
  std::vector<std::string> known;
  for (const CLI::Option* option : cli.get_options()) {
    for (const std::string& name : option->get_lnames()) known.push_back("--" + name);
  }
  for (const std::string& word : words) {
    const std::string name = word.substr(0, word.find('='));
    if (!name.starts_with("--") || cli.get_option_no_throw(name) != nullptr) continue;
    return fmt::format("loopwarden-notify: unknown option '{}'{}\n",
                       loopwarden::config::quotable(name),
                       loopwarden::config::suggestion(name, known));
  }
  return {};
}

int run_command_line(int argc, char** argv) {
  CLI::App cli("loopwarden-notify - tells people and programs of alarms", "loopwarden-notify");
  Options options;
  CLI::Option* test = nullptr;
  CLI::Option* list = nullptr;
  add_options(cli, options, test, list);
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
  options.test = test->count() > 0;
  options.list = list->count() > 0;
  try {
    return run(options);
  } catch (const std::exception& e) {
    fmt::print(stderr, "loopwarden-notify: {}\n", e.what());
    return kExitIo;
  }
}

}  // namespace

int main(int argc, char** argv) {
  loopwarden::hal::os::StandardStreams streams;
  curl_global_init(CURL_GLOBAL_DEFAULT);
  const int exit_code = run_command_line(argc, argv);
  curl_global_cleanup();
  return streams.finish(exit_code);
}

// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <string>

#include "config/command_line/service.hpp"
#include "config/diagnostic.hpp"
#include "base/exit_code.hpp"
#include "base/standard_streams.hpp"
#include "services/page/app/app.hpp"
#include "services/page/app/ldap_command.hpp"
#include "services/page/app/user_commands.hpp"
#include "services/page/settings/page_settings.hpp"

namespace loopwarden::page {
namespace {

constexpr const char* kFooter =
    "Without --config: http://127.0.0.1:8480/, for this host only, read-only.\n"
    "Signals: SIGTERM and SIGINT end it, SIGHUP reads certificate and key again.\n"
    "Exit codes: 0 done, 64 usage, 65 ldap-test: not let in, 74 I/O, 78 bad configuration.";

struct Options {
  std::string config;
  std::string runtime;
  std::string state;
  std::string site;
  int port = 0;
  bool check = false;
};

int run(const Options& options) {
  config::Loaded<PageSettings> settings =
      options.config.empty() ? read_page_text("(defaults)", "{}") : read_page_file(options.config);
  fmt::print(stderr, "{}", config::to_text(settings.diagnostics));
  if (!settings) return kExitConfiguration;
  if (!options.runtime.empty()) {
    settings->status_socket = std::filesystem::path(options.runtime) / "status.sock";
    settings->page_socket = std::filesystem::path(options.runtime) / "page.sock";
  }
  if (!options.state.empty()) settings->state_directory = options.state;
  if (options.port != 0) settings->listen.front().port = static_cast<std::uint16_t>(options.port);
  if (options.check) {
    check_files(*settings);
    fmt::print("{}: no errors\n", options.config.empty() ? "defaults" : options.config);
    return kExitOk;
  }
  config::log_to_stderr("loopwarden-page", "info");
  return serve(*settings, options.site);
}

void add_options(CLI::App& app, Options& options) {
  app.add_option("--config", options.config, "page.yaml");
  app.add_flag("--check", options.check, "validate page.yaml and exit");
  app.add_option("--runtime", options.runtime,
                 "folder of the daemon's sockets, in place of page.yaml's");
  app.add_option("--state", options.state, "the daemon's state directory, in place of page.yaml's");
  app.add_option("--port", options.port, "in place of the first of page.yaml's")
      ->check(CLI::Range(1, 65535));
  app.add_option("--site", options.site,
                 "folder with the site, in place of the built-in one, for work on it");
}

int run_command_line(int argc, char** argv) {
  CLI::App app("loopwarden-page - what the operator sees of loopwardend, in a browser",
               "loopwarden-page");
  Options options;
  int exit_code = kExitOk;
  add_options(app, options);
  add_user_commands(app, exit_code);
  add_certificate_command(app, exit_code);
  add_ldap_command(app, exit_code);
  app.set_version_flag("--version,-V", LOOPWARDEN_VERSION);
  app.footer(kFooter);
  return config::run_service(app, config::in_options({argv + 1, argv + argc}), [&]() -> int {
    if (!app.get_subcommands().empty()) return exit_code;
    try {
      return run(options);
    } catch (const BadConfiguration& e) {
      fmt::print(stderr, "loopwarden-page: {}\n", e.what());
      return kExitConfiguration;
    }
  });
}

}  // namespace
}  // namespace loopwarden::page

int main(int argc, char** argv) {
  loopwarden::base::StandardStreams streams;
  return streams.finish(loopwarden::page::run_command_line(argc, argv));
}

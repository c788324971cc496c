// SPDX-License-Identifier: Apache-2.0
#include "services/page/app/ldap_command.hpp"

#include <fmt/format.h>

#include <cstdio>
#include <exception>
#include <iostream>
#include <memory>
#include <optional>
#include <string>

#include "config/diagnostic.hpp"
#include "base/exit_code.hpp"
#include "services/page/app/ask_unseen.hpp"
#include "services/page/ldap/ldap_server.hpp"
#include "services/page/ldap/ldap_text.hpp"
#include "services/page/settings/page_settings.hpp"
#include "services/page/users/user_file.hpp"

namespace loopwarden::page {
namespace {

struct TestOptions {
  std::string config = "/etc/loopwarden-page/page.yaml";
  std::string name;
  bool from_stdin = false;
};

int refuse(int exit_code, const std::string& what) {
  fmt::print(stderr, "loopwarden-page: {}\n", what);
  return exit_code;
}

std::string password_of(const TestOptions& options) {
  if (!options.from_stdin) return ask_unseen("Password: ");
  std::string password;
  std::getline(std::cin, password);
  return password;
}

// Warns if the users file has the name too: the page then lets the user in without the directory.
void warn_of_local(const PageSettings& settings, const std::string& name) {
  UserDirectory users(settings.users);
  users.refresh();
  if (users.is_in_file(name)) {
    fmt::print(stderr, "loopwarden-page: {}: has '{}' as well, which wins: the page won't ask\n",
               settings.users.string(), name);
  }
}

int test_log_in(const TestOptions& options) {
  const config::Loaded<PageSettings> settings = read_page_file(options.config);
  fmt::print(stderr, "{}", config::to_text(settings.diagnostics));
  if (!settings) return kExitConfiguration;
  if (!settings->ldap) return refuse(kExitConfiguration, options.config + ": has no section ldap");
  try {
    ldap::check_files(*settings->ldap);
  } catch (const std::exception& e) {
    return refuse(kExitConfiguration, e.what());
  }
  const std::optional<std::string> name = ldap::account_name(options.name, settings->ldap->domains);
  if (!name) {
    return refuse(
        kExitData,
        fmt::format("'{}' is no name that is asked for: 1 to 64 of a-z 0-9 . _ -, with one "
                    "of `domains` or none",
                    config::quotable(options.name)));
  }
  warn_of_local(*settings, *name);
  const ldap::Outcome outcome =
      ldap::Server(*settings->ldap)
          .log_in(*name, password_of(options), [](const std::string& step) {
            fmt::print("{}\n", step);
            std::fflush(stdout);  // before the output of the next step on stderr
          });
  if (outcome.end == ldap::Outcome::End::admitted) {
    fmt::print("{} may log in as {}\n", *name, to_text(outcome.role));
    return kExitOk;
  }
  const bool unavailable = outcome.end == ldap::Outcome::End::unavailable;
  return refuse(unavailable ? kExitIo : kExitData, outcome.why);
}

}  // namespace

void add_ldap_command(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<TestOptions>();
  CLI::App* sub = app.add_subcommand(
      "ldap-test",
      "logs a user in by the directory, and reports the step that fails; asks the password");
  sub->add_option("NAME", options->name, "of the user, as typed at the page")->required();
  sub->add_option("--config", options->config, "page.yaml")->capture_default_str();
  sub->add_flag("--stdin", options->from_stdin, "the password is a line of the standard input");
  sub->callback([options, &exit_code] { exit_code = test_log_in(*options); });
}

}  // namespace loopwarden::page

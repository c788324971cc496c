// SPDX-License-Identifier: Apache-2.0
#include "services/page/app/user_commands.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "config/diagnostic.hpp"
#include "base/exit_code.hpp"
#include "services/net/http/tls.hpp"
#include "services/page/app/ask_unseen.hpp"
#include "services/page/settings/page_settings.hpp"
#include "services/page/users/page_account.hpp"
#include "services/page/users/password.hpp"
#include "services/page/users/user_file.hpp"

namespace loopwarden::page {
namespace {

namespace fs = std::filesystem;

constexpr const char* kDefaultUsers = "/etc/loopwarden-page/users";

struct Options {
  std::string file;  // of users; empty: named in page.yaml, or kDefaultUsers
  std::string config = "/etc/loopwarden-page/page.yaml";
  std::string name;
  std::string role = "viewer";
  bool display = false;
  bool from_stdin = false;
};

std::string wanted_password(bool from_stdin) {
  std::string password;
  if (from_stdin) {
    std::getline(std::cin, password);
  } else {
    password = ask_unseen("Password: ");
    if (ask_unseen("Once more: ") != password) throw std::runtime_error("those were two passwords");
  }
  if (password.size() < kShortestPassword || password.size() > kLongestPassword) {
    throw std::runtime_error(
        fmt::format("a password has {} to {} bytes", kShortestPassword, kLongestPassword));
  }
  return password;
}

fs::path file_of(const Options& options) {
  if (!options.file.empty()) return options.file;
  if (fs::exists(options.config)) {
    const auto settings = read_page_file(options.config);
    if (settings && !settings->users.empty()) return settings->users;
  }
  return kDefaultUsers;
}

Users users_in(const fs::path& file) { return fs::exists(file) ? read_users(file) : Users(); }

// Returns the user. Throws std::runtime_error if he is not in the file.
User& known(Users& users, const std::string& name) {
  const auto user = users.find(name);
  if (user != users.end()) return user->second;
  std::vector<std::string> names;
  for (const auto& [other, one] : users) names.push_back(other);
  throw std::runtime_error("there is no user '" + config::quotable(name) + "'" +
                           config::suggestion(name, names));
}

void add_user(const Options& options) {
  const std::optional<Role> role = role_of(options.role);
  if (!role) throw std::runtime_error("a role is viewer, operator or engineer");
  if (options.display && *role != Role::viewer) {
    throw CLI::ValidationError("--display", "a display must be a viewer, because it is unattended");
  }
  if (!is_user_name(options.name)) {
    throw std::runtime_error("a name has 1 to 32 of a-z A-Z 0-9 . _ - and begins with a letter");
  }
  const fs::path file = file_of(options);
  Users users = users_in(file);
  if (users.contains(options.name)) {
    throw std::runtime_error("there is a user '" + options.name + "' already");
  }
  users[options.name] = {*role, hash_password(wanted_password(options.from_stdin)),
                         options.display};
  write_users(users, file);
  fmt::print("{}: {}{} {}\n", file.string(), to_text(*role), options.display ? ", display" : "",
             options.name);
}

void remove_user(const Options& options) {
  const fs::path file = file_of(options);
  Users users = users_in(file);
  known(users, options.name);
  users.erase(options.name);
  write_users(users, file);
}

void change_password(const Options& options) {
  const fs::path file = file_of(options);
  Users users = users_in(file);
  User& user = known(users, options.name);
  user.hash = hash_password(wanted_password(options.from_stdin));
  write_users(users, file);
}

void list_users(const Options& options) {
  for (const auto& [name, user] : users_in(file_of(options))) {
    fmt::print("{:<32} {}{}\n", name, to_text(user.role), user.display ? ", display" : "");
  }
}

void add_file_options(CLI::App* sub, Options& options) {
  sub->add_option("--users", options.file, "the users file; default: the one that page.yaml names");
  sub->add_option("--config", options.config, "page.yaml")->capture_default_str();
}

// A key made by root must be readable for the service, and for no other user.
void give_to_page(const fs::path& key) {
  const auto account = page_account();
  if (::geteuid() != 0 || !account) return;
  if (::chown(key.c_str(), account->user, account->group) != 0) {
    throw std::runtime_error(key.string() + " can't be given to the user loopwarden-page");
  }
}

using Act = void (*)(const Options&);

CLI::App* add_command(CLI::App* user, const char* name, const char* what, int& exit_code, Act act,
                      const std::shared_ptr<Options>& options) {
  CLI::App* sub = user->add_subcommand(name, what);
  add_file_options(sub, *options);
  sub->callback([act, options, &exit_code] {
    act(*options);
    exit_code = kExitOk;
  });
  return sub;
}

}  // namespace

void add_user_commands(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<Options>();
  CLI::App* user = app.add_subcommand("user", "who may log in");
  user->require_subcommand(1);
  const auto named = [&](CLI::App* sub) {
    sub->add_option("NAME", options->name, "of the user")->required();
    return sub;
  };
  const auto asks = [&](CLI::App* sub) {
    sub->add_flag("--stdin", options->from_stdin, "the password is a line of the standard input");
    return sub;
  };
  CLI::App* add = asks(named(add_command(user, "add", "a new user", exit_code, add_user, options)));
  add->add_option(
         "--role", options->role,
         "viewer looks; operator acknowledges, shelves, and sets values if allowed; engineer")
      ->capture_default_str();
  add->add_flag("--display", options->display,
                "a wall display: its sessions don't end for want of a key press; a viewer only");
  named(add_command(user, "remove", "ends the user and his sessions", exit_code, remove_user,
                    options));
  asks(named(add_command(user, "password", "another password; ends the user's sessions", exit_code,
                         change_password, options)));
  add_command(user, "list", "names and roles", exit_code, list_users, options);
}

void add_certificate_command(CLI::App& app, int& exit_code) {
  struct Wish {
    std::vector<std::string> hosts;
    std::string out = "/etc/loopwarden-page";
    int days = 825;
  };
  auto wish = std::make_shared<Wish>();
  CLI::App* sub = app.add_subcommand(
      "certificate", "makes a self-signed certificate, page.crt and page.key (EC P-256)");
  sub->add_option("--host", wish->hosts, "name or address that browsers will use; may be repeated")
      ->required();
  sub->add_option("--out", wish->out, "folder")->capture_default_str();
  sub->add_option("--days", wish->days, "validity, days")
      ->check(CLI::Range(1, 3650))
      ->capture_default_str();
  sub->callback([wish, &exit_code] {
    const auto made = http::make_self_signed(wish->hosts, wish->days);
    const http::TlsFiles files = http::write_self_signed(made, wish->out);
    give_to_page(files.key);
    fmt::print("{}\n{}\n", files.certificate.string(), files.key.string());
    exit_code = kExitOk;
  });
}

}  // namespace loopwarden::page

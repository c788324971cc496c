// SPDX-License-Identifier: Apache-2.0
#include "services/page/ldap/ldap_server.hpp"

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <memory>
#include <stdexcept>
#include <utility>

#include "services/page/ldap/ldap_connection.hpp"
#include "services/page/ldap/ldap_text.hpp"
#include "services/page/users/page_account.hpp"

namespace loopwarden::page::ldap {
namespace {

// Matches every entry, for a search by name.
constexpr const char* kAny = "(objectClass=*)";

Outcome refusal(Outcome::End end, std::string why) {
  return {.end = end, .role = Role::none, .dn = {}, .why = std::move(why)};
}

void check_password_file(const std::filesystem::path& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) return;  // read_secret reports it in more detail
  if ((status.st_mode & 0077U) != 0) {
    throw std::runtime_error(path.string() +
                             ": is open to others than its owner (chmod 600); it holds a password");
  }
  const auto page = page_account();
  if (::geteuid() == 0 && page && status.st_uid != page->user) {
    throw std::runtime_error(
        path.string() + ": the page can't read it (chown loopwarden-page); it holds a password");
  }
}

}  // namespace

Server::Server(LdapSettings settings, std::chrono::milliseconds limit)
    : settings_(std::move(settings)), limit_(limit) {}

Outcome Server::log_in(const std::string& name, const std::string& password, const Tell& tell,
                       Moment until) const {
  if (password.empty()) return refusal(Outcome::End::wrong, "the password is empty");
  return ask(name, &password, tell, until);
}

Outcome Server::look_up(const std::string& name, Moment until) const {
  return ask(name, nullptr, {}, until);
}

Outcome Server::ask(const std::string& name, const std::string* password, const Tell& given,
                    Moment until) const {
  const Tell tell = given ? given : [](const std::string&) {};
  try {
    const std::unique_ptr<Connection> connection = connect(tell, until);
    std::string why;
    const std::string dn = dn_of(*connection, name, why);
    if (dn.empty()) return refusal(Outcome::End::wrong, why);
    tell("user: " + dn);
    // Before the user's bind: the groups are searched as bind_dn.
    const Role role = role_of(*connection, name, dn, tell);
    if (password != nullptr) {
      why = connection->bind(dn, *password);
      if (!why.empty()) return refusal(Outcome::End::wrong, "password: " + why);
      tell("password: right");
    }
    if (role == Role::none) return refusal(Outcome::End::no_group, "in no group that gives a role");
    return {.end = Outcome::End::admitted, .role = role, .dn = dn, .why = {}};
  } catch (const std::runtime_error& e) {
    return refusal(Outcome::End::unavailable, e.what());
  }
}

std::unique_ptr<Connection> Server::connect(const Tell& tell, Moment until) const {
  std::string why;
  for (const std::string& server : settings_.servers) {
    try {
      auto connection = std::make_unique<Connection>(server, settings_, limit_, until);
      tell(fmt::format("{}: {}, certificate by {}", server, connection->tls_version(),
                       settings_.ca_file.string()));
      if (settings_.bind_dn.empty()) {
        tell("searches: anonymous");
        return connection;
      }
      // Read each time, so that a new password needs no restart.
      const std::string refused =
          connection->bind(settings_.bind_dn, base::read_secret(settings_.password));
      if (!refused.empty()) {
        throw std::runtime_error(
            fmt::format("{}: bind as {}: {}", server, settings_.bind_dn, refused));
      }
      tell("searches: " + settings_.bind_dn);
      return connection;
    } catch (const LdapTrouble& e) {
      why += (why.empty() ? "" : "; ") + std::string(e.what());
    }
  }
  throw LdapTrouble(why);
}

std::string Server::dn_of(Connection& connection, const std::string& name, std::string& why) const {
  const bool known = !settings_.user_dn.empty();
  const std::string base = known ? filled(settings_.user_dn, "{user}", name) : settings_.base;
  const std::string filter =
      known ? kAny : filled(settings_.user_filter, "{user}", filter_value(name));
  const auto found = connection.find(base, known ? Depth::entry_itself : Depth::all_below, filter);
  if (found && found->size() == 1) return found->front();
  if (!found && !known) throw LdapTrouble("base: there is no " + base);
  why = !found || found->empty() ? "no such user" : "several entries match user_filter";
  return {};
}

Role Server::role_of(Connection& connection, const std::string& name, const std::string& dn,
                     const Tell& tell) const {
  const std::string filter = filled(filled(settings_.group_filter, "{user}", filter_value(name)),
                                    "{dn}", filter_value(dn));
  Role highest = Role::none;
  for (const auto& [role, group] : settings_.groups) {
    const auto found = connection.find(group, Depth::entry_itself, filter);
    const bool is_in = found && !found->empty();
    tell(fmt::format("{}: {} {}", to_text(role),
                     !found  ? "there is no group (or it can't be read)"
                     : is_in ? "in"
                             : "not in",
                     group));
    if (is_in) highest = std::max(highest, role);
  }
  return highest;
}

void check_files(const LdapSettings& settings) {
  check_ca_file(settings);
  if (!settings.password.given()) return;
  if (settings.password.credential.empty()) check_password_file(settings.password.file);
  base::read_secret(settings.password);
}

}  // namespace loopwarden::page::ldap

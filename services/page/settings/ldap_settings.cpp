// SPDX-License-Identifier: Apache-2.0
#include "services/page/settings/ldap_settings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <sstream>

#include "config/diagnostic.hpp"
#include "config/file_keys.hpp"
#include "config/source_file.hpp"

namespace loopwarden::page {
namespace {

using config::MapReader;
using config::Value;

constexpr std::string_view kPlain = "ldap://";
constexpr std::string_view kTls = "ldaps://";

bool is_port(std::string_view text) {
  unsigned port = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), port);
  return error == std::errc() && end == text.data() + text.size() && port >= 1 && port <= 65535;
}

bool is_host(std::string_view name) {
  const bool v6 = name.starts_with('[') && name.ends_with(']');
  const std::string_view allowed = v6 ? "0123456789abcdefABCDEF:.[]"
                                      : "0123456789abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRST"
                                        "UVWXYZ.-";
  return name.size() > (v6 ? 2U : 0U) && name.find_first_not_of(allowed) == std::string_view::npos;
}

// Returns whether all brackets are paired and one pair encloses the whole text. `loopwarden-page
// ldap-test` shows the server's opinion of the content.
bool is_filter(std::string_view text) {
  int depth = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '(') ++depth;
    if (text[i] == ')') --depth;
    if (depth < 0 || (depth == 0 && i + 1 < text.size())) return false;
  }
  return text.size() > 2 && text.front() == '(' && depth == 0;
}

std::string read_dn(MapReader& in, std::string_view key, const char* meaning) {
  const Value<std::string> dn = in.text(key, meaning, "");
  if (dn.given && dn.valid && dn.value.find('=') == std::string::npos) {
    in.error(key, fmt::format("must be a distinguished name such as ou=people,dc=plant (got '{}')",
                              config::quotable(dn.value)));
  }
  return dn;
}

std::string read_filter(MapReader& in, std::string_view key, const char* meaning,
                        std::string fallback) {
  const Value<std::string> filter = in.text(key, meaning, std::move(fallback));
  if (filter.given && filter.valid && !is_filter(filter.value)) {
    in.error(key, fmt::format("must be a filter such as (uid={{user}}) (got '{}')",
                              config::quotable(filter.value)));
  }
  return filter;
}

void need_placeholder(MapReader& in, std::string_view key, const std::string& text) {
  if (in.given(key) && text.find("{user}") == std::string::npos) {
    in.error(key, "must have {user}, in whose place the name is put");
  }
}

void read_servers(MapReader& in, LdapSettings& settings) {
  const Value<std::string> urls =
      in.need_text("url",
                   "ldaps://HOST[:PORT], or ldap:// with start_tls; several with blanks between: "
                   "the first that answers is asked");
  settings.start_tls =
      in.flag("start_tls", "TLS begins on the port of ldap://, before any other request",
              settings.start_tls);
  if (!urls.given || !urls.valid) return;
  std::istringstream words(urls.value);
  for (std::string url; words >> url;) {
    const std::string why = ldap_url_error(url, settings.start_tls, settings.servers);
    if (!why.empty()) in.error("url", why);
  }
}

void read_user(MapReader& in, LdapSettings& settings) {
  settings.base = read_dn(in, "base", "below which user_filter looks, at any depth");
  settings.user_filter =
      read_filter(in, "user_filter", "finds the user; {user} is the name that was typed", "");
  settings.user_dn =
      read_dn(in, "user_dn", "in place of base and user_filter: the user's own name, with {user}");
  need_placeholder(in, "user_filter", settings.user_filter);
  need_placeholder(in, "user_dn", settings.user_dn);
  if (in.describing()) return;
  const bool searched = in.given("base") && in.given("user_filter");
  const bool half = in.given("base") != in.given("user_filter");
  if (half || searched == in.given("user_dn")) {
    in.error("must have either `base` and `user_filter`, or `user_dn`");
  }
}

void read_groups(MapReader& in, LdapSettings& settings) {
  in.need_section("groups", "the role is that of the highest group that the user is in",
                  [&](MapReader& groups) {
                    for (const Role role : {Role::viewer, Role::operator_, Role::engineer}) {
                      const std::string dn = read_dn(groups, to_text(role), "name of the group");
                      if (!dn.empty()) settings.groups.emplace_back(role, dn);
                    }
                    if (!groups.describing() && settings.groups.empty()) {
                      groups.error("must have a group of viewer, operator or engineer");
                    }
                  });
  settings.group_filter = read_filter(
      in, "group_filter",
      "what a group's entry matches if the user is in it; {dn} is the user's name in the "
      "directory, {user} the one that was typed",
      settings.group_filter);
  const bool names_nobody = settings.group_filter.find("{dn}") == std::string::npos &&
                            settings.group_filter.find("{user}") == std::string::npos;
  if (in.given("group_filter") && names_nobody)
    in.error("group_filter", "must have {dn} or {user}");
}

}  // namespace

std::string ldap_url_error(std::string_view url, bool start_tls,
                           std::vector<std::string>& servers) {
  const bool tls = url.starts_with(kTls);
  if (!tls && !url.starts_with(kPlain)) {
    return fmt::format("must be ldaps://HOST[:PORT] or ldap://HOST[:PORT] (got '{}')",
                       config::quotable(url));
  }
  if (!tls && !start_tls) return "passwords in the clear: use ldaps://, or `start_tls: true`";
  if (tls && start_tls) return "ldaps:// has TLS already: leave start_tls out, or use ldap://";
  std::string_view rest = url.substr(tls ? kTls.size() : kPlain.size());
  if (rest.ends_with('/')) rest.remove_suffix(1);
  const std::size_t bracket = rest.find(']');
  const std::size_t colon = rest.find(':', bracket == std::string_view::npos ? 0 : bracket);
  const std::string_view host = rest.substr(0, colon);
  const std::string_view port = colon == std::string_view::npos
                                    ? std::string_view(tls ? "636" : "389")
                                    : rest.substr(colon + 1);
  if (!is_host(host) || !is_port(port)) {
    return fmt::format(
        "must have a host, and a port from 1 to 65535 if any, without a path (got '{}')",
        config::quotable(url));
  }
  servers.push_back(fmt::format("{}:{}", host, port));
  return {};
}

LdapSettings read_ldap_settings(MapReader& in, const std::string& file) {
  LdapSettings settings;
  read_servers(in, settings);
  const Value<std::string> ca_file =
      in.need_text("ca_file", "PEM: the authority that the server's certificate is by; no other");
  if (ca_file.given && ca_file.valid) settings.ca_file = config::resolve(file, ca_file);
  settings.bind_dn = read_dn(in, "bind_dn", "who searches users and groups; empty: anonymous");
  settings.password = config::read_secret_at(
      in, "password", "of bind_dn; a file must be closed to all but the page's user", file);
  if (!in.describing() && settings.bind_dn.empty() == settings.password.given()) {
    in.error("bind_dn and password belong together");
  }
  read_user(in, settings);
  read_groups(in, settings);
  settings.domains =
      in.maybe_texts("domains",
                     "of DOMAIN\\user and user@domain that are taken off what was typed; names "
                     "with another one are refused")
          .value;
  return settings;
}

}  // namespace loopwarden::page

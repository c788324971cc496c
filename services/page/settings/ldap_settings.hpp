// SPDX-License-Identifier: Apache-2.0
// Section ldap of page.yaml: a directory (OpenLDAP, Active Directory) of further users.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/secret/secret.hpp"
#include "config/map_reader.hpp"
#include "services/page/users/role.hpp"

namespace loopwarden::page {

struct LdapSettings {
  std::vector<std::string> servers;  // HOST:PORT, the first that answers is asked
  bool start_tls = false;            // otherwise TLS from the first byte on
  std::filesystem::path ca_file;
  std::string bind_dn;  // who searches; empty: anonymous
  base::Secret password;
  std::string base;         // below which user_filter finds the user ...
  std::string user_filter;  // with {user}
  std::string user_dn;      // ... or his name as it is, with {user}
  std::string group_filter = "(member={dn})";
  std::vector<std::pair<Role, std::string>> groups;
  std::vector<std::string> domains;
};

// Returns why `url` is invalid; empty if it is valid, and then appends its HOST:PORT to `servers`.
std::string ldap_url_error(std::string_view url, bool start_tls, std::vector<std::string>& servers);

// `file`: start of relative paths.
LdapSettings read_ldap_settings(config::MapReader& in, const std::string& file);

}  // namespace loopwarden::page

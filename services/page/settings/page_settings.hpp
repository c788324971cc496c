// SPDX-License-Identifier: Apache-2.0
// page.yaml: content, addresses and users of the page.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/diagnostic.hpp"
#include "config/key_reference.hpp"
#include "services/database/database_settings.hpp"
#include "services/page/settings/ldap_settings.hpp"

namespace loopwarden::page {

struct Endpoint {
  std::string address = "127.0.0.1";
  std::uint16_t port = 8480;
};

// Returns whether the address is a numeric one of 127.0.0.0/8, or ::1.
bool is_loopback(const std::string& address);

struct PageSettings {
  std::vector<Endpoint> listen{Endpoint{}};
  std::filesystem::path certificate;  // empty: plain HTTP
  std::filesystem::path key;
  std::filesystem::path users;  // empty: every client on this host can view, and writes are off
  std::vector<std::string>
      hosts;  // names in a browser's address line, in addition to the certificate's
  std::filesystem::path status_socket = "/run/loopwardend/status.sock";
  std::filesystem::path page_socket = "/run/loopwardend/page.sock";
  std::filesystem::path state_directory = "/var/lib/loopwardend";
  std::size_t clients = 200;     // connections at a time
  double requests_per_s = 50.0;  // of one address
  double updates_per_s = 2.0;    // live values
  bool control = false;          // set points, outputs and modes from here
  double session_hours = 12.0;   // longest, from the log-in
  double session_idle_minutes = 30.0;
  std::optional<LdapSettings> ldap;  // users in addition to those of the file
  std::string time_zone;             // empty: the box's
  std::optional<loopwarden::fleet::DatabaseSettings> fleet;  // of a plant of boxes
  bool box = true;  // false: this machine has no loopwardend, and only the fleet is shown

  bool has_tls() const noexcept { return !certificate.empty(); }
};

config::Loaded<PageSettings> read_page_file(const std::filesystem::path& path);
// `file`: name in diagnostics, and start of relative paths.
config::Loaded<PageSettings> read_page_text(const std::string& file, std::string_view text);
config::KeyReference describe_page();

// Returns why the page must not be offered at this address; empty if it may. Addresses that other
// hosts can reach need TLS and users.
std::string why_not_at(const PageSettings& settings, const std::string& address);

}  // namespace loopwarden::page

// SPDX-License-Identifier: Apache-2.0
#include "services/page/settings/page_settings.hpp"

#include <fmt/format.h>

#include <system_error>

#include "config/file_keys.hpp"
#include "config/document.hpp"
#include "base/peer_list.hpp"

namespace loopwarden::page {
namespace {

using config::between;
using config::MapReader;
using config::Value;

Endpoint read_endpoint(MapReader& in) {
  Endpoint endpoint;
  const Value<std::string> address =
      in.text("address", "numeric IPv4 or IPv6 address of this box; 0.0.0.0 or \"::\": all of them",
              endpoint.address);
  if (address.given && address.valid && !base::parse_network(address)) {
    in.error("address",
             fmt::format("must be a numeric address (got '{}')", config::quotable(address.value)));
  }
  endpoint.address = address;
  endpoint.port =
      static_cast<std::uint16_t>(in.integer("port", {1, 65535, "", "TCP port"}, endpoint.port));
  return endpoint;
}

void read_tls(MapReader& in, const std::string& file, PageSettings& settings) {
  settings.certificate =
      config::resolve(file, in.need_text("certificate", "PEM, the server's first, then its chain"));
  settings.key =
      config::resolve(file, in.need_text("key", "PEM, readable by the page's user only"));
}

void read_sockets(MapReader& in, const std::string& file, PageSettings& settings) {
  settings.status_socket = config::read_path(in, "status", "where the daemon answers questions",
                                             file, settings.status_socket);
  settings.page_socket = config::read_path(in, "page", "where the daemon takes the page's orders",
                                           file, settings.page_socket);
}

void read_session(MapReader& in, PageSettings& settings) {
  settings.session_hours = in.number(
      "hours", {"h", between(0.1, 720.0), "after which one logs in again"}, settings.session_hours);
  settings.session_idle_minutes =
      in.number("idle_minutes",
                {"min", between(1.0, 1440.0),
                 "without a key press or a pointer's move, after which one logs in again; a user "
                 "added with --display has no such limit"},
                settings.session_idle_minutes);
}

void read_listen(MapReader& in, PageSettings& settings) {
  std::vector<MapReader> endpoints = in.maybe_list("listen", "where the page is offered");
  if (endpoints.empty()) return;
  settings.listen.clear();
  for (MapReader& endpoint : endpoints) settings.listen.push_back(read_endpoint(endpoint));
}

void check_listen(MapReader& in, const PageSettings& settings) {
  if (in.describing()) return;
  for (const Endpoint& endpoint : settings.listen) {
    const std::string why = why_not_at(settings, endpoint.address);
    if (!why.empty()) in.error("listen", why);
  }
}

void read_limits(MapReader& in, PageSettings& settings) {
  settings.clients = static_cast<std::size_t>(
      in.integer("clients",
                 {4, 10000, "",
                  "connections at a time; of one address a quarter of them, of this host itself, "
                  "such as a proxy, half"},
                 static_cast<std::int64_t>(settings.clients)));
  settings.requests_per_s = in.number(
      "rate", {"1/s", between(1.0, 10000.0), "requests of one address"}, settings.requests_per_s);
  settings.updates_per_s =
      in.number("updates", {"1/s", between(0.2, 5.0), "how often live values are sent"},
                settings.updates_per_s);
}

void read_fleet(MapReader& in, const std::string& file, PageSettings& settings) {
  if (auto fleet = in.maybe_section("fleet", "of loopwarden-fleet: a plant of boxes is shown")) {
    settings.fleet = loopwarden::fleet::read_database_settings(*fleet, config::Presence::required,
                                                               "password", file);
  }
  settings.box = in.flag("box",
                         "loopwardend runs on this machine; false: only the fleet is shown, which "
                         "the section fleet must name",
                         settings.box);
  if (!in.describing() && !settings.box && !in.given("fleet")) {
    in.error("box", "false needs the section fleet; otherwise the page is empty");
  }
}

bool is_time_zone(const std::string& name) {
  const std::filesystem::path zone = std::filesystem::path(name).lexically_normal();
  std::error_code none;
  return zone.is_relative() && zone.string() == name && !name.starts_with("..") &&
         std::filesystem::is_regular_file("/usr/share/zoneinfo" / zone, none);
}

PageSettings read_page(MapReader& in, const std::string& file) {
  PageSettings settings;
  read_listen(in, settings);
  if (auto tls = in.maybe_section("tls", "HTTPS; needed beyond this host")) {
    read_tls(*tls, file, settings);
  }
  settings.users = config::read_path(in, "users",
                                     "file of `loopwarden-page user`; empty: everybody on this "
                                     "host can view, and writes are off",
                                     file);
  in.maybe_section(
      "ldap", "users of a directory, in addition to those of the file", [&](MapReader& ldap) {
        settings.ldap = read_ldap_settings(ldap, file);
        if (!in.describing() && settings.users.empty()) {
          in.error("ldap", "needs `users` too: users who can log in while the directory is away");
        }
      });
  settings.hosts =
      in.maybe_texts("hosts",
                     "names of this box in a browser's address line, in addition to localhost, "
                     "addresses and those of the certificate")
          .value;
  if (auto sockets = in.maybe_section("sockets", "of the daemon")) {
    read_sockets(*sockets, file, settings);
  }
  settings.state_directory =
      config::read_path(in, "state_directory", "the daemon's", file, settings.state_directory);
  read_limits(in, settings);
  settings.control =
      in.flag("control",
              "set points, outputs and modes may be set here, by operators; the daemon's "
              "page.control must allow it too",
              settings.control);
  if (auto session = in.maybe_section("session", "of who has logged in")) {
    read_session(*session, settings);
  }
  settings.time_zone = in.text("time_zone", "such as Africa/Johannesburg; empty: the box's", "");
  if (!settings.time_zone.empty() && !is_time_zone(settings.time_zone)) {
    in.error("time_zone", fmt::format("this box knows no zone '{}' (/usr/share/zoneinfo)",
                                      config::quotable(settings.time_zone)));
  }
  read_fleet(in, file, settings);
  check_listen(in, settings);
  return settings;
}

}  // namespace

bool is_loopback(const std::string& address) {
  const auto network = base::parse_network(address);
  const auto loopback = base::parse_network("127.0.0.0/8");
  const auto loopback6 = base::parse_network("::1");
  return network && network->bits == 128 &&
         (loopback->contains(network->base) || loopback6->contains(network->base));
}

std::string why_not_at(const PageSettings& settings, const std::string& address) {
  if (is_loopback(address) || (settings.has_tls() && !settings.users.empty())) return {};
  return fmt::format("{} is reached from other hosts: that needs {}", config::quotable(address),
                     settings.has_tls()       ? "users"
                     : settings.users.empty() ? "tls and users"
                                              : "tls");
}

config::Loaded<PageSettings> read_page_text(const std::string& file, std::string_view text) {
  return config::load_text<PageSettings>(file, text,
                                         [&](MapReader& in) { return read_page(in, file); });
}

config::Loaded<PageSettings> read_page_file(const std::filesystem::path& path) {
  return config::load_file(path, read_page_text);
}

config::KeyReference describe_page() {
  return config::keys_of([](MapReader& in) { read_page(in, ""); });
}

}  // namespace loopwarden::page

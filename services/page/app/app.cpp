// SPDX-License-Identifier: Apache-2.0
#include "services/page/app/app.hpp"

#include <spdlog/spdlog.h>
#include <systemd/sd-daemon.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <system_error>

#include "base/exit_code.hpp"
#include "base/text.hpp"
#include "services/page/api/router.hpp"
#include "services/page/app/load_fleet.hpp"
#include "services/net/http/server.hpp"
#include "services/net/http/tls.hpp"
#include "services/page/site/assets.hpp"

namespace loopwarden::page {
namespace {

constexpr std::chrono::milliseconds kPatience{1000};
// Time to wait for a directory's answer. Requests to it change no data, so they may be cut off.
constexpr std::chrono::milliseconds kPatienceAtEnd{2000};
// Commands wait for the daemon's disk.
constexpr std::chrono::milliseconds kOrderPatience{3000};

// Returns the names in page.yaml and, with TLS, those of the certificate, which proves them.
std::set<std::string> hosts_of(const PageSettings& settings) {
  std::set<std::string> hosts;
  for (const std::string& host : settings.hosts) hosts.insert(base::lower_case(host));
  if (settings.has_tls()) {
    for (std::string& name : http::names_in_certificate(settings.certificate)) {
      hosts.insert(std::move(name));
    }
  }
  return hosts;
}

http::Assets built_in_site() {
  http::Assets site;
  for (const Asset& asset : assets()) {
    site.add(std::string(asset.path.substr(1)), std::string(asset.body));
  }
  return site;
}

http::ServerSettings server_settings(const PageSettings& settings) {
  http::ServerSettings server;
  server.limits = {.clients = settings.clients,
                   .per_address = std::max<std::size_t>(1, settings.clients / 4),
                   .loopback = std::max<std::size_t>(1, settings.clients / 2),
                   .requests_per_s = settings.requests_per_s};
  if (settings.has_tls()) server.tls = http::TlsFiles{settings.certificate, settings.key};
  return server;
}

std::chrono::milliseconds per_second(double times) {
  return std::chrono::milliseconds(static_cast<std::int64_t>(1000.0 / times));
}

SessionLimits session_limits(const PageSettings& settings) {
  using Minutes = std::chrono::duration<double, std::ratio<60>>;
  const auto whole = [](Minutes minutes) {
    return std::chrono::duration_cast<std::chrono::milliseconds>(minutes);
  };
  return {.longest = whole(Minutes(60.0 * settings.session_hours)),
          .idle = whole(Minutes(settings.session_idle_minutes))};
}

// Holds all parts of the running page, in the order of their dependencies.
class App {
 public:
  App(const PageSettings& settings, const std::filesystem::path& site)
      : settings_(settings),
        site_folder_(site),
        site_(site.empty() ? built_in_site() : http::Assets()),
        box_({.status_socket = settings.box ? settings.status_socket.string() : std::string(),
              .live = per_second(settings.updates_per_s)}),
        daemon_(settings.status_socket, kPatience),
        orders_(settings.page_socket, kOrderPatience),
        users_(settings.users),
        sessions_(session_limits(settings)),
        ldap_(settings.ldap
                  ? std::make_unique<ldap::Worker>(ldap::Server(*settings.ldap), users_, sessions_)
                  : nullptr),
        reports_(settings.state_directory),
        tests_(daemon_, orders_),
        fleet_(settings.fleet ? fleet::load_fleet(*settings.fleet) : nullptr),
        hosts_(hosts_of(settings)),
        router_(api::Context{.settings = settings_,
                             .hosts = hosts_,
                             .now = [this] { return box_.now(); },
                             .sparklines = [this] { return box_.sparklines(); },
                             .daemon = daemon_,
                             .orders = orders_,
                             .users = users_,
                             .sessions = sessions_,
                             .guard = guard_,
                             .ldap = ldap_.get(),
                             .history = history_,
                             .reports = reports_,
                             .tests = tests_,
                             .fleet = fleet_.get(),
                             .site = [this](const http::Request& r) { return answer_of_site(r); },
                             .counters = [this] { return server_.counters(); }}),
        server_(server_settings(settings), router_) {}

  int run() {
    open();
    look_at_users();
    sessions_.on_end([this] { server_.look_at_streams(); });
    server_.on_streams([this](std::size_t count) { box_.listeners(count); });
    for (const int number : {SIGTERM, SIGINT}) {
      server_.on_signal(number, [this] { server_.stop(); });
    }
    server_.on_signal(SIGHUP, [this] { reload(); });
    keep_alive();
    box_.start(
        [this](http::EventKind kind, std::string data) { server_.publish(kind, std::move(data)); },
        [this] { look_at_users(); });
    sd_notify(0, "READY=1");
    server_.run();
    sd_notify(0, "STOPPING=1");
    box_.stop();
    // Its thread still uses objects that the destructors would destroy.
    const bool tests_ended = tests_.stop_for(kPatienceAtEnd);
    if (!tests_ended || (ldap_ && !ldap_->stop_for(kPatienceAtEnd))) ::_exit(kExitOk);
    return kExitOk;
  }

 private:
  // Opens the service manager's sockets, otherwise those of page.yaml.
  void open() {
    const int inherited = sd_listen_fds(1);
    for (int fd = SD_LISTEN_FDS_START; fd < SD_LISTEN_FDS_START + inherited; ++fd) {
      if (sd_is_socket(fd, AF_UNSPEC, SOCK_STREAM, 1) <= 0) continue;
      announce(server_.adopt(fd));
    }
    if (inherited > 0) return;
    for (const Endpoint& at : settings_.listen) server_.listen(at.address, at.port);
    for (const Endpoint& at : settings_.listen) {
      const bool v6 = at.address.find(':') != std::string::npos;
      spdlog::info("{}://{}{}{}:{}/", settings_.has_tls() ? "https" : "http", v6 ? "[" : "",
                   at.address, v6 ? "]" : "", at.port);
    }
  }

  static void announce(std::uint16_t port) { spdlog::info("port {} of the service manager", port); }

  void reload() {
    try {
      // Both change or neither: the accepted names are always those of the certificate in force.
      std::set<std::string> names = hosts_of(settings_);
      server_.reload_certificate();
      hosts_.replace(std::move(names));
      spdlog::info("certificate and key read again");
    } catch (const std::exception& e) {
      spdlog::error("the old certificate stays: {}", e.what());
    }
  }

  void look_at_users() {
    const auto before = users_.users();
    const std::string trouble = users_.refresh();
    if (!trouble.empty()) spdlog::error("users: {}", trouble);
    if (users_.users() != before) server_.look_at_streams();
  }

  // Runs in the event loop: if the loop hangs, the watchdog is not fed.
  void keep_alive() {
    std::uint64_t watchdog_us = 0;
    if (sd_watchdog_enabled(0, &watchdog_us) <= 0) return;
    server_.every(std::chrono::milliseconds(watchdog_us / 3000),
                  [] { sd_notify(0, "WATCHDOG=1"); });
  }

  http::Response answer_of_site(const http::Request& request) const {
    return site_folder_.empty() ? site_.answer(request)
                                : http::Assets(site_folder_).answer(request);
  }

  PageSettings settings_;
  std::filesystem::path site_folder_;
  http::Assets site_;
  Box box_;
  protocol::DaemonClient daemon_;
  protocol::DaemonClient orders_;
  UserDirectory users_;
  Sessions sessions_;
  LogInGuard guard_;
  std::unique_ptr<ldap::Worker> ldap_;
  history::History history_;
  files::ReportStore reports_;
  planned_test::TestRunner tests_;
  std::unique_ptr<fleet::Fleet> fleet_;
  api::HostNames hosts_;
  api::Router router_;
  http::Server server_;
};

// Returns a zone such as "Africa/Johannesburg", from the target of /etc/localtime; UTC if the
// target names no zone.
std::string zone_of_the_box() {
  std::error_code none;
  const std::string target = std::filesystem::read_symlink("/etc/localtime", none).string();
  constexpr std::string_view kBefore = "zoneinfo/";
  const std::size_t at = target.find(kBefore);
  return at == std::string::npos ? "UTC" : target.substr(at + kBefore.size());
}

// Checks that the service manager's sockets are not more open than page.yaml may be.
void check_inherited(const PageSettings& settings) {
  const int inherited = sd_listen_fds(0);
  for (int fd = SD_LISTEN_FDS_START; fd < SD_LISTEN_FDS_START + inherited; ++fd) {
    const std::string address = http::address_of_socket(fd);
    const std::string why = address.empty() ? std::string() : why_not_at(settings, address);
    if (!why.empty()) throw BadConfiguration("the service manager's socket: " + why);
  }
}

}  // namespace

void check_files(const PageSettings& settings) {
  try {
    if (settings.has_tls())
      SSL_CTX_free(http::make_tls_context({settings.certificate, settings.key}));
    // The file may not exist yet; until then no user can log in.
    if (std::filesystem::exists(settings.users)) read_users(settings.users);
    if (settings.ldap) ldap::check_files(*settings.ldap);
    if (settings.fleet) fleet::load_fleet(*settings.fleet);
  } catch (const std::exception& e) {
    throw BadConfiguration(e.what());
  }
}

int serve(PageSettings settings, const std::filesystem::path& site) {
  check_files(settings);
  check_inherited(settings);
  if (settings.time_zone.empty()) {
    settings.time_zone = zone_of_the_box();
  } else {
    ::setenv("TZ", settings.time_zone.c_str(), 1);
    ::tzset();
  }
  return App(settings, site).run();
}

}  // namespace loopwarden::page

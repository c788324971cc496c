// SPDX-License-Identifier: Apache-2.0
// All handlers with fake daemons, test users and test folders, without a socket.
#pragma once

#include <memory>
#include <string>
#include <utility>

#include "services/page/api/gate.hpp"
#include "services/page/api/router.hpp"
#include "services/page/users/password.hpp"
#include "tests/services/page/support/fake_daemon.hpp"
#include "tests/services/page/support/fake_fleet.hpp"
#include "tests/services/page/support/fake_log_ins.hpp"
#include "tests/support/temporary_folder.hpp"

namespace loopwarden::tests {

class ApiRig {
 public:
  explicit ApiRig(bool with_users)
      : users_(with_users ? folder / "users" : std::filesystem::path()) {
    settings.control = true;
    settings.state_directory = folder / "state";
    now.up = true;
    now.state = page::box_state_of(describe_of_two());
    now.alarms = std::make_shared<const std::string>(R"({"alarms":[],"now_ms":1})");
    if (!with_users) return;
    page::write_users({{"vera", {page::Role::viewer, hash()}},
                       {"otto", {page::Role::operator_, hash()}},
                       {"ella", {page::Role::engineer, hash()}}},
                      folder / "users");
    users_.refresh();
  }

  http::Response answer(const http::Request& request) {
    http::Response response = router().answer(request);
    while (response.next) {
      ++rounds;
      response = response.next();
    }
    return response;
  }

  page::api::Router& router() {
    if (!router_) router_ = std::make_unique<page::api::Router>(context());
    return *router_;
  }

  static http::Request get(std::vector<std::string> path) {
    http::Request request;
    request.path = std::move(path);
    request.host = "localhost:8480";
    request.peer = "127.0.0.1";
    request.network = "loopback";
    request.peer_is_loopback = true;
    return request;
  }

  http::Request get_as(const std::string& user, std::vector<std::string> path) {
    http::Request request = get(std::move(path));
    request.cookies[page::api::kCookie] = cookie_of(user);
    return request;
  }

  http::Request post_as(const std::string& user, std::vector<std::string> path,
                        const nlohmann::json& body) {
    http::Request request = get_as(user, std::move(path));
    request.method = http::Method::post;
    request.content_type = "application/json";
    request.body = body.dump();
    const auto who = sessions_.find(request.cookies[page::api::kCookie], *users_.users(),
                                    std::chrono::steady_clock::now(), true);
    request.csrf = who ? who->csrf : page::fingerprint("nobody");
    return request;
  }

  std::string cookie_of(const std::string& user) {
    const auto users = users_.users();
    const auto known = users->find(user);
    return known == users->end()
               ? ""
               : sessions_.begin(user, known->second, std::chrono::steady_clock::now());
  }

  void log_out(const std::string& cookie) { sessions_.end(cookie); }
  bool holds(const std::string& cookie, page::Moment at) {
    return sessions_.find(cookie, *users_.users(), at, false).has_value();
  }
  // The time of a request by a person.
  bool use(const std::string& cookie, page::Moment at) {
    return sessions_.find(cookie, *users_.users(), at, true).has_value();
  }

  page::UserDirectory& users() { return users_; }

  static const std::string& hash() {
    static const std::string one = page::hash_password("correct horse", page::PasswordCost::least);
    return one;
  }

  TemporaryFolder folder;
  page::PageSettings settings;
  page::Box::Now now;
  SpokenDaemon daemon;
  SpokenDaemon orders;
  page::api::HostNames hosts{{"box.plant"}};
  FakeFleet fleet;
  FakeLogIns directory;    // used if settings.ldap is set before the first answer
  int rounds = 0;          // number of answers that were waited for
  bool has_fleet = false;  // set it before the first answer

 private:
  page::api::Context context() {
    return {.settings = settings,
            .hosts = hosts,
            .now = [this] { return now; },
            .sparklines = [] { return std::string("{}"); },
            .daemon = daemon,
            .orders = orders,
            .users = users_,
            .sessions = sessions_,
            .guard = guard_,
            .ldap = settings.ldap ? &directory : nullptr,
            .history = history_,
            .reports = reports_,
            .tests = tests_,
            .fleet = has_fleet ? &fleet : nullptr,
            .site = [](const http::Request&) { return http::Response(); },
            .counters = [] { return http::Counters(); }};
  }

  page::UserDirectory users_;
  page::Sessions sessions_{{}};
  page::LogInGuard guard_;
  page::history::History history_;
  page::files::ReportStore reports_{folder / "state"};
  page::planned_test::TestRunner tests_{daemon, orders};
  std::unique_ptr<page::api::Router> router_;
};

}  // namespace loopwarden::tests

// SPDX-License-Identifier: Apache-2.0
#include "services/page/ldap/log_ins.hpp"

#include <atomic>
#include <catch2/catch.hpp>
#include <future>
#include <string>
#include <utility>
#include <vector>

#include "services/page/users/password.hpp"
#include "tests/services/page/support/slapd.hpp"

namespace loopwarden::tests::log_ins_test {

using namespace page;
using test::eventually;

struct Page {
  explicit Page(const Slapd& slapd) : Page(ldap::Server(slapd.settings())) {}
  explicit Page(ldap::Server server)
      : users(folder / "users"),
        worker(std::move(server), users, sessions, std::chrono::milliseconds(50)) {
    sessions.on_end([this] { ++ended; });
  }

  // Logs in as the API does.
  std::string log_in(const std::string& name) {
    const ldap::Outcome outcome = ask(name).get();
    REQUIRE(outcome.end == ldap::Outcome::End::admitted);
    return admit(name, outcome.role, outcome.dn);
  }
  std::shared_future<ldap::Outcome> ask(const std::string& name, const std::string& whose = "here",
                                        Moment until = Moment::max()) {
    return worker.begin(name, Slapd::kPassword, whose, until);
  }
  std::string admit(const std::string& name, Role role, const std::string& dn) {
    const Moment now = std::chrono::steady_clock::now();
    const std::string cookie = sessions.begin(name, {role, dn, false, true}, now);
    users.admit(name, role, dn);
    return cookie;
  }
  Role role(const std::string& cookie) {
    const auto who = sessions.find(cookie, *users.users(), std::chrono::steady_clock::now(), false);
    return who ? who->role : Role::none;
  }

  TemporaryFolder folder;
  UserDirectory users;
  Sessions sessions{{}};
  std::atomic<int> ended{0};
  ldap::Worker worker;
};

TEST_CASE("logged-in users are checked again regularly", "[slapd]") {
  if (!Slapd::is_there()) return;
  using Change = Slapd::Change;
  Slapd slapd;
  Page page(slapd);
  const std::string cookie = page.log_in("otto");
  CHECK(page.role(cookie) == Role::operator_);
  SECTION("a higher group gives a higher role in the same session") {
    slapd.change_member("engineers", Change::add, "otto");
    CHECK(eventually([&] { return page.role(cookie) == Role::engineer; }));
  }
  SECTION("without a group all sessions of the user end") {
    page.log_in("otto");
    const std::string ella = page.log_in("ella");
    slapd.change_member("operators", Change::remove, "otto");
    CHECK(eventually([&] { return page.sessions.size() == 1; }));
    CHECK(page.role(cookie) == Role::none);
    CHECK(page.role(ella) == Role::engineer);
    CHECK(eventually([&] { return page.ended == 1; }));
    CHECK(
        eventually([&] { return page.users.of_directory() == std::vector<std::string>{"ella"}; }));
  }
  SECTION("while the server is away a session stays") {
    slapd.stop();
    CHECK(page.ask("ella").get().end == ldap::Outcome::End::unavailable);
    CHECK(page.role(cookie) == Role::operator_);
    slapd.start();
    slapd.change_member("operators", Change::remove, "otto");
    CHECK(eventually([&] { return page.sessions.size() == 0; }));
  }
  SECTION("users without a session are removed") {
    page.sessions.end(cookie);
    CHECK(eventually([&] { return page.users.of_directory().empty(); }));
  }
  SECTION("a new user of the file takes over the name") {
    write_users({{"Otto", {Role::viewer, hash_password("x", PasswordCost::least)}}},
                page.folder / "users");
    CHECK(page.users.refresh().empty());
    CHECK(page.role(cookie) == Role::none);
    CHECK(page.users.of_directory().empty());
  }
}

TEST_CASE("an entry that can't be checked doesn't keep other users logged in", "[slapd]") {
  if (!Slapd::is_there()) return;
  const Slapd slapd;
  LdapSettings settings = slapd.settings();
  settings.base.clear();
  settings.user_filter.clear();
  settings.user_dn = "uid={user},ou=people,dc=plant";
  const ldap::Server server(settings);
  REQUIRE(server.look_up("zoe").end == ldap::Outcome::End::unavailable);
  Page page(server);
  const std::string zoe = page.admit("zoe", Role::viewer, Slapd::user("zoe"));
  const std::string otto = page.log_in("otto");
  slapd.change_member("engineers", Slapd::Change::add, "otto");
  REQUIRE(eventually([&] { return page.role(otto) == Role::engineer; }));
  for (const char* group : {"engineers", "operators"}) {
    slapd.change_member(group, Slapd::Change::remove, "otto");
  }
  CHECK(eventually([&] { return page.role(otto) == Role::none; }));
  CHECK(page.role(zoe) == Role::viewer);
}

TEST_CASE("a log-in without a waiting client is not done", "[slapd]") {
  if (!Slapd::is_there()) return;
  Page page(Slapd::shared());
  const ldap::Outcome late = page.ask("otto", "here", std::chrono::steady_clock::now()).get();
  CHECK(late.end == ldap::Outcome::End::unavailable);
  CHECK_THAT(late.why, Catch::Contains("no time is left"));
}

TEST_CASE("the end of the page does not wait for a directory that hangs", "[slapd]") {
  if (!Slapd::is_there()) return;
  const Slapd slapd;
  slapd.hang();
  Page page(ldap::Server(slapd.settings(), std::chrono::hours(1)));
  std::vector<std::shared_future<ldap::Outcome>> asked;
  // One more than can wait, because the first is already being processed.
  REQUIRE(eventually([&] {
    if (auto one = page.ask("otto"); one.valid()) asked.push_back(std::move(one));
    return asked.size() == 5;
  }));
  CHECK_FALSE(page.worker.stop_for(std::chrono::milliseconds(0)));
  slapd.go_on();
  CHECK(page.worker.stop_for(std::chrono::seconds(60)));
  CHECK(asked.front().get().end == ldap::Outcome::End::admitted);
}

TEST_CASE("waiting log-ins are bounded, per client and in total", "[slapd]") {
  if (!Slapd::is_there()) return;
  const Slapd slapd;
  Page page(slapd);
  slapd.hang();
  const auto begin = [&](const std::string& whose) { return page.ask("otto", whose).valid(); };
  const auto taken_of = [&](const std::string& whose) {
    int taken = 0;
    for (int i = 0; i < 20; ++i) taken += begin(whose) ? 1 : 0;
    return taken;
  };
  // One of them may be in progress already, and no longer wait.
  const int of_one = taken_of("one");
  CHECK(of_one >= 4);
  CHECK(of_one <= 5);
  CHECK(of_one + taken_of("another") + taken_of("a third") <= 9);
  slapd.go_on();
  CHECK(page.worker.stop_for(std::chrono::seconds(60)));
  CHECK_FALSE(begin("one"));
}

}  // namespace loopwarden::tests::log_ins_test

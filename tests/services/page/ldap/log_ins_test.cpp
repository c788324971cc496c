// SPDX-License-Identifier: Apache-2.0
#include "services/page/ldap/log_ins.hpp"

#include <atomic>
#include <catch2/catch.hpp>

#include "services/page/users/password.hpp"
#include "tests/services/page/support/slapd.hpp"

namespace loopwarden::tests::log_ins_test {

using namespace page;
using test::eventually;

struct Page {
  explicit Page(const Slapd& slapd)
      : users(folder / "users"),
        worker(ldap::Server(slapd.settings()), users, sessions, std::chrono::milliseconds(50)) {
    sessions.on_end([this] { ++ended; });
  }

  // As the API does it.
  std::string log_in(const std::string& name) {
    const ldap::Outcome outcome = worker.begin(name, Slapd::kPassword, "here").get();
    REQUIRE(outcome.end == ldap::Outcome::End::admitted);
    const Moment now = std::chrono::steady_clock::now();
    const std::string cookie = sessions.begin(name, {outcome.role, outcome.dn, false, true}, now);
    users.admit(name, outcome.role, outcome.dn);
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

TEST_CASE("who has logged in is looked at again and again", "[slapd]") {
  if (!Slapd::is_there()) return;
  using Change = Slapd::Change;
  Slapd slapd;
  Page page(slapd);
  const std::string cookie = page.log_in("otto");
  CHECK(page.role(cookie) == Role::operator_);
  SECTION("a higher group is a higher role, in the same session") {
    slapd.change_member("engineers", Change::add, "otto");
    CHECK(eventually([&] { return page.role(cookie) == Role::engineer; }));
  }
  SECTION("without a group the session ends, and all of that user's") {
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
    CHECK(page.worker.begin("ella", Slapd::kPassword, "here").get().end ==
          ldap::Outcome::End::unavailable);
    CHECK(page.role(cookie) == Role::operator_);
    slapd.start();
    slapd.change_member("operators", Change::remove, "otto");
    CHECK(eventually([&] { return page.sessions.size() == 0; }));
  }
  SECTION("who has no session is forgotten") {
    page.sessions.end(cookie);
    CHECK(eventually([&] { return page.users.of_directory().empty(); }));
  }
  SECTION("a user of the file takes the name over") {
    write_users({{"Otto", {Role::viewer, hash_password("x", PasswordCost::least)}}},
                page.folder / "users");
    CHECK(page.users.refresh().empty());
    CHECK(page.role(cookie) == Role::none);
    CHECK(page.users.of_directory().empty());
  }
}

TEST_CASE("room for log-ins is bounded, of one client and in all", "[slapd]") {
  if (!Slapd::is_there()) return;
  const Slapd slapd;
  Page page(slapd);
  slapd.hang();
  const auto begin = [&](const std::string& whose) {
    return page.worker.begin("otto", Slapd::kPassword, whose).valid();
  };
  const auto taken_of = [&](const std::string& whose) {
    int taken = 0;
    for (int i = 0; i < 20; ++i) taken += begin(whose) ? 1 : 0;
    return taken;
  };
  // One of them may be asked already, and wait no longer.
  const int of_one = taken_of("one");
  CHECK(of_one >= 4);
  CHECK(of_one <= 5);
  CHECK(of_one + taken_of("another") + taken_of("a third") <= 9);
  page.worker.stop();
  CHECK_FALSE(begin("one"));
}

}  // namespace loopwarden::tests::log_ins_test

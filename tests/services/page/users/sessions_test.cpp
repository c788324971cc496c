// SPDX-License-Identifier: Apache-2.0
#include "services/page/users/sessions.hpp"

#include <catch2/catch.hpp>

namespace loopwarden::tests::sessions_test {

using namespace page;
using std::chrono::minutes;

const Moment kStart{minutes(100'000)};

struct Desk {
  Sessions sessions{{.longest = minutes(60), .idle = minutes(10), .most = 4, .most_each = 2}};
  Users users{{"anna", {Role::operator_, "hash of anna's"}}, {"ben", {Role::viewer, "of ben's"}}};

  std::string begin(const std::string& name, Moment at) {
    return sessions.begin(name, users.at(name), at);
  }
  bool holds(const std::string& cookie, Moment at, bool touch = true) {
    return sessions.find(cookie, users, at, touch).has_value();
  }
};

TEST_CASE("a session has its user, role and token") {
  Desk desk;
  const std::string cookie = desk.begin("anna", kStart);
  const auto who = desk.sessions.find(cookie, desk.users, kStart, true);
  REQUIRE(who);
  CHECK(who->user == "anna");
  CHECK(who->role == Role::operator_);
  CHECK(who->csrf.size() == 43);
  CHECK(who->csrf != cookie);
  CHECK_FALSE(desk.holds("", kStart));
  CHECK_FALSE(desk.holds("another", kStart));
}

TEST_CASE("a session ends when it is idle, and after its greatest age") {
  Desk desk;
  const std::string cookie = desk.begin("anna", kStart);
  CHECK(desk.holds(cookie, kStart + minutes(9)));
  SECTION("idle") { CHECK_FALSE(desk.holds(cookie, kStart + minutes(19))); }
  SECTION("automatic requests don't keep it alive") {
    CHECK(desk.holds(cookie, kStart + minutes(18), false));
    CHECK_FALSE(desk.holds(cookie, kStart + minutes(19), false));
  }
  SECTION("absolute") {
    for (int m = 18; m < 60; m += 9) CHECK(desk.holds(cookie, kStart + minutes(m)));
    CHECK_FALSE(desk.holds(cookie, kStart + minutes(60)));
  }
  SECTION("log-out") {
    desk.sessions.end(cookie);
    CHECK_FALSE(desk.holds(cookie, kStart + minutes(9)));
  }
}

TEST_CASE("a display's session ends only after its hours") {
  Desk desk;
  desk.users["wall"] = {Role::viewer, "of the wall's", true};
  const std::string cookie = desk.begin("wall", kStart);
  for (int m = 15; m < 60; m += 15) CHECK(desk.holds(cookie, kStart + minutes(m), false));
  SECTION("its hours") { CHECK_FALSE(desk.holds(cookie, kStart + minutes(60), false)); }
  SECTION("the user is no display any more") {
    desk.users["wall"].display = false;
    CHECK_FALSE(desk.holds(cookie, kStart + minutes(46), false));
  }
}

TEST_CASE("whoever ends a session is notified, and a session that continues is not") {
  Desk desk;
  int ended = 0;
  desk.sessions.on_end([&] { ++ended; });
  const std::string cookie = desk.begin("anna", kStart);
  CHECK(desk.holds(cookie, kStart));
  CHECK(ended == 0);
  SECTION("a log-out") { desk.sessions.end(cookie); }
  SECTION("being idle") { CHECK_FALSE(desk.holds(cookie, kStart + minutes(11), false)); }
  SECTION("a user who is removed") {
    desk.users.erase("anna");
    CHECK_FALSE(desk.holds(cookie, kStart));
  }
  SECTION("too many sessions of one user") {
    desk.begin("anna", kStart + minutes(1));
    CHECK(ended == 0);
    desk.begin("anna", kStart + minutes(2));
  }
  CHECK(ended == 1);
  desk.sessions.end(cookie);
  CHECK(ended == 1);
}

TEST_CASE("all sessions of one user end together, and an ended session is invalid") {
  Desk desk;
  const std::string cookie = desk.begin("anna", kStart);
  desk.begin("anna", kStart);
  const std::string bens = desk.begin("ben", kStart);
  CHECK(desk.sessions.has("anna", kStart));
  CHECK_FALSE(desk.sessions.has("anna", kStart + minutes(11)));
  int ended = 0;
  desk.sessions.on_end([&] { ++ended; });
  desk.sessions.end_all("anna");
  CHECK(ended == 1);
  CHECK_FALSE(desk.sessions.has("anna", kStart));
  CHECK_FALSE(desk.holds(cookie, kStart));
  CHECK(desk.holds(bens, kStart));
  desk.sessions.end_all("anna");
  CHECK(ended == 1);
}

TEST_CASE(
    "beyond the limit the session without a request for longest ends; automatic requests count") {
  Desk desk;
  desk.users["wall"] = {Role::viewer, "of the wall's", true};
  const std::string wall = desk.begin("wall", kStart);
  const std::string closed = desk.begin("wall", kStart + minutes(1));
  CHECK(desk.holds(wall, kStart + minutes(5), false));
  desk.begin("wall", kStart + minutes(6));
  CHECK(desk.holds(wall, kStart + minutes(6), false));
  CHECK_FALSE(desk.holds(closed, kStart + minutes(6), false));
}

TEST_CASE("a removed user or a changed password ends the session; a changed role applies to it") {
  Desk desk;
  const std::string cookie = desk.begin("anna", kStart);
  SECTION("removed") {
    desk.users.erase("anna");
    CHECK_FALSE(desk.holds(cookie, kStart));
  }
  SECTION("password") {
    desk.users["anna"].hash = "another";
    CHECK_FALSE(desk.holds(cookie, kStart));
    desk.users["anna"].hash = "hash of anna's";
    CHECK_FALSE(desk.holds(cookie, kStart));
  }
  SECTION("role") {
    desk.users["anna"].role = Role::viewer;
    CHECK(desk.sessions.find(cookie, desk.users, kStart, true)->role == Role::viewer);
  }
}

TEST_CASE("the number of sessions is bounded, per user and in total") {
  Desk desk;
  const std::string first = desk.begin("anna", kStart);
  const std::string second = desk.begin("anna", kStart + minutes(1));
  const std::string third = desk.begin("anna", kStart + minutes(2));
  CHECK_FALSE(desk.holds(first, kStart + minutes(2)));
  CHECK(desk.holds(second, kStart + minutes(2)));
  CHECK(desk.holds(third, kStart + minutes(2)));
  for (int i = 0; i < 10; ++i) desk.begin("ben", kStart + minutes(3));
  CHECK(desk.sessions.size() <= 4);
  CHECK(desk.holds(third, kStart + minutes(3)));
}

}  // namespace loopwarden::tests::sessions_test

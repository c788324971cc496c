// SPDX-License-Identifier: Apache-2.0
#include "services/page/users/log_in_guard.hpp"

#include <catch2/catch.hpp>

namespace loopwarden::tests::log_in_guard_test {

using page::LogInGuard;
using std::chrono::seconds;

const LogInGuard::Moment kStart{seconds(1'000'000)};

// Returns how many attempts the guard admits within `time`. `who` returns the user and the address
// for each second.
template <class Who>
int tries_within(seconds time, Who who) {
  LogInGuard guard;
  int tries = 0;
  for (seconds at(0); at < time; at += seconds(1)) {
    const auto [user, address] = who(at.count());
    for (int i = 0; i < 20; ++i) tries += guard.wait_s(user, address, kStart + at) == 0;
  }
  return tries;
}

TEST_CASE("an hour of guessing gives few attempts, with any users and addresses") {
  const auto one = [](long) { return std::pair<std::string, std::string>("anna", "10.0.0.1"); };
  const auto addresses = [](long at) {
    return std::pair<std::string, std::string>("anna", "10.0.0." + std::to_string(at % 250));
  };
  const auto users = [](long at) {
    return std::pair<std::string, std::string>("user" + std::to_string(at % 250), "10.0.0.1");
  };
  CHECK(tries_within(seconds(3600), one) < 30);
  CHECK(tries_within(seconds(3600), addresses) < 140);
  CHECK(tries_within(seconds(3600), users) < 30);
}

TEST_CASE("a user with the right password is soon admitted again") {
  LogInGuard guard;
  for (int i = 0; i < 200; ++i)
    guard.wait_s("anna", "6.6.6." + std::to_string(i % 3), kStart + seconds(i));
  CHECK(guard.wait_s("anna", "10.0.0.1", kStart + seconds(200)) <= 30);
  CHECK(guard.wait_s("anna", "10.0.0.1", kStart + seconds(231)) == 0);
  guard.right("anna", "10.0.0.1");
  for (int i = 0; i < 5; ++i) CHECK(guard.wait_s("anna", "10.0.0.1", kStart + seconds(232)) == 0);
}

TEST_CASE("attempts that were not checked don't count") {
  LogInGuard guard;
  const auto tried = [&](seconds at) { return guard.wait_s("anna", "10.0.0.1", kStart + at) == 0; };
  for (int i = 0; i < 100; ++i) {
    REQUIRE(tried(seconds(i)));
    guard.not_judged("anna", "10.0.0.1", kStart + seconds(i));
  }
  for (int i = 0; i < 5; ++i) CHECK(tried(seconds(100)));
  CHECK_FALSE(tried(seconds(100)));
  SECTION("and don't prolong a wait") {
    for (int i = 0; i < 4; ++i) CHECK(tried(seconds(200 + 40 * i)));
    const auto free_at = seconds(320 + 16);  // doubled four times
    CHECK_FALSE(tried(free_at - seconds(1)));
    REQUIRE(tried(free_at));
    guard.not_judged("anna", "10.0.0.1", kStart + free_at);
    CHECK(tried(free_at + seconds(1)));
  }
  SECTION("and don't shorten another user's wait") {
    guard.not_judged("otto", "10.0.0.2", kStart + seconds(100));
    CHECK_FALSE(tried(seconds(100)));
  }
}

}  // namespace loopwarden::tests::log_in_guard_test

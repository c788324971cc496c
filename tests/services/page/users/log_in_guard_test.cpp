// SPDX-License-Identifier: Apache-2.0
#include "services/page/users/log_in_guard.hpp"

#include <catch2/catch.hpp>

namespace loopwarden::tests::log_in_guard_test {

using page::LogInGuard;
using std::chrono::seconds;

const LogInGuard::Moment kStart{seconds(1'000'000)};

// Tries that pass within the time, from whatever address and for whatever user `who` says.
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

TEST_CASE("an hour of guessing gives few tries, whatever is changed between them") {
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

TEST_CASE("who knows the password is let in again soon") {
  LogInGuard guard;
  for (int i = 0; i < 200; ++i)
    guard.wait_s("anna", "6.6.6." + std::to_string(i % 3), kStart + seconds(i));
  CHECK(guard.wait_s("anna", "10.0.0.1", kStart + seconds(200)) <= 30);
  CHECK(guard.wait_s("anna", "10.0.0.1", kStart + seconds(231)) == 0);
  guard.right("anna", "10.0.0.1");
  for (int i = 0; i < 5; ++i) CHECK(guard.wait_s("anna", "10.0.0.1", kStart + seconds(232)) == 0);
}

}  // namespace loopwarden::tests::log_in_guard_test

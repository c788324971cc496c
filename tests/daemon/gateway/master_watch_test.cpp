// SPDX-License-Identifier: Apache-2.0
#include "daemon/gateway/master_watch.hpp"

#include <catch2/catch.hpp>

namespace loopwarden::daemon::gateway::master_watch_test {
namespace {

using Event = MasterWatch::Event;
constexpr std::int64_t kSecond = 1'000'000'000;

}  // namespace

TEST_CASE("a master that was there and falls silent is lost once, and back once", "[gateway]") {
  MasterWatch watch({.timeout_s = 3.0, .action = MasterLossAction::manual});
  CHECK(watch.step(100 * kSecond, false, 0) == Event::none);  // never there: never lost
  CHECK(watch.step(100 * kSecond, true, 0) == Event::none);
  CHECK(watch.step(102 * kSecond, true, 1) == Event::none);
  CHECK(watch.step(105 * kSecond - 1, false, 1) == Event::none);
  CHECK(watch.step(105 * kSecond, false, 1) == Event::lost);
  CHECK(watch.lost());
  CHECK(watch.step(106 * kSecond, false, 1) == Event::none);
  CHECK(watch.step(107 * kSecond, true, 2) == Event::back);
  CHECK_FALSE(watch.lost());
  CHECK(watch.step(110 * kSecond, false, 2) == Event::lost);
}

TEST_CASE("writing the same number again is no sign of life", "[gateway]") {
  MasterWatch watch({.timeout_s = 3.0, .action = MasterLossAction::report});
  watch.step(0, true, 5);
  CHECK(watch.step(2 * kSecond, true, 5) == Event::none);
  CHECK(watch.step(3 * kSecond, true, 5) == Event::lost);
  CHECK(watch.step(4 * kSecond, true, 5) == Event::none);
}

TEST_CASE("without a timeout nobody is watched", "[gateway]") {
  MasterWatch watch({});
  watch.step(0, true, 1);
  CHECK(watch.step(1'000'000 * kSecond, false, 1) == Event::none);
}

}  // namespace loopwarden::daemon::gateway::master_watch_test

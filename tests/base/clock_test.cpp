// SPDX-License-Identifier: Apache-2.0
#include "base/clock.hpp"

#include <catch2/catch.hpp>
#include <cstdint>
#include <ctime>

namespace clock_test {

using loopwarden::base::MonotonicClock;

TEST_CASE("the clock never runs backwards", "[os][clock]") {
  MonotonicClock clock;
  std::int64_t last = clock.now_ns();
  for (int i = 0; i < 10'000; ++i) {
    const std::int64_t now = clock.now_ns();
    REQUIRE(now >= last);
    last = now;
  }
}

TEST_CASE("a sleep ends no sooner than its instant", "[os][clock]") {
  MonotonicClock clock;
  const std::int64_t deadline = clock.now_ns() + 3'000'000;
  clock.sleep_until_ns(deadline);
  CHECK(clock.now_ns() >= deadline);
}

TEST_CASE("an instant in the past causes no wait", "[os][clock]") {
  MonotonicClock clock;
  const std::int64_t before = clock.now_ns();
  clock.sleep_until_ns(before - 1'000'000'000);
  clock.sleep_until_ns(0);
  CHECK(clock.now_ns() - before < 60'000'000'000);
}

TEST_CASE("the time of day is the system clock's", "[os][clock]") {
  const auto system_ms = [] { return std::int64_t{1000} * std::time(nullptr); };
  const std::int64_t before = system_ms();
  const std::int64_t now = loopwarden::base::utc_ms();
  CHECK(now >= before);
  CHECK(now < system_ms() + 1000);
}

}  // namespace clock_test

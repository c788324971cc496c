// SPDX-License-Identifier: Apache-2.0
#include "daemon/rt/pv_guard.hpp"

#include <catch2/catch.hpp>

#include <limits>

namespace loopwarden::daemon::rt::pv_guard_test {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;

hal::PvCheckSettings settings(double frozen_after_s = 0.0) {
  return {.low = 0.0,
          .high = 10.0,
          .range_margin = 0.05,
          .max_age_s = 0.3,
          .frozen_after_s = frozen_after_s};
}

hal::Sample good(double value, std::int64_t time_ns) {
  return {.value = value,
          .time_ns = time_ns,
          .sequence = 1,
          .quality = hal::Quality::good,
          .reason = hal::Reason::none,
          .limit = hal::Limit::none};
}

TEST_CASE("a fresh value in range passes as it is") {
  PvGuard guard(settings());
  CHECK(guard.check(good(5.0, kSecond), 50.0, 100.0, kSecond).quality == hal::Quality::good);
  CHECK(guard.check(good(10.5, kSecond), 50.0, 100.0, kSecond).quality == hal::Quality::good);
  CHECK(guard.check(good(-0.5, kSecond), 50.0, 100.0, kSecond).quality == hal::Quality::good);
}

TEST_CASE("age, range and numbers that are none make a value bad, each with its reason") {
  PvGuard guard(settings());
  const auto reason = [&](double value, std::int64_t age_ns) {
    const hal::Sample s = guard.check(good(value, kSecond), 50.0, 100.0, kSecond + age_ns);
    CHECK((s.quality == hal::Quality::bad) == (s.reason != hal::Reason::none));
    return s.reason;
  };
  CHECK(reason(5.0, 300'000'000) == hal::Reason::none);
  CHECK(reason(5.0, 300'000'001) == hal::Reason::stale);
  CHECK(reason(10.51, 0) == hal::Reason::out_of_range);
  CHECK(reason(-0.51, 0) == hal::Reason::out_of_range);
  CHECK(reason(std::numeric_limits<double>::quiet_NaN(), 0) == hal::Reason::not_finite);
  CHECK(reason(std::numeric_limits<double>::infinity(), 0) == hal::Reason::not_finite);
}

TEST_CASE("the guard never raises a quality") {
  PvGuard guard(settings());
  hal::Sample sample = good(5.0, kSecond);
  sample.quality = hal::Quality::bad;
  sample.reason = hal::Reason::link_lost;
  CHECK(guard.check(sample, 50.0, 100.0, kSecond).reason == hal::Reason::link_lost);
  sample.quality = hal::Quality::uncertain;
  CHECK(guard.check(sample, 50.0, 100.0, kSecond).quality == hal::Quality::uncertain);
}

TEST_CASE("a value that stands still while the output moves is frozen") {
  PvGuard guard(settings(10.0));
  std::int64_t now = kSecond;
  const auto look = [&](double value, double output, std::int64_t seconds) {
    now += seconds * kSecond;
    return guard.check(good(value, now), output, 100.0, now).reason;
  };
  CHECK(look(5.0, 50.0, 0) == hal::Reason::none);
  CHECK(look(5.0, 50.0, 60) == hal::Reason::none);  // the output stands still as well
  CHECK(look(5.0, 52.5, 1) == hal::Reason::frozen);
  CHECK(look(5.001, 52.5, 1) == hal::Reason::none);
  CHECK(look(5.001, 80.0, 9) == hal::Reason::none);  // not yet ten seconds
  CHECK(look(5.001, 80.0, 2) == hal::Reason::frozen);
  CHECK(guard.check(good(5.001, now), 80.0, 100.0, now).quality == hal::Quality::uncertain);
}

TEST_CASE("the first value is not frozen, whatever it is and wherever the output stands") {
  PvGuard guard(settings(2.0));
  // A flow below the cut-off of its transmitter is exactly 0.
  CHECK(guard.check(good(0.0, 100 * kSecond), 50.0, 100.0, 100 * kSecond).quality ==
        hal::Quality::good);
}

// What the guard says of a PV that stands still at 5, of whatever quality.
struct Look {
  PvGuard& guard;
  hal::Reason operator()(std::int64_t second, double output, hal::Quality quality) const {
    hal::Sample sample = good(5.0, second * kSecond);
    sample.quality = quality;
    if (quality == hal::Quality::uncertain) sample.reason = hal::Reason::out_of_range;
    return guard.check(sample, output, 100.0, second * kSecond).reason;
  }
};
using hal::Quality;

TEST_CASE("an output that is learnt has not moved; one that moves from there has") {
  PvGuard guard(settings(2.0));
  const Look look{guard};
  look(10, 0.0, Quality::good);
  guard.output_learned(60.0);
  CHECK(look(13, 60.0, Quality::good) == hal::Reason::none);
  CHECK(look(14, 63.0, Quality::good) == hal::Reason::frozen);
  // Learnt while there is nothing to see, it counts once.
  look(15, 60.0, Quality::bad);
  guard.output_learned(-40.0);
  CHECK(look(16, 20.0, Quality::good) == hal::Reason::none);
}

TEST_CASE("a value that the backend holds is not frozen, nor is the one that follows it") {
  PvGuard guard(settings(2.0));
  const Look look{guard};
  look(10, 50.0, Quality::good);
  // A current between the limits of NE 43 while the safe action moves the output.
  look(11, 50.0, Quality::uncertain);
  CHECK(look(30, 20.0, Quality::uncertain) == hal::Reason::out_of_range);
  CHECK(look(31, 20.0, Quality::good) == hal::Reason::none);
  CHECK(look(32, 15.0, Quality::good) == hal::Reason::none);  // 2 s seen in all
  CHECK(look(33, 15.0, Quality::good) == hal::Reason::frozen);
}

TEST_CASE("what passes while PV is bad does not make it frozen; what it stood still before does") {
  PvGuard guard(settings(2.0));
  const Look look{guard};
  look(10, 50.0, Quality::good);
  look(11, 50.0, Quality::bad);
  look(60, 20.0, Quality::bad);  // the safe action has moved the output
  CHECK(look(61, 20.0, Quality::good) == hal::Reason::none);
  CHECK(look(62, 15.0, Quality::good) == hal::Reason::none);  // 2 s seen in all
  CHECK(look(63, 15.0, Quality::good) == hal::Reason::frozen);
}

}  // namespace
}  // namespace loopwarden::daemon::rt::pv_guard_test

// SPDX-License-Identifier: Apache-2.0
#include "daemon/rt/pv_guard.hpp"

#include <catch2/catch.hpp>

#include <limits>

namespace loopwarden::daemon::rt::pv_guard_test {
namespace {

using hal::Quality;
using hal::Reason;

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

TEST_CASE("a fresh value in range is unchanged") {
  PvGuard guard(settings());
  CHECK(guard.check(good(5.0, kSecond), {.value = 50.0}, kSecond).quality == hal::Quality::good);
  CHECK(guard.check(good(10.5, kSecond), {.value = 50.0}, kSecond).quality == hal::Quality::good);
  CHECK(guard.check(good(-0.5, kSecond), {.value = 50.0}, kSecond).quality == hal::Quality::good);
}

TEST_CASE("age, range and values that are no numbers make a value bad, each with its reason") {
  PvGuard guard(settings());
  const auto reason = [&](double value, std::int64_t age_ns) {
    const hal::Sample s = guard.check(good(value, kSecond), {.value = 50.0}, kSecond + age_ns);
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
  CHECK(guard.check(sample, {.value = 50.0}, kSecond).reason == hal::Reason::link_lost);
  sample.quality = hal::Quality::uncertain;
  CHECK(guard.check(sample, {.value = 50.0}, kSecond).quality == hal::Quality::uncertain);
}

// The guard with PV and CO of one loop.
struct Looks {
  explicit Looks(double frozen_after_s = 10.0) : guard(settings(frozen_after_s)) {}

  Reason at(std::int64_t second, double pv, double co, Quality quality = Quality::good) {
    hal::Sample sample = good(pv, second * kSecond);
    sample.quality = quality;
    if (quality == Quality::uncertain) sample.reason = Reason::out_of_range;
    return guard.check(sample, {.value = co, .automatic = automatic}, second * kSecond).reason;
  }
  // Steps every second up to and without `to`; returns the last reason.
  Reason each(std::int64_t from, std::int64_t to, double pv, double co) {
    Reason last = Reason::none;
    for (std::int64_t s = from; s < to; ++s) last = at(s, pv, co);
    return last;
  }

  PvGuard guard;
  bool automatic = true;
};

TEST_CASE("a PV that repeats one value after CO has moved by a tenth of its span is frozen") {
  Looks looks;
  CHECK(looks.each(0, 60, 5.0, 50.0) == Reason::none);  // CO is constant as well
  CHECK(looks.each(60, 90, 5.0, 59.9) == Reason::none);
  CHECK(looks.each(90, 101, 5.0, 60.0) == Reason::none);  // PV has ten seconds to answer
  CHECK(looks.at(101, 5.0, 60.0) == Reason::frozen);
  CHECK(looks.at(102, 5.0, 50.0) == Reason::frozen);  // CO back: still frozen
  CHECK(looks.guard.check(good(5.0, 103 * kSecond), {.value = 50.0}, 103 * kSecond).quality ==
        Quality::uncertain);
  CHECK(looks.at(104, 5.001, 50.0) == Reason::none);
}

TEST_CASE("CO that swings about one value has moved from its lowest to its highest") {
  Looks looks;
  looks.at(0, 5.0, 50.0);
  looks.at(1, 5.0, 55.0);
  looks.at(2, 5.0, 45.0);
  CHECK(looks.each(3, 13, 5.0, 50.0) == Reason::none);
  CHECK(looks.at(13, 5.0, 50.0) == Reason::frozen);
}

TEST_CASE("without a configured time PV is not checked for freezing") {
  Looks looks(0.0);
  looks.at(0, 5.0, 0.0);
  CHECK(looks.each(1, 5000, 5.0, 100.0) == Reason::none);
}

TEST_CASE("a slow process that answers in time is not frozen") {
  Looks looks;
  double co = 40.0;
  for (std::int64_t s = 0; s < 3000; ++s) {
    if (s % 100 == 0) co = co > 50.0 ? 40.0 : 60.0;
    // Dead time 8 s, then PV changes each second.
    const double pv = s % 100 < 8 ? 5.0 : 5.0 + 0.01 * static_cast<double>(s % 100);
    INFO("second " << s);
    REQUIRE(looks.at(s, pv, co) == Reason::none);
  }
}

TEST_CASE("a PV of coarse resolution, or reported on change, has three times its usual pause") {
  Looks looks;
  // A new value each 40 s, while CO drifts by 3 %/min.
  const auto co_at = [](std::int64_t s) { return 20.0 + 0.05 * static_cast<double>(s % 1000); };
  for (std::int64_t s = 0; s < 2000; ++s) {
    INFO("second " << s);
    REQUIRE(looks.at(s, 4.0 + 0.1 * static_cast<double>((s / 40) % 3), co_at(s)) == Reason::none);
  }
  // If it then repeats one value for longer, it is frozen.
  looks.at(2000, 4.7, 50.0);
  CHECK(looks.each(2001, 2100, 4.7, 70.0) == Reason::none);
  CHECK(looks.each(2100, 2130, 4.7, 70.0) == Reason::frozen);
}

TEST_CASE("one long pause in the past does not delay the check of a PV that changes often") {
  Looks looks;
  looks.each(0, 5000, 5.0, 50.0);  // out of service
  for (std::int64_t s = 5000; s < 6000; ++s) looks.at(s, s % 2 == 0 ? 5.1 : 5.2, 50.0);
  looks.at(6000, 5.3, 50.0);
  CHECK(looks.each(6001, 6012, 5.3, 70.0) == Reason::none);
  CHECK(looks.at(6012, 5.3, 70.0) == Reason::frozen);
}

TEST_CASE("in manual no PV becomes frozen, and movement of CO there does not count") {
  Looks looks;
  looks.at(0, 5.0, 20.0);
  looks.automatic = false;
  CHECK(looks.each(1, 500, 5.0, 80.0) == Reason::none);
  looks.automatic = true;
  CHECK(looks.each(500, 900, 5.0, 80.0) == Reason::none);
  CHECK(looks.each(900, 920, 5.0, 60.0) == Reason::frozen);
  // A PV that is frozen stays so in manual.
  looks.automatic = false;
  CHECK(looks.at(920, 5.0, 60.0) == Reason::frozen);
  CHECK(looks.at(921, 5.1, 60.0) == Reason::none);
}

TEST_CASE(
    "a PV at an end of its range is not frozen: no flow, or more than the transmitter shows") {
  const double end = GENERATE(0.0, -0.3, 0.05, 9.95, 10.2);
  Looks looks;
  looks.at(0, end, 0.0);
  CHECK(looks.each(1, 1000, end, 100.0) == Reason::none);
  hal::Sample clipped = good(5.0, 2000 * kSecond);
  clipped.limit = hal::Limit::high;
  Looks device;
  for (const std::int64_t s : {0, 1, 100, 200}) {
    clipped.time_ns = s * kSecond;
    CHECK(device.guard.check(clipped, {.value = s > 0 ? 90.0 : 10.0}, s * kSecond).reason ==
          Reason::none);
  }
}

TEST_CASE("an unknown CO has not moved") {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  Looks looks;
  looks.each(0, 100, 5.0, kNan);
  CHECK(looks.each(100, 200, 5.0, 60.0) == Reason::none);
  looks.each(200, 210, 5.0, kNan);
  CHECK(looks.each(210, 300, 5.0, 60.0) == Reason::none);
  CHECK(looks.each(300, 320, 5.0, 72.0) == Reason::frozen);
}

TEST_CASE("the first value is not frozen, whatever its size and the output") {
  Looks looks(2.0);
  // A flow below the cut-off of its transmitter reads exactly 0.
  CHECK(looks.at(100, 0.0, 50.0) == Reason::none);
}

TEST_CASE("an output that is learnt has not moved; one that moves from there has") {
  Looks looks(2.0);
  looks.at(10, 5.0, 0.0);
  looks.guard.output_learned(60.0);
  CHECK(looks.each(13, 20, 5.0, 60.0) == Reason::none);
  CHECK(looks.each(20, 24, 5.0, 72.0) == Reason::frozen);
  // A position that is learnt while PV is not visible counts once.
  looks.at(24, 5.1, 72.0);
  looks.at(25, 5.1, 72.0, Quality::bad);
  looks.guard.output_learned(-40.0);
  CHECK(looks.each(26, 40, 5.1, 32.0) == Reason::none);
}

TEST_CASE("time in which PV is bad or held by the backend does not make it frozen") {
  const Quality unseen = GENERATE(Quality::bad, Quality::uncertain);
  Looks looks(2.0);
  looks.at(10, 5.0, 50.0);
  looks.at(11, 5.0, 50.0, unseen);
  looks.at(30, 5.0, 20.0, unseen);  // the safe action has moved the output
  CHECK(looks.each(31, 50, 5.0, 20.0) == Reason::none);
  CHECK(looks.at(50, 5.0, 8.0) == Reason::none);
  CHECK(looks.at(51, 5.0, 8.0, unseen) != Reason::frozen);
  CHECK(looks.at(90, 5.0, 8.0, unseen) != Reason::frozen);
  CHECK(looks.at(91, 5.0, 8.0) == Reason::none);
  CHECK(looks.at(92, 5.0, 8.0) == Reason::none);  // 2 s observed in all
  CHECK(looks.at(93, 5.0, 8.0) == Reason::frozen);
}

TEST_CASE("codes for no value are out of the range of every signal") {
  const hal::PvCheckSettings pv = settings();  // 0 to 10
  control::PidSettings pid;
  pid.output_low = 0.0;
  pid.output_high = 100.0;
  constexpr double kMax = std::numeric_limits<float>::max();
  for (const double code : {kMax, -kMax, 1e38, 9.96921e36, 32767.0, -32768.0, 65535.0, 6553.5,
                            327.67, -9999.0, -999.25, 2147483647.0, 1e20}) {
    CHECK(checked_as_pv(good(code, 0), pv).reason == Reason::out_of_range);
    CHECK(checked_as_output(good(code, 0), pv, pid).reason == Reason::out_of_range);
    CHECK(checked_as_output(good(code, 0), pv, pid).quality == Quality::bad);
  }
  for (const double code :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    CHECK(checked_as_pv(good(code, 0), pv).reason == Reason::not_finite);
    CHECK(checked_as_output(good(code, 0), pv, pid).reason == Reason::not_finite);
  }
  CHECK(checked_as_pv(good(10.5, 0), pv).quality == Quality::good);
  CHECK(checked_as_output(good(-4.9, 0), pv, pid).quality == Quality::good);
  CHECK(checked_as_output(good(105.1, 0), pv, pid).quality == Quality::bad);
  hal::PvCheckSettings strict = pv;
  strict.range_margin = 0.0;
  CHECK(checked_as_pv(good(10.01, 0), strict).quality == Quality::bad);
  CHECK(checked_as_output(good(-1.0, 0), strict, pid).quality == Quality::good);
  // A code inside the range is a value.
  pid.output_high = 65535.0;
  CHECK(checked_as_output(good(65535.0, 0), pv, pid).quality == Quality::good);
}

}  // namespace
}  // namespace loopwarden::daemon::rt::pv_guard_test

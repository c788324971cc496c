// SPDX-License-Identifier: Apache-2.0
#include "model/alarm/limit_watch.hpp"

#include <catch2/catch.hpp>
#include <limits>

#include "tests/support/property.hpp"

namespace limit_watch_test {

namespace property = loopwarden::tests::property;
using namespace loopwarden;
using namespace loopwarden::alarm;
using K = AlarmKind;

namespace {

constexpr double kPeriod_s = 0.1;
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

LimitSettings settings() {
  LimitSettings all;
  all.at(K::deviation) = {2.0, 0.5};
  all.at(K::pv_high_high) = {95.0, 1.0};
  all.at(K::pv_high) = {80.0, 1.0};
  all.at(K::pv_low) = {20.0, 1.0};
  all.at(K::pv_low_low) = {5.0, 1.0};
  all.at(K::rate_of_change) = {0.5, 0.05};
  all.settle_s = 30.0;
  return all;
}

struct Loop {
  LimitWatch watch{kPeriod_s, settings()};
  std::uint64_t next = 1;
  void run(double seconds, double sp, double pv, bool automatic = true) {
    const auto cycles = static_cast<std::uint64_t>(seconds / kPeriod_s + 0.5);
    for (std::uint64_t i = 0; i < cycles; ++i) watch.add(next++, sp, pv, automatic);
  }
};

}  // namespace

TEST_CASE("PV is beyond a limit, and within it once it is the dead band inside",
          "[monitor][limit]") {
  Loop loop;
  const auto at = [&](K kind, double pv, bool was) {
    loop.run(0.1, 50.0, pv);
    return loop.watch.beyond(kind, was);
  };
  CHECK(at(K::pv_high, 80.0, false) == false);
  CHECK(at(K::pv_high, 80.1, false) == true);
  CHECK(at(K::pv_high, 79.1, true) == true);
  CHECK(at(K::pv_high, 78.9, true) == false);
  CHECK(at(K::pv_low, 19.9, false) == true);
  CHECK(at(K::pv_low, 20.9, true) == true);
  CHECK(at(K::pv_low, 21.1, true) == false);
  CHECK(at(K::pv_high_high, 90.0, false) == false);
  CHECK(at(K::pv_low_low, 4.0, false) == true);
  CHECK_FALSE(at(K::pv_low_low, kNone, true));
}

TEST_CASE("noise that is smaller than the dead band raises no alarm twice", "[monitor][limit]") {
  property::for_all("dead band", 100, [] {
    LimitSettings all;
    const double band = property::number(0.01, 10.0);
    all.at(K::pv_high) = {50.0, band};
    LimitWatch watch(kPeriod_s, all);
    const double centre = 50.0 + property::number(-20.0, 20.0);
    bool was = false;
    int times = 0;
    for (std::uint64_t i = 1; i < 500; ++i) {
      watch.add(i, 50.0, centre + property::number(-0.499, 0.499) * band, true);
      const bool now = *watch.beyond(K::pv_high, was);
      times += now && !was ? 1 : 0;
      was = now;
    }
    property::require(times <= 1, "it came twice");
  });
}

TEST_CASE("a deviation is off in manual, while SP moves, and for a while after both",
          "[monitor][limit]") {
  Loop loop;
  CHECK(loop.watch.rests());
  loop.run(30.0, 50.0, 40.0);
  CHECK(loop.watch.rests());
  CHECK(loop.watch.beyond(K::deviation, true) == false);
  loop.run(0.1, 50.0, 40.0);
  CHECK_FALSE(loop.watch.rests());
  CHECK(loop.watch.beyond(K::deviation, false) == true);
  SECTION("manual") {
    loop.run(5.0, 50.0, 40.0, false);
    CHECK(loop.watch.rests());
    loop.run(29.9, 50.0, 40.0);
    CHECK(loop.watch.rests());
    loop.run(0.2, 50.0, 40.0);
    CHECK_FALSE(loop.watch.rests());
  }
  SECTION("a ramp, however slow its steps") {
    for (int i = 0; i < 100; ++i) {
      loop.run(1.0, 50.0 + 0.05 * i, 40.0);
      if (i > 4) CHECK(loop.watch.rests());
    }
    loop.run(30.0, 55.0, 40.0);
    CHECK_FALSE(loop.watch.rests());
  }
  SECTION("noise of a set point that is read is no move") {
    for (int i = 0; i < 100; ++i) loop.run(0.1, i % 2 == 0 ? 50.05 : 49.95, 40.0);
    CHECK_FALSE(loop.watch.rests());
  }
  SECTION("an unknown set point raises no deviation") {
    loop.run(1.0, kNone, 40.0);
    CHECK_FALSE(loop.watch.beyond(K::deviation, false));
  }
}

TEST_CASE("the rate of change is the slope of a ramp, and restarts after a bad PV",
          "[monitor][limit]") {
  Loop loop;
  const auto ramp = [&](double slope, double seconds) {
    const double from = 10.0;
    for (double t = 0.0; t < seconds; t += kPeriod_s) {
      loop.watch.add(loop.next++, 50.0, from + slope * t, true);
    }
    return loop.watch.beyond(K::rate_of_change, false);
  };
  CHECK(ramp(0.49, 100.0) == false);
  loop.run(1.0, 50.0, kNone);
  CHECK_FALSE(loop.watch.beyond(K::rate_of_change, false));
  CHECK(ramp(-0.51, 100.0) == true);
  loop.run(1.0, 50.0, kNone);
  loop.run(0.1, 50.0, 90.0);
  CHECK(loop.watch.beyond(K::rate_of_change, false) == false);
}

TEST_CASE("the rate of change is in time, whatever cycles are missing", "[monitor][limit]") {
  Loop loop;
  for (int i = 0; i < 100; ++i) {
    loop.watch.add(loop.next, 50.0, 0.045 * static_cast<double>(loop.next), true);  // 0.45 /s
    loop.next += 1 + static_cast<std::uint64_t>(i) % 30;
  }
  CHECK(loop.watch.beyond(K::rate_of_change, false) == false);
}

}  // namespace limit_watch_test

// SPDX-License-Identifier: Apache-2.0
#include "workbench/setup/silence.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <limits>

namespace loopwarden::workbench::setup::silence_test {
namespace {

constexpr double kBefore = 60.0;
constexpr double kHome = 0.0;

// A device with a time-out of 10 s, written for 1 s more and observed for 16 s.
Silence seen(const std::function<double(double time_s)>& value) {
  Silence silence({.before = kBefore, .least = 2.0, .written_s = 1.0, .timeout_s = 10.0});
  for (int i = 0; i <= 160; ++i) silence.see(0.1 * i, value(0.1 * i));
  return silence;
}

}  // namespace

TEST_CASE("a watchdog's move starts after its time-out, and lasts", "[setup]") {
  const Silence silence = seen([](double t) { return t < 11.0 ? kBefore : kHome; });
  CHECK(silence.why_not().empty());
  CHECK(silence.moved_after_s().value() == Approx(11.0).margin(0.11));
}

TEST_CASE("other moves are not accepted as a watchdog's", "[setup]") {
  const auto why = [](const std::function<double(double)>& value) { return seen(value).why_not(); };
  const auto none = Catch::Contains("did not move");
  CHECK_THAT(why([](double) { return kBefore; }), none);
  // One wrong reading, at any time.
  for (const double at : {0.5, 7.0, 12.0, 16.0}) {
    CHECK_THAT(why([&](double t) { return std::abs(t - at) < 0.05 ? kHome : kBefore; }), none);
  }
  CHECK_THAT(why([](double t) { return t > 11.0 && t < 13.0 ? kHome : kBefore; }), none);
  // It was already moving, or another cause moves it.
  CHECK_THAT(why([](double t) { return t < 0.5 ? kBefore : kHome; }), Catch::Contains("too soon"));
  CHECK_THAT(why([](double t) { return t < 5.5 ? kBefore : kHome; }), Catch::Contains("too soon"));
  CHECK_THAT(
      why([](double t) { return t < 11.0 ? kBefore : std::numeric_limits<double>::quiet_NaN(); }),
      Catch::Contains("not known at the end"));
}

}  // namespace loopwarden::workbench::setup::silence_test

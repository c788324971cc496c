// SPDX-License-Identifier: Apache-2.0
#include "model/effects/hysteresis/hysteresis_width.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <vector>

#include "model/effects/backlash/backlash.hpp"

namespace hysteresis_width_test {

using namespace loopwarden;
using namespace loopwarden::effects;

namespace {

double sweep(HysteresisWidth& hysteresis, double from, double to) {
  double x = 0.0;
  for (int k = 1; k <= 1000; ++k) x = hysteresis.step(from + (to - from) * k / 1000.0);
  return x;
}

}  // namespace

TEST_CASE("after a large reversal the branches are one width apart", "[plant][hysteresis]") {
  const double width = GENERATE(0.5, 2.0, 6.0);
  HysteresisWidth hysteresis(width);
  CHECK(hysteresis.reset(0.0) == 0.0);
  sweep(hysteresis, 0.0, 90.0);
  sweep(hysteresis, 90.0, 10.0);
  const double rising = sweep(hysteresis, 10.0, 50.0);
  sweep(hysteresis, 50.0, 90.0);
  const double falling = sweep(hysteresis, 90.0, 50.0);
  CHECK(falling - rising == Approx(width));
  CHECK((falling + rising) / 2.0 == Approx(50.0));
}

TEST_CASE("the loop opens gradually and a minor loop closes", "[plant][hysteresis]") {
  HysteresisWidth hysteresis(4.0);
  hysteresis.reset(0.0);
  sweep(hysteresis, 0.0, 50.0);
  const double top = sweep(hysteresis, 50.0, 60.0);
  // Just after the reversal only the narrowest plays have reversed: the slope is below 1 and rises.
  const double at_59 = sweep(hysteresis, 60.0, 59.0);
  const double at_58 = sweep(hysteresis, 59.0, 58.0);
  CHECK(at_59 < top);
  CHECK(top - at_59 < 0.25);
  CHECK(at_59 - at_58 > top - at_59);
  // Back to its turning point: it remembers that point (no drift of a minor loop).
  CHECK(sweep(hysteresis, 58.0, 60.0) == Approx(top));
}

TEST_CASE("it is the mean of twelve plays", "[plant][hysteresis]") {
  HysteresisWidth hysteresis(3.0);
  hysteresis.reset(0.0);
  std::vector<Backlash> plays;
  for (int i = 0; i < 12; ++i) plays.emplace_back(2.0 * (i + 0.5) * 3.0 / 12.0);
  for (int k = 0; k < 2000; ++k) {
    const double u = 8.0 * std::sin(0.01 * k) + 2.0 * std::sin(0.137 * k);
    double mean = 0.0;
    for (Backlash& play : plays) mean += play.step(u) / 12.0;
    REQUIRE(hysteresis.step(u) == Approx(mean).margin(1e-12));
  }
}

TEST_CASE("with a knee of 1 it is backlash", "[plant][hysteresis]") {
  HysteresisWidth hysteresis(3.0, 1.0);
  Backlash backlash(3.0);
  hysteresis.reset(0.0);
  backlash.reset(0.0);
  for (int k = 0; k < 500; ++k) {
    const double u = 8.0 * std::sin(0.05 * k);
    REQUIRE(hysteresis.step(u) == Approx(backlash.step(u)).margin(1e-12));
  }
}

TEST_CASE("the branches are a width apart, whatever the knee", "[plant][hysteresis]") {
  const double knee = GENERATE(-4.0, -1.0, 0.0, 0.5, 1.0);
  CAPTURE(knee);
  HysteresisWidth hysteresis(2.0, knee);
  hysteresis.reset(0.0);
  for (double u = 0.0; u <= 50.0; u += 0.5) hysteresis.step(u);
  const double rising = hysteresis.step(50.0);
  for (double u = 50.0; u <= 100.0; u += 0.5) hysteresis.step(u);
  for (double u = 100.0; u >= 50.0; u -= 0.5) hysteresis.step(u);
  CHECK(hysteresis.step(50.0) - rising == Approx(2.0));
}

TEST_CASE("severity scales the width", "[plant][hysteresis]") {
  HysteresisWidth hysteresis(4.0);
  hysteresis.reset(0.0);
  hysteresis.set_severity(0.5);
  CHECK(sweep(hysteresis, 0.0, 50.0) == Approx(49.0));
  hysteresis.set_severity(0.0);
  CHECK(hysteresis.step(12.34) == Approx(12.34).epsilon(1e-15));
}

TEST_CASE("a CO that is not a number keeps the hysteresis", "[plant][hysteresis]") {
  HysteresisWidth hysteresis(4.0);
  hysteresis.reset(5.0);
  CHECK(hysteresis.step(std::numeric_limits<double>::quiet_NaN()) == 5.0);
}

}  // namespace hysteresis_width_test

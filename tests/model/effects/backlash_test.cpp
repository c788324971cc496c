// SPDX-License-Identifier: Apache-2.0
#include "model/effects/backlash/backlash.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

namespace backlash_test {

using loopwarden::effects::Backlash;

TEST_CASE("at rest the play is centred", "[plant][backlash]") {
  Backlash backlash(2.0);
  CHECK(backlash.reset(50.0) == 50.0);
  CHECK(backlash.step(50.0) == 50.0);
}

TEST_CASE("a reversal loses the whole deadband, then the stem follows one to one",
          "[plant][backlash]") {
  Backlash backlash(2.0);
  backlash.reset(50.0);
  CHECK(backlash.step(60.0) == 59.0);  // half the play lost at first
  CHECK(backlash.step(59.0) == 59.0);
  CHECK(backlash.step(58.0) == 59.0);  // all of it taken up
  CHECK(backlash.step(57.5) == 58.5);
  CHECK(backlash.step(40.0) == 41.0);
  CHECK(backlash.step(41.9) == 41.0);
  CHECK(backlash.step(42.5) == 41.5);
}

TEST_CASE("the stem never leaves the play, whatever the path", "[plant][backlash]") {
  Backlash backlash(3.0);
  backlash.reset(0.0);
  double last = 0.0;
  for (int k = 0; k < 1000; ++k) {
    const double u = 10.0 * std::sin(0.05 * k) + 4.0 * std::sin(0.31 * k);
    const double x = backlash.step(u);
    REQUIRE(std::abs(u - x) <= 1.5 + 1e-12);
    // It moves only when the command pushes it, to the very edge of the play.
    if (x != last) REQUIRE(std::abs(u - x) == Approx(1.5));
    last = x;
  }
}

TEST_CASE("severity scales the play", "[plant][backlash]") {
  Backlash backlash(2.0);
  backlash.reset(50.0);
  backlash.set_severity(0.5);
  CHECK(backlash.step(60.0) == 59.5);
  backlash.set_severity(0.0);
  CHECK(backlash.step(43.21) == 43.21);
}

TEST_CASE("a CO that is not a number keeps the stem", "[plant][backlash]") {
  Backlash backlash(2.0);
  backlash.reset(50.0);
  CHECK(backlash.step(std::numeric_limits<double>::quiet_NaN()) == 50.0);
  CHECK(backlash.step(60.0) == 59.0);
}

}  // namespace backlash_test

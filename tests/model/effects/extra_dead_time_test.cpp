// SPDX-License-Identifier: Apache-2.0
#include "model/effects/extra_dead_time/extra_dead_time.hpp"

#include <catch2/catch.hpp>
#include <cmath>

namespace extra_dead_time_test {

using loopwarden::effects::ExtraDeadTime;

TEST_CASE("dead time delays a ramp by exactly its length", "[plant][dead_time]") {
  const double seconds = GENERATE(0.0, 0.04, 0.1, 0.3, 1.0, 1.27, 2.5);
  CAPTURE(seconds);
  ExtraDeadTime delay(seconds, 0.1);
  CHECK(delay.reset(0.0) == 0.0);
  for (int k = 0; k < 100; ++k) {
    const double t = 0.1 * k;
    const double x = delay.step(2.0 * t);
    if (t > seconds + 0.1) REQUIRE(x == Approx(2.0 * (t - seconds)).margin(1e-9));
    if (t < seconds - 0.1) REQUIRE(x == 0.0);
  }
}

TEST_CASE("a constant stays what it was at reset", "[plant][dead_time]") {
  ExtraDeadTime delay(1.27, 0.1);
  delay.step(3.0);
  CHECK(delay.reset(7.0) == 7.0);
  for (int k = 0; k < 30; ++k) REQUIRE(delay.step(7.0) == Approx(7.0).epsilon(1e-15));
}

TEST_CASE("severity scales the dead time", "[plant][dead_time]") {
  ExtraDeadTime delay(2.0, 0.1);
  delay.reset(0.0);
  for (int k = 0; k <= 50; ++k) delay.step(k);
  delay.set_severity(0.5);
  CHECK(delay.step(51.0) == Approx(41.0));
  delay.set_severity(0.0);
  CHECK(delay.step(52.0) == 52.0);
}

}  // namespace extra_dead_time_test

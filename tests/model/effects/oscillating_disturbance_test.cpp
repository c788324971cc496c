// SPDX-License-Identifier: Apache-2.0
#include "model/effects/oscillating_disturbance/oscillating_disturbance.hpp"

#include <catch2/catch.hpp>
#include <numbers>

namespace oscillating_disturbance_test {

using loopwarden::effects::OscillatingDisturbance;

TEST_CASE("the disturbance is a sine of the record's time", "[plant][disturbance]") {
  OscillatingDisturbance sine(0.4, 20.0, 0.0);
  CHECK(sine.reset(5.0) == 5.0);
  CHECK(sine.step(5.0, 0.0) == 5.0);
  CHECK(sine.step(5.0, 5.0) == Approx(5.4));
  CHECK(sine.step(5.0, 10.0) == Approx(5.0));
  CHECK(sine.step(6.0, 15.0) == Approx(5.6));
  CHECK(sine.step(5.0, 25.0) == Approx(5.4));
  sine.set_severity(0.5);
  CHECK(sine.step(5.0, 5.0) == Approx(5.2));
  sine.set_severity(0.0);
  CHECK(sine.step(5.0, 5.0) == 5.0);
}

TEST_CASE("it begins at its phase", "[plant][disturbance]") {
  OscillatingDisturbance sine(0.4, 20.0, std::numbers::pi / 2.0);
  CHECK(sine.step(5.0, 0.0) == Approx(5.4));
}

}  // namespace oscillating_disturbance_test

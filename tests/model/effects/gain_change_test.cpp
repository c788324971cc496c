// SPDX-License-Identifier: Apache-2.0
#include "model/effects/gain_change/gain_change.hpp"

#include <catch2/catch.hpp>

namespace gain_change_test {

using loopwarden::effects::GainChange;

TEST_CASE("the factor multiplies, and fades in from 1", "[plant][gain]") {
  GainChange gain(1.6);
  CHECK(gain.reset(5.0) == Approx(8.0));
  CHECK(gain.step(-2.0) == Approx(-3.2));
  gain.set_severity(0.5);
  CHECK(gain.step(5.0) == Approx(6.5));
  gain.set_severity(0.0);
  CHECK(gain.step(5.0) == 5.0);
}

}  // namespace gain_change_test

// SPDX-License-Identifier: Apache-2.0
#include "model/effects/hysteresis/hysteresis_offset.hpp"

#include <catch2/catch.hpp>

namespace hysteresis_offset_test {

using loopwarden::effects::HysteresisOffset;

TEST_CASE("the offset is there while the output falls", "[plant][hysteresis]") {
  HysteresisOffset hysteresis(0.7);  // as in the thesis
  CHECK(hysteresis.reset(5.0) == 5.0);
  CHECK(hysteresis.step(5.0) == 5.0);
  CHECK(hysteresis.step(5.5) == 5.5);
  CHECK(hysteresis.step(5.4) == Approx(6.1));
  CHECK(hysteresis.step(5.4) == Approx(6.1));  // a constant output keeps the branch
  CHECK(hysteresis.step(5.3) == Approx(6.0));
  CHECK(hysteresis.step(5.31) == 5.31);
  CHECK(hysteresis.step(5.31) == 5.31);
}

TEST_CASE("it may be negative, and fades in with severity", "[plant][hysteresis]") {
  HysteresisOffset hysteresis(-0.4);
  hysteresis.reset(5.0);
  CHECK(hysteresis.step(4.0) == Approx(3.6));
  hysteresis.set_severity(0.5);
  CHECK(hysteresis.step(3.0) == Approx(2.8));
  hysteresis.set_severity(0.0);
  CHECK(hysteresis.step(2.0) == 2.0);
}

}  // namespace hysteresis_offset_test

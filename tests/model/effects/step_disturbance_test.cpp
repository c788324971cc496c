// SPDX-License-Identifier: Apache-2.0
#include "model/effects/step_disturbance/step_disturbance.hpp"

#include <catch2/catch.hpp>

namespace step_disturbance_test {

using loopwarden::effects::StepDisturbance;

TEST_CASE("the load starts at its time and stays", "[plant][disturbance]") {
  StepDisturbance load(-0.8, 30.0);
  CHECK(load.reset(5.0) == 5.0);
  CHECK(load.step(5.0, 29.9) == 5.0);
  CHECK(load.step(5.0, 30.0) == Approx(4.2));
  CHECK(load.step(6.0, 1e4) == Approx(5.2));
  load.set_severity(0.5);
  CHECK(load.step(5.0, 40.0) == Approx(4.6));
  load.set_severity(0.0);
  CHECK(load.step(5.0, 40.0) == 5.0);
}

}  // namespace step_disturbance_test

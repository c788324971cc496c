// SPDX-License-Identifier: Apache-2.0
#include "model/effects/held_measurement/held_measurement.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "tests/model/gap/gap_support.hpp"

namespace held_measurement_test {

using namespace loopwarden;

TEST_CASE("the value is that of the last multiple of the interval", "[effects][held_measurement]") {
  effects::HeldMeasurement held(0.7);
  held.reset(0.0);
  for (int k = 1; k < 2000; ++k) {
    const double t = 0.1 * k;
    REQUIRE(held.step(10.0 * k, t) == 10.0 * (k / 7 * 7));
  }
  held.set_severity(0.0);
  CHECK(held.step(3.0, 201.3) == 3.0);
}

TEST_CASE("renewals may begin later than the record", "[effects][held_measurement]") {
  effects::HeldMeasurement held(0.7, 0.3);
  held.reset(5.0);
  CHECK(held.step(1.0, 0.2) == 5.0);
  CHECK(held.step(2.0, 0.3) == 2.0);
  CHECK(held.step(3.0, 0.9) == 2.0);
  CHECK(held.step(4.0, 1.0) == 4.0);
}

TEST_CASE("a held reading is exactly flat between renewals, though the transmitter has noise",
          "[effects][held_measurement]") {
  plant::LoopModel model = test::believed_model();
  model.transmitter.noise = 0.05;
  plant::LoopModel slow = model;
  slow.transmitter_effects = {{"held_measurement", {{"interval", 2.0}}}};
  plant::Plant at_once(model, 3);
  plant::Plant renewed(slow, 3);
  at_once.reset(4.0);
  renewed.reset(4.0);
  double held = renewed.process_variable();
  CHECK(held == at_once.process_variable());
  for (int k = 1; k < 600; ++k) {
    const double co = 4.0 + 2.0 * std::sin(0.02 * k);
    const double now = at_once.step(co);
    if (k % 20 == 0) held = now;
    REQUIRE(renewed.step(co) == held);
  }
}

}  // namespace held_measurement_test

// SPDX-License-Identifier: Apache-2.0
#include "model/control/valve_friction.hpp"

#include <catch2/catch.hpp>

namespace valve_friction_test {

using namespace loopwarden::control;

namespace {

const PlannedMovesSettings kGiven{.s = 0.6, .j = 0.2, .s_high = 0.9, .j_high = 0.3};

}  // namespace

TEST_CASE("the given s and j are the first estimate of the friction", "[control][planned_moves]") {
  const ValveFriction friction(kGiven);
  CHECK(friction.s() == Approx(0.6));
  CHECK(friction.j() == Approx(0.2));
  CHECK(friction.breakaway(1.0) == Approx(0.4));
  CHECK(friction.breakaway(-1.0) == Approx(-0.4));
  CHECK(friction.kinetic_offset(1.0) == Approx(0.2));
  CHECK(friction.centre() == Approx(0.0));
}

TEST_CASE("slips that are read back move the estimate to the valve's friction",
          "[control][planned_moves]") {
  ValveFriction friction(kGiven);
  for (int k = 0; k < 40; ++k) {
    friction.learn_slip(1.0, 0.5, 0.25);
    friction.learn_slip(-1.0, -0.4, -0.15);
  }
  CHECK(friction.j() == Approx(0.25).margin(0.01));
  CHECK(friction.s() == Approx(0.65).margin(0.01));
  CHECK(friction.centre() == Approx(0.05).margin(0.01));
}

TEST_CASE("an estimate of the friction stays near its given interval", "[control][planned_moves]") {
  ValveFriction friction(kGiven);
  for (int k = 0; k < 40; ++k) friction.learn_slip(1.0, 50.0, 0.25);
  CHECK(friction.s() == Approx(1.6 * 0.9));
  CHECK(friction.j() == Approx(1.6 * 0.3));
}

TEST_CASE("without a read-back the force is that of the interval's high end, and rises",
          "[control][planned_moves]") {
  ValveFriction friction(kGiven);
  CHECK(friction.sure_breakaway(1.0, true) == Approx(0.4));
  CHECK(friction.sure_breakaway(1.0, false) == Approx(0.6));
  CHECK(friction.largest_jump(true) == Approx(0.2));
  CHECK(friction.largest_jump(false) == Approx(0.3));
  for (int k = 0; k < 20; ++k) friction.raise_force();
  CHECK(friction.sure_breakaway(1.0, false) == Approx(1.2));
  CHECK(friction.sure_breakaway(1.0, true) == Approx(0.4));
}

}  // namespace valve_friction_test

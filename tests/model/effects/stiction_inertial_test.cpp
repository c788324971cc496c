// SPDX-License-Identifier: Apache-2.0
#include "model/effects/stiction/stiction_inertial.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <numbers>

#include "model/effects/catalogue.hpp"
#include "model/effects/positioner_overshoot/positioner_overshoot.hpp"

namespace stiction_inertial_test {

using namespace loopwarden;
using namespace loopwarden::effects;

namespace {

constexpr double kPeriod_s = 0.1;
constexpr StictionParameters kFriction{1.0, 0.4};  // fs 0.7, fd 0.3 CO units

}  // namespace

TEST_CASE("without friction it is the second-order actuator", "[plant][stiction]") {
  StictionInertial valve({0.0, 0.0}, {5.0, 0.1}, kPeriod_s);
  PositionerOvershoot actuator(0.1, 5.0, kPeriod_s);
  valve.reset(2.0);
  actuator.reset(2.0);
  for (int k = 0; k < 300; ++k) {
    const double u = 2.0 + (k > 10 ? 1.0 : 0.0) + std::sin(0.03 * k);
    REQUIRE(valve.step(u) == Approx(actuator.step(u)).margin(1e-9));
  }
}

TEST_CASE("it sticks up to the static friction, then slips beyond the moving friction",
          "[plant][stiction]") {
  const double damping = GENERATE(0.1, 0.3, 0.7);
  CAPTURE(damping);
  StictionInertial valve(kFriction, {6.0, damping}, kPeriod_s);
  valve.reset(5.0);
  for (int k = 0; k < 50; ++k) REQUIRE(valve.step(5.699) == 5.0);
  double x = 5.0;
  for (int k = 0; k < 50; ++k) x = valve.step(5.701);
  // From rest at distance fs the stem swings about u - fd with amplitude j, and stops at its
  // reversal.
  const double overshoot =
      std::exp(-damping * std::numbers::pi / std::sqrt(1.0 - damping * damping));
  CHECK(x == Approx(5.701 - 0.3 + 0.4 * overshoot).margin(0.002));
}

TEST_CASE("it agrees with the equation integrated in small steps", "[plant][stiction]") {
  constexpr double kFrequency = 7.0;
  const double damping = GENERATE(0.25, 1.0, 2.5);
  CAPTURE(damping);
  StictionInertial valve(kFriction, {kFrequency, damping}, kPeriod_s);
  valve.reset(5.0);
  double x = 5.0;
  double v = 0.0;
  constexpr int kSteps = 20000;
  const double dt = kPeriod_s / kSteps;
  for (int k = 0; k < 120; ++k) {
    const double u = 5.0 + 2.5 * std::sin(0.11 * k);
    const double exact = valve.step(u);
    for (int i = 0; i < kSteps; ++i) {
      if (v == 0.0 && std::abs(u - x) <= kFriction.static_friction()) break;
      const double side = v != 0.0 ? std::copysign(1.0, v) : std::copysign(1.0, u - x);
      const double next =
          v + dt * (kFrequency * kFrequency * (u - x - side * kFriction.moving_friction()) -
                    2.0 * damping * kFrequency * v);
      v = next * side > 0.0 ? next : 0.0;
      x += dt * v;
    }
    REQUIRE(exact == Approx(x).margin(2e-3));
  }
}

TEST_CASE("overdamped, a slip creeps to where the moving friction holds it", "[plant][stiction]") {
  StictionInertial valve(kFriction, {12.0, 1.5}, kPeriod_s);
  valve.reset(5.0);
  double last = 5.0;
  for (int k = 0; k < 80; ++k) {
    const double x = valve.step(5.701);
    REQUIRE(x >= last);
    last = x;
  }
  CHECK(last == Approx(5.701 - 0.3).margin(1e-3));
}

TEST_CASE("at severity 0 the stem follows at once; a CO that is no number keeps the stem",
          "[plant][stiction]") {
  StictionInertial valve(kFriction, {6.0, 0.3}, kPeriod_s);
  valve.reset(5.0);
  valve.set_severity(0.0);
  CHECK(valve.step(7.0) == 7.0);
  CHECK(valve.step(std::numeric_limits<double>::quiet_NaN()) == 7.0);
}

TEST_CASE("a slip ends where the travel ends, and friction holds the stem there",
          "[plant][stiction]") {
  constexpr Travel kTravel{0.0, 10.0};
  const double damping = GENERATE(0.1, 1.5);
  CAPTURE(damping);
  StictionInertial valve(kFriction, {6.0, damping}, kPeriod_s, kTravel);
  StictionInertial endless(kFriction, {6.0, damping}, kPeriod_s);
  double farthest = 0.0;
  valve.reset(7.0);
  endless.reset(7.0);
  for (int k = 0; k < 60; ++k) {
    const double x = valve.step(10.0);
    farthest = std::max(farthest, endless.step(10.0));
    REQUIRE(x <= 10.0);
  }
  if (damping < 1.0) {
    CHECK(farthest > 10.5);
    // Held up to the static friction, as at any other place, then released.
    CHECK(valve.step(9.31) == 10.0);
    double x = 10.0;
    for (int k = 0; k < 20; ++k) x = valve.step(9.29);
    CHECK(x < 9.7);
  }
  valve.reset(0.9);
  for (int k = 0; k < 200; ++k) REQUIRE(valve.step(k < 100 ? 0.0 : 0.5) >= 0.0);
  CHECK(valve.reset(-3.0) == 0.0);
  // Made from a file, its travel is the output's span.
  Effect made = loopwarden::effects::make_effect(
      {"stiction",
       {{"s", 1.0}, {"j", 0.4}, {"natural_frequency", 6.0}, {"damping", 0.1}},
       {{"law", "inertial"}}},
      {kPeriod_s, 0.0, 10.0});
  made.reset(7.0);
  for (int k = 0; k < 60; ++k) REQUIRE(made.step(10.0, k * kPeriod_s) <= 10.0);
}

}  // namespace stiction_inertial_test

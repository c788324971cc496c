// SPDX-License-Identifier: Apache-2.0
#include "model/effects/positioner_overshoot/positioner_overshoot.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "model/effects/catalogue.hpp"

namespace positioner_overshoot_test {

using loopwarden::effects::PositionerOvershoot;
namespace effects = loopwarden::effects;

TEST_CASE("the overshoot of a step is exp(-pi z / sqrt(1 - z^2))", "[plant][overshoot]") {
  const double damping = GENERATE(0.1, 0.3, 0.5, 0.7, 0.9);
  PositionerOvershoot positioner(damping, 2.0, 0.001);
  positioner.reset(10.0);
  double highest = 0.0;
  for (int k = 0; k < 8000; ++k) highest = std::max(highest, positioner.step(30.0));
  const double share = std::exp(-std::numbers::pi * damping / std::sqrt(1.0 - damping * damping));
  CHECK((highest - 30.0) / 20.0 == Approx(share).margin(1e-5));
}

TEST_CASE("the second-order solution agrees with a fine integration", "[plant][overshoot]") {
  constexpr double kDamping = 0.25;
  constexpr double kFrequency = 3.0;  // rad/s
  constexpr double kPeriod = 0.1;     // s
  PositionerOvershoot positioner(kDamping, kFrequency, kPeriod);
  double x = positioner.reset(50.0);
  double v = 0.0;
  for (int k = 1; k < 300; ++k) {
    const double u = 50.0 + 20.0 * std::sin(0.05 * k) + (k % 80 < 40 ? 10.0 : 0.0);
    constexpr int kSteps = 20'000;
    constexpr double kStep = kPeriod / kSteps;
    for (int i = 0; i < kSteps; ++i) {  // semi-implicit Euler
      v += kStep * kFrequency * (kFrequency * (u - x) - 2.0 * kDamping * v);
      x += kStep * v;
    }
    REQUIRE(positioner.step(u) == Approx(x).margin(2e-3));
  }
}

TEST_CASE("a positioner at rest stays so, and severity fades the ringing", "[plant][overshoot]") {
  PositionerOvershoot positioner(0.3, 2.0, 0.1);
  CHECK(positioner.reset(42.0) == 42.0);
  CHECK(positioner.step(42.0) == 42.0);
  PositionerOvershoot half = positioner;
  half.set_severity(0.5);
  CHECK(half.step(60.0) == Approx((60.0 + positioner.step(60.0)) / 2.0));
  half.set_severity(0.0);
  CHECK(half.step(17.0) == 17.0);
}

TEST_CASE("a swing ends where the travel ends", "[plant][overshoot]") {
  constexpr double kDamping = 0.15;
  constexpr double kFrequency = 2.0;
  constexpr double kPeriod = 0.02;
  PositionerOvershoot positioner(kDamping, kFrequency, kPeriod, {0.0, 100.0});
  double x = positioner.reset(60.0);
  double v = 0.0;
  constexpr int kSteps = 2000;
  const double dt = kPeriod / kSteps;
  for (int k = 0; k < 1500; ++k) {
    // without ends it would reach 117 and -51
    const double u = k < 500 ? 95.0 : k < 1000 ? 5.0 : 50.0;
    const double stem = positioner.step(u);
    for (int i = 0; i < kSteps; ++i) {
      v += dt * kFrequency * (kFrequency * (u - x) - 2.0 * kDamping * v);
      x += dt * v;
      if (x > 100.0 || x < 0.0) {
        x = std::clamp(x, 0.0, 100.0);
        v = 0.0;
      }
    }
    REQUIRE(stem >= 0.0);
    REQUIRE(stem <= 100.0);
    REQUIRE(stem == Approx(x).margin(0.5));  // the end is reached within a period, not at its end
  }
  CHECK(positioner.reset(120.0) == 100.0);
  // Made from a file, its travel is the output's span.
  effects::Effect made = effects::make_effect(
      {"positioner_overshoot", {{"damping", kDamping}, {"natural_frequency", kFrequency}}},
      {.sample_time_s = kPeriod, .output_low = 0.0, .output_high = 10.0});
  double highest = made.reset(5.0);
  for (int k = 0; k < 500; ++k) highest = std::max(highest, made.step(9.5, k * kPeriod));
  CHECK(highest == 10.0);
}

}  // namespace positioner_overshoot_test

// SPDX-License-Identifier: Apache-2.0
#include "model/effects/positioner/positioner.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

namespace positioner_test {

using loopwarden::effects::Positioner;

namespace {

constexpr double kPeriod = 0.1;  // s
constexpr double kLow = 0.0;     // V
constexpr double kHigh = 10.0;   // V
const Positioner::Parameters kSlow{.dead_band = 1.0, .gain_per_s = 1.5, .lag_s = 0.3};

double after(Positioner& positioner, double u, int periods) {
  double x = 0.0;
  for (int k = 0; k < periods; ++k) x = positioner.step(u);
  return x;
}

// The equations of the header, integrated in ten thousand Euler steps per period.
struct Euler {
  Positioner::Parameters p;
  double z, x;
  double step(double u) {
    constexpr int kSteps = 10'000;
    constexpr double kStep = kPeriod / kSteps;
    for (int i = 0; i < kSteps; ++i) {
      const double e = u - x;
      const double beyond =
          std::abs(e) > p.dead_band / 2.0 ? e - std::copysign(p.dead_band / 2.0, e) : 0.0;
      const double z_rate = p.gain_per_s * beyond;
      x += kStep / p.lag_s * (z - x);
      z = std::clamp(z + kStep * z_rate, kLow, kHigh);
    }
    return x;
  }
};

}  // namespace

TEST_CASE("the positioner agrees with a fine integration", "[plant][positioner]") {
  Positioner positioner(kSlow, kLow, kHigh, kPeriod);
  Euler reference{kSlow, 4.0, 4.0};
  positioner.reset(4.0);
  for (int k = 1; k < 400; ++k) {
    const double u = 4.0 + 2.5 * std::sin(0.05 * k) + (k % 100 < 50 ? 0.8 : -0.8);
    REQUIRE(positioner.step(u) == Approx(reference.step(u)).margin(0.05));
  }
}

TEST_CASE("the stem rests anywhere inside the dead band", "[plant][positioner]") {
  Positioner positioner(kSlow, kLow, kHigh, kPeriod);
  positioner.reset(5.0);
  CHECK(after(positioner, 5.49, 200) == Approx(5.0));
  CHECK(after(positioner, 4.51, 200) == Approx(5.0));
  CHECK(after(positioner, 4.0, 400) == Approx(4.5).margin(0.2));
  CHECK(after(positioner, 4.0, 400) < 4.7);
}

TEST_CASE("the stem follows a slow ramp with a lag of half a dead band", "[plant][positioner]") {
  Positioner positioner({.dead_band = 1.0, .gain_per_s = 10.0, .lag_s = 0.05}, kLow, kHigh,
                        kPeriod);
  positioner.reset(3.0);
  double u = 3.0;
  double x = 0.0;
  while (u < 6.0) x = positioner.step(u += 0.002);
  CHECK(x == Approx(u - 0.5).margin(0.02));
  while (u > 4.0) x = positioner.step(u -= 0.002);
  CHECK(x == Approx(u + 0.5).margin(0.02));
}

TEST_CASE("a large step overshoots only where gain times lag is large", "[plant][positioner]") {
  const auto peak = [](double gain_per_s, double lag_s) {
    Positioner positioner({.dead_band = 0.0, .gain_per_s = gain_per_s, .lag_s = lag_s}, kLow, kHigh,
                          kPeriod);
    positioner.reset(2.0);
    double most = 0.0;
    for (int k = 0; k < 200; ++k) most = std::max(most, positioner.step(6.0));
    return most;
  };
  CHECK(peak(0.5, 0.4) <= 6.0);
  // Damping ratio 1 / (2 sqrt(G T)) = 0.354 of a linear second-order system: 30.5 % overshoot.
  CHECK(peak(5.0, 0.4) == Approx(6.0 + 4.0 * 0.305).margin(0.15));
}

TEST_CASE("a shut valve needs the breakaway, an open one does not", "[plant][positioner]") {
  const Positioner::Parameters p{
      .dead_band = 1.0, .gain_per_s = 4.0, .lag_s = 0.05, .breakaway = 3.0};
  Positioner positioner(p, kLow, kHigh, kPeriod);
  CHECK(positioner.reset(0.0) == 0.0);
  CHECK(after(positioner, 2.99, 100) == 0.0);
  CHECK(after(positioner, 3.01, 100) == Approx(2.51).margin(0.05));
  CHECK(after(positioner, 2.0, 100) == Approx(2.5).margin(0.1));
  CHECK(after(positioner, 0.5, 100) == Approx(1.0).margin(0.1));
  CHECK(after(positioner, 2.5, 100) == Approx(2.0).margin(0.1));
}

TEST_CASE("the stem keeps to the range of the output", "[plant][positioner]") {
  Positioner positioner({.dead_band = 0.0, .gain_per_s = 50.0, .lag_s = 1.0}, kLow, kHigh, kPeriod);
  positioner.reset(9.0);
  double most = 0.0;
  for (int k = 0; k < 100; ++k) most = std::max(most, positioner.step(10.0));
  CHECK(most <= kHigh);
  double least = kHigh;
  for (int k = 0; k < 100; ++k) least = std::min(least, positioner.step(0.0));
  CHECK(least >= kLow);
}

TEST_CASE("a gain too high for its steps stays stable", "[plant][positioner]") {
  Positioner positioner({.dead_band = 0.1, .gain_per_s = 1e9, .lag_s = 1e-6}, kLow, kHigh, 10.0);
  positioner.reset(2.0);
  CHECK(after(positioner, 7.0, 3) == Approx(6.95).margin(1e-6));
}

TEST_CASE("a CO that is not a number leaves the stem where it is", "[plant][positioner]") {
  Positioner positioner(kSlow, kLow, kHigh, kPeriod);
  positioner.reset(5.0);
  CHECK(positioner.step(std::numeric_limits<double>::quiet_NaN()) == 5.0);
  CHECK(positioner.step(5.0) == 5.0);
}

TEST_CASE("severity fades the positioner in", "[plant][positioner]") {
  Positioner positioner(kSlow, kLow, kHigh, kPeriod);
  positioner.reset(5.0);
  positioner.set_severity(0.5);
  CHECK(positioner.step(5.4) == Approx(5.2));
  positioner.set_severity(0.0);
  CHECK(positioner.step(5.4) == 5.4);
}

}  // namespace positioner_test

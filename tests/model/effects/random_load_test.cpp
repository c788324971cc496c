// SPDX-License-Identifier: Apache-2.0
#include "model/effects/random_load/random_load.hpp"

#include <catch2/catch.hpp>
#include <cmath>

namespace random_load_test {

using loopwarden::effects::RandomLoad;

TEST_CASE("the load's variance is S^2 T / 2 and its memory T", "[plant][load]") {
  constexpr double kIntensity = 0.2;  // PV units/sqrt(s)
  constexpr double kTime = 2.0;       // s
  const double period = GENERATE(0.1, 1.0);
  RandomLoad load(kIntensity, kTime, period, 11);
  load.reset(0.0);
  constexpr int kSamples = 400'000;
  double squares = 0.0;
  double lagged = 0.0;
  double last = 0.0;
  for (int k = 0; k < kSamples; ++k) {
    const double d = load.step(0.0);
    squares += d * d / kSamples;
    lagged += d * last / kSamples;
    last = d;
  }
  CHECK(squares == Approx(kIntensity * kIntensity * kTime / 2.0).epsilon(0.04));
  CHECK(lagged / squares == Approx(std::exp(-period / kTime)).epsilon(0.02));
}

TEST_CASE("far below its time constant the load is a random walk", "[plant][load]") {
  // Variance after n steps: S^2 n h, also where 1 - a^2 is lost to rounding.
  double squares = 0.0;
  constexpr int kWalks = 4000;
  for (int walk = 0; walk < kWalks; ++walk) {
    RandomLoad load(0.5, 1e18, 0.1, static_cast<std::uint64_t>(walk));
    load.reset(0.0);
    double d = 0.0;
    for (int k = 0; k < 40; ++k) d = load.step(0.0);
    squares += d * d / kWalks;
  }
  CHECK(squares == Approx(0.25 * 4.0).epsilon(0.1));
}

TEST_CASE("it starts at rest, adds to PV and fades with severity", "[plant][load]") {
  RandomLoad load(0.2, 2.0, 0.1, 3);
  CHECK(load.reset(5.0) == 5.0);
  RandomLoad same = load;
  const double shift = load.step(5.0) - 5.0;
  CHECK(shift != 0.0);
  same.set_severity(0.5);
  CHECK(same.step(5.0) - 5.0 == Approx(shift / 2.0));
  same.set_severity(0.0);
  CHECK(same.step(5.0) == 5.0);
}

}  // namespace random_load_test

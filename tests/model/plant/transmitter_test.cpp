// SPDX-License-Identifier: Apache-2.0
#include "model/plant/transmitter.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

namespace transmitter_test {

using namespace loopwarden;
using namespace loopwarden::plant;

TEST_CASE("readings are rounded to the nearest step of the range", "[plant][transmitter]") {
  Transmitter t({.low = -1.0, .high = 9.0, .resolution = 0.25}, 1);
  CHECK(t.step(3.1) == 3.0);
  CHECK(t.step(3.12) == 3.0);
  CHECK(t.step(3.13) == 3.25);
  CHECK(t.step(-0.9) == -1.0);
  CHECK(t.step(-0.85) == -0.75);
}

TEST_CASE("twelve bits over 0 to 10", "[plant][transmitter]") {
  constexpr double kStep = 10.0 / 4096.0;
  Transmitter t({.resolution = kStep}, 1);
  for (double q = 0.0; q < 10.0; q += 0.0137) {
    const double y = t.step(q);
    REQUIRE(std::abs(y - q) <= kStep / 2.0 + 1e-12);
    REQUIRE(y / kStep == Approx(std::round(y / kStep)).margin(1e-9));
  }
}

TEST_CASE("readings end at the range", "[plant][transmitter]") {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Transmitter t({.low = 1.0, .high = 9.0, .resolution = 0.0}, 1);
  CHECK(t.step(12.0) == 9.0);
  CHECK(t.step(-3.0) == 1.0);
  CHECK(t.step(kInfinity) == 9.0);
  CHECK(t.step(-kInfinity) == 1.0);
  CHECK(t.step(std::numeric_limits<double>::quiet_NaN()) == 1.0);
  CHECK(t.step(4.321) == 4.321);
}

TEST_CASE("noise has the stated spread, before rounding and range", "[plant][transmitter]") {
  Transmitter t({.low = -100.0, .high = 100.0, .noise = 0.3}, 7);
  double sum = 0.0;
  double squares = 0.0;
  constexpr int kSamples = 100'000;
  for (int k = 0; k < kSamples; ++k) {
    const double deviation = t.step(5.0) - 5.0;
    sum += deviation;
    squares += deviation * deviation;
  }
  CHECK(sum / kSamples == Approx(0.0).margin(0.004));
  CHECK(std::sqrt(squares / kSamples) == Approx(0.3).epsilon(0.01));
}

TEST_CASE("the seed decides the noise", "[plant][transmitter]") {
  const TransmitterParameters parameters{.noise = 0.3};
  Transmitter a(parameters, 5);
  Transmitter b(parameters, 5);
  Transmitter c(parameters, 6);
  int differ = 0;
  for (int k = 0; k < 100; ++k) {
    const double y = a.step(5.0);
    REQUIRE(b.step(5.0) == y);
    if (c.step(5.0) != y) ++differ;
  }
  CHECK(differ > 90);
}

}  // namespace transmitter_test

// SPDX-License-Identifier: Apache-2.0
#include "model/effects/stiction/stiction_karnopp.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <vector>

#include "model/effects/stiction/stiction_choudhury.hpp"

namespace stiction_karnopp_test {

using namespace loopwarden;
using namespace loopwarden::effects;

namespace {

constexpr double kS = 2.0;  // CO units
constexpr double kJ = 0.8;  // CO units

// Triangle wave of amplitude 6 about 5, CO units.
double triangle(double t, double period_s) {
  const double phase = t / period_s - std::floor(t / period_s);
  const double wave = phase < 0.25   ? 4.0 * phase
                      : phase < 0.75 ? 2.0 - 4.0 * phase
                                     : 4.0 * phase - 4.0;
  return 5.0 + 6.0 * wave;
}

struct Slip {
  double at_u;  // CO units
  double jump;  // CO units
};

// The first slip of a rising ramp of 0.5 CO units/s after a fall from 10 to 0: its place, and the
// movement of the stem beyond that of the ramp itself.
template <class Law>
Slip slip_after_reversal(Law law, double period_s) {
  const double step = 0.5 * period_s;  // CO units
  law.reset(10.0);
  double u = 10.0;
  double x = 10.0;
  while (u > 0.0) x = law.step(u -= step);
  const double stuck = x;
  while (law.step(u += step) < stuck + 0.05 * kJ) {
  }
  const double at_u = u;
  for (double t = 0.0; t < 0.2; t += period_s) x = law.step(u += step);
  return {at_u, x - stuck - (u - at_u)};
}

}  // namespace

TEST_CASE("after a reversal it slips where the Choudhury law does, and as far",
          "[plant][stiction]") {
  const double period_s = GENERATE(0.001, 0.01, 0.1);
  CAPTURE(period_s);
  const Slip physical = slip_after_reversal(StictionKarnopp({kS, kJ}, period_s), period_s);
  const Slip data_driven = slip_after_reversal(StictionChoudhury({kS, kJ}), period_s);
  // Within 3 % of S plus the movement of the command in a period.
  const double tolerance = 0.03 * kS + 0.5 * period_s;
  CHECK(data_driven.at_u == Approx(kS).margin(tolerance));
  CHECK(data_driven.jump == Approx(kJ).margin(tolerance));
  CHECK(physical.at_u == Approx(kS).margin(tolerance));
  CHECK(physical.jump == Approx(kJ).margin(tolerance));
}

TEST_CASE("on slow triangle waves the two laws draw the same loop", "[plant][stiction]") {
  const double period_s = GENERATE(0.01, 0.1);
  const double wave_s = GENERATE(60.0, 120.0);
  CAPTURE(period_s, wave_s);
  StictionKarnopp physical({kS, kJ}, period_s);
  StictionChoudhury data_driven({kS, kJ});
  physical.reset(5.0);
  data_driven.reset(5.0);
  const int samples = static_cast<int>(3.0 * wave_s / period_s);
  double squares = 0.0;
  for (int k = 1; k <= samples; ++k) {
    const double u = triangle(k * period_s, wave_s);
    const double difference = physical.step(u) - data_driven.step(u);
    squares += difference * difference / samples;
    // They may differ only at a slip, for a sample or two.
    REQUIRE(std::abs(difference) <= kJ + 0.1);
  }
  CHECK(std::sqrt(squares) < 0.03 * kS);
}

TEST_CASE("while moving the stem lags by the moving friction", "[plant][stiction]") {
  StictionKarnopp law({kS, kJ}, 0.1);
  law.reset(0.0);
  double x = 0.0;
  for (int k = 1; k <= 200; ++k) x = law.step(0.05 * k);
  CHECK(10.0 - x == Approx((kS - kJ) / 2.0).margin(0.02));
}

TEST_CASE("a slip is over within a tenth of a second and does not overshoot", "[plant][stiction]") {
  StictionKarnopp law({kS, kJ}, 0.001);
  law.reset(0.0);
  double last = 0.0;
  double at_tenth = 0.0;
  for (int k = 1; k <= 500; ++k) {
    const double x = law.step(1.5);  // just above fs = 1.4
    REQUIRE(x >= last);
    last = x;
    if (k == 100) at_tenth = x;
  }
  CHECK(last == Approx(1.5 - (kS - kJ) / 2.0).margin(0.001));
  CHECK(at_tenth == Approx(last).margin(0.001));
}

TEST_CASE("a stuck stem does not creep", "[plant][stiction]") {
  StictionKarnopp law({kS, kJ}, 0.1);
  law.reset(5.0);
  for (int k = 0; k < 1000; ++k) REQUIRE(law.step(5.0 + 1.39 * std::sin(0.1 * k)) == 5.0);
}

TEST_CASE("a period longer than any motion of the stem ends at rest", "[plant][stiction]") {
  StictionKarnopp law({kS, kJ}, 60.0);
  law.reset(0.0);
  CHECK(law.step(8.0) == Approx(8.0 - (kS - kJ) / 2.0).margin(0.01));
}

TEST_CASE("severity scales the Karnopp friction; without any the stem follows",
          "[plant][stiction]") {
  StictionKarnopp law({kS, kJ}, 0.1);
  law.reset(0.0);
  law.set_severity(0.5);
  CHECK(law.step(0.69) == 0.0);
  law.step(0.75);
  CHECK(law.step(0.75) == Approx(0.45).margin(0.01));
  law.set_severity(0.0);
  for (const double u : {3.0, -1.0, 0.2}) CHECK(law.step(u) == u);
}

TEST_CASE("a CO that is not finite does not move the Karnopp stem", "[plant][stiction]") {
  const double bad = GENERATE(
      values({std::numeric_limits<double>::quiet_NaN(), -std::numeric_limits<double>::infinity()}));
  StictionKarnopp law({kS, kJ}, 0.1);
  law.reset(5.0);
  CHECK(law.step(bad) == 5.0);
  CHECK(law.step(5.1) == 5.0);
}

}  // namespace stiction_karnopp_test

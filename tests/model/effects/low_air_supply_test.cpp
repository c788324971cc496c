// SPDX-License-Identifier: Apache-2.0
#include "model/effects/low_air_supply/low_air_supply.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

namespace low_air_supply_test {

using loopwarden::effects::LowAirSupply;

namespace {

using Filling = LowAirSupply::Filling;
constexpr double kPeriod = 0.1;  // s

// The equation of the header, integrated in ten thousand Euler steps per period.
double euler(double x, double u, const LowAirSupply::Parameters& p) {
  constexpr int kSteps = 10'000;
  constexpr double kStep = kPeriod / kSteps;
  for (int i = 0; i < kSteps; ++i) {
    const double velocity = (std::min(u, p.travel_limit) - x) / p.lag_s;
    const double slowest = p.filling == Filling::both_ways ? -p.rate : velocity;
    x += kStep * std::clamp(velocity, std::min(slowest, p.rate), p.rate);
  }
  return x;
}

double command(int k) { return 50.0 + 30.0 * std::sin(0.11 * k) + (k % 60 < 30 ? 8.0 : -8.0); }

}  // namespace

TEST_CASE("the limited lag agrees with a fine integration", "[plant][low_air]") {
  const auto filling = GENERATE(Filling::both_ways, Filling::one_sided);
  const double rate = GENERATE(4.0, 15.0, 60.0);
  const LowAirSupply::Parameters p{
      .rate = rate, .travel_limit = 70.0, .lag_s = 0.4, .filling = filling};
  LowAirSupply valve(p, kPeriod);
  double x = valve.reset(command(0));
  for (int k = 1; k < 200; ++k) {
    x = euler(x, command(k), p);
    REQUIRE(valve.step(command(k)) == Approx(x).margin(1e-3));
  }
}

TEST_CASE("without a lag the stem moves at its rate and arrives exactly", "[plant][low_air]") {
  LowAirSupply valve({.rate = 2.0, .lag_s = 0.0}, kPeriod);
  valve.reset(10.0);
  CHECK(valve.step(10.5) == Approx(10.2));
  CHECK(valve.step(10.5) == Approx(10.4));
  CHECK(valve.step(10.5) == Approx(10.5).epsilon(1e-14));
  CHECK(valve.step(0.0) == Approx(10.3));

  SECTION("one-sided: the spring closes it at once") {
    LowAirSupply spring({.rate = 2.0, .lag_s = 0.0, .filling = Filling::one_sided}, kPeriod);
    spring.reset(10.0);
    CHECK(spring.step(20.0) == Approx(10.2));
    CHECK(spring.step(3.0) == Approx(3.0));
  }
}

TEST_CASE("the supply bounds the travel, at rest too", "[plant][low_air]") {
  LowAirSupply valve({.rate = 100.0, .travel_limit = 60.0}, kPeriod);
  CHECK(valve.reset(80.0) == 60.0);
  CHECK(valve.step(80.0) == 60.0);
  CHECK(valve.step(55.0) == Approx(55.0));
  for (int k = 0; k < 10; ++k) valve.step(100.0);
  CHECK(valve.step(100.0) == Approx(60.0));
}

TEST_CASE("severity fades in rate, lag and travel limit", "[plant][low_air]") {
  LowAirSupply valve({.rate = 2.0, .travel_limit = 60.0, .lag_s = 0.0}, kPeriod);
  valve.set_severity(0.5);
  CHECK(valve.reset(80.0) == 70.0);
  CHECK(valve.step(20.0) == Approx(69.6));  // rate 4
  valve.set_severity(0.0);
  CHECK(valve.step(93.7) == Approx(93.7).epsilon(1e-15));
  CHECK(valve.step(1.2) == Approx(1.2).epsilon(1e-12));
}

TEST_CASE("a preload shifts the stem below the command, down to shut", "[plant][low_air]") {
  LowAirSupply valve({.rate = 1e6, .preload = 2.0, .shut = 1.0}, kPeriod);
  CHECK(valve.reset(8.0) == Approx(6.0));
  CHECK(valve.step(5.0) == Approx(3.0));
  CHECK(valve.step(2.5) == Approx(1.0));
  valve.set_severity(0.5);
  CHECK(valve.step(5.0) == Approx(4.0));
  valve.set_severity(0.0);
  CHECK(valve.step(5.0) == Approx(5.0));
}

TEST_CASE("another rate on closing holds on closing alone", "[plant][low_air_supply]") {
  LowAirSupply air({.rate = 2.0, .lag_s = 1.0, .closing = 0.25}, 0.1);
  LowAirSupply alike({.rate = 2.0, .lag_s = 1.0}, 0.1);
  air.reset(0.0);
  alike.reset(0.0);
  double up = 0.0;
  for (int k = 0; k < 300; ++k) {
    up = air.step(10.0);
    CHECK(up == alike.step(10.0));
  }
  const double down = air.step(0.0);
  CHECK(up - down == Approx(2.0 * 0.25 * 0.1));
  // Exponential from R C T on.
  double before = down;
  double x = down;
  while (x > 0.4) {
    before = x;
    x = air.step(0.0);
  }
  CHECK(x / before < 1.0);
  before = x;
  CHECK(air.step(0.0) / before == Approx(std::exp(-0.1)));
}

}  // namespace low_air_supply_test

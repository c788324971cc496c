// SPDX-License-Identifier: Apache-2.0
#include "model/effects/valve_characteristic/valve_characteristic.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

namespace valve_characteristic_test {

using loopwarden::effects::ValveCharacteristic;
using Curve = ValveCharacteristic::Curve;

namespace {

constexpr double kLow = 10.0;
constexpr double kHigh = 30.0;

ValveCharacteristic named(Curve curve, double rangeability = 30.0) {
  return {{.curve = curve, .rangeability = rangeability}, kLow, kHigh};
}

}  // namespace

TEST_CASE("named characteristics close, open fully and rise in between",
          "[plant][characteristic]") {
  const auto curve =
      GENERATE(Curve::linear, Curve::equal_percentage, Curve::quick_opening, Curve::butterfly);
  ValveCharacteristic valve = named(curve);
  CHECK(valve.reset(kLow) == Approx(kLow));
  CHECK(valve.step(kHigh) == Approx(kHigh));
  double last = valve.step(kLow);
  for (double x = kLow + 0.1; x <= kHigh; x += 0.1) {
    const double q = valve.step(x);
    REQUIRE(q > last);
    last = q;
  }
  CHECK(valve.step(kHigh + 5.0) == Approx(kHigh));
  CHECK(valve.step(kLow - 5.0) == Approx(kLow));
}

TEST_CASE("flow at half travel", "[plant][characteristic]") {
  constexpr double kHalf = (kLow + kHigh) / 2.0;
  const auto share = [&](ValveCharacteristic valve) {
    return (valve.step(kHalf) - kLow) / (kHigh - kLow);
  };
  CHECK(share(named(Curve::linear)) == Approx(0.5));
  // (R^0.5 - 1) / (R - 1) = 1 / (sqrt(R) + 1)
  CHECK(share(named(Curve::equal_percentage, 30.0)) == Approx(1.0 / (std::sqrt(30.0) + 1.0)));
  CHECK(share(named(Curve::equal_percentage, 50.0)) == Approx(1.0 / (std::sqrt(50.0) + 1.0)));
  CHECK(share(named(Curve::quick_opening)) == Approx(std::sqrt(0.5)));
  CHECK(share(named(Curve::butterfly)) == Approx(1.0 - std::sqrt(0.5)));
}

TEST_CASE("equal percentage means equal ratios of slope for equal travel",
          "[plant][characteristic]") {
  ValveCharacteristic valve = named(Curve::equal_percentage, 30.0);
  const auto slope = [&](double x) { return (valve.step(x + 1e-4) - valve.step(x - 1e-4)) / 2e-4; };
  CHECK(slope(20.0) / slope(15.0) == Approx(std::pow(30.0, 0.25)).epsilon(1e-4));
  CHECK(slope(25.0) / slope(20.0) == Approx(std::pow(30.0, 0.25)).epsilon(1e-4));
}

TEST_CASE("a table is straight between its points and continues beyond them",
          "[plant][characteristic]") {
  ValveCharacteristic::Parameters p{.curve = Curve::table, .point_count = 3};
  p.points[0] = {10.0, 12.0};
  p.points[1] = {20.0, 14.0};
  p.points[2] = {30.0, 29.0};
  ValveCharacteristic valve(p, kLow, kHigh);
  CHECK(valve.step(10.0) == Approx(12.0));
  CHECK(valve.step(15.0) == Approx(13.0));
  CHECK(valve.step(20.0) == Approx(14.0));
  CHECK(valve.step(22.0) == Approx(17.0));
  CHECK(valve.step(30.0) == Approx(29.0));
  CHECK(valve.step(0.0) == Approx(10.0));   // slope 0.2
  CHECK(valve.step(32.0) == Approx(32.0));  // slope 1.5
}

TEST_CASE("severity bends the characteristic gradually", "[plant][characteristic]") {
  ValveCharacteristic valve = named(Curve::butterfly);
  const double full = valve.step(20.0);
  valve.set_severity(0.5);
  CHECK(valve.step(20.0) == Approx((20.0 + full) / 2.0));
  valve.set_severity(0.0);
  CHECK(valve.step(20.0) == 20.0);
  CHECK(valve.step(35.0) == 35.0);
}

TEST_CASE("a travel that is not a number gives such a flow", "[plant][characteristic]") {
  const auto curve = GENERATE(Curve::linear, Curve::equal_percentage, Curve::butterfly);
  CHECK(std::isnan(named(curve).step(std::numeric_limits<double>::quiet_NaN())));
}

}  // namespace valve_characteristic_test

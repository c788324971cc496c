// SPDX-License-Identifier: Apache-2.0
#include "model/control/set_point.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

namespace set_point_test {

using namespace loopwarden::control;

TEST_CASE("without a ramp the set point is there at once, exactly", "[control][set_point]") {
  SetPoint sp({.low = 0.0, .high = 10.0}, 3.3);
  sp.request(7.1);
  CHECK(sp.step(0.1) == 7.1);
  CHECK_FALSE(sp.ramped());
}

TEST_CASE("requests are held within the limits", "[control][set_point]") {
  SetPoint sp({.low = 2.0, .high = 8.0}, 20.0);
  CHECK(sp.target() == 8.0);
  CHECK(sp.working() == 8.0);
  sp.request(-1.0);
  CHECK(sp.step(0.1) == 2.0);
}

TEST_CASE("a value that is not finite is ignored", "[control][set_point]") {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const double bad =
      GENERATE(values({std::numeric_limits<double>::quiet_NaN(), kInfinity, -kInfinity}));
  SetPoint sp({.low = 0.0, .high = 10.0, .rate_up_per_s = 1.0}, 5.0);
  sp.request(bad);
  sp.restart_ramp(bad);
  CHECK(sp.target() == 5.0);
  CHECK(sp.step(0.1) == 5.0);
}

TEST_CASE("up and down have separate rates and the target is met exactly", "[control][set_point]") {
  SetPoint sp({.low = 0.0, .high = 10.0, .rate_up_per_s = 2.0, .rate_down_per_s = 0.5}, 4.0);
  CHECK(sp.ramped());
  sp.request(4.5);
  CHECK(sp.step(0.1) == Approx(4.2));
  CHECK(sp.step(0.1) == Approx(4.4));
  CHECK(sp.step(0.1) == 4.5);
  CHECK(sp.step(0.1) == 4.5);
  sp.request(4.42);
  CHECK(sp.step(0.1) == Approx(4.45));
  CHECK(sp.step(0.1) == 4.42);
}

TEST_CASE("a ramp restarts from a given value", "[control][set_point]") {
  SetPoint sp({.low = 0.0, .high = 10.0, .rate_up_per_s = 1.0, .rate_down_per_s = 1.0}, 8.0);
  sp.restart_ramp(3.0);
  CHECK(sp.target() == 8.0);
  CHECK(sp.step(0.1) == Approx(3.1));
  sp.restart_ramp(-4.0);  // limits apply
  CHECK(sp.working() == 0.0);
}

TEST_CASE("new limits move the target in, at the ramp's rate", "[control][set_point]") {
  SetPoint sp({.low = 0.0, .high = 10.0, .rate_down_per_s = 1.0}, 9.0);
  sp.configure({.low = 0.0, .high = 6.0, .rate_down_per_s = 1.0});
  CHECK(sp.target() == 6.0);
  CHECK(sp.step(0.1) == Approx(8.9));
}

}  // namespace set_point_test

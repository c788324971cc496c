// SPDX-License-Identifier: Apache-2.0
#include "model/effects/first_order_lag.hpp"

#include <catch2/catch.hpp>
#include <cmath>

namespace first_order_lag_test {

using loopwarden::effects::FirstOrderLag;

TEST_CASE("a step is answered by 1 - exp(-t / T), at any period", "[plant][lag]") {
  const double period = GENERATE(0.01, 0.1, 1.0, 5.0);
  FirstOrderLag lag(1.7, period);
  CHECK(lag.reset(2.0) == 2.0);
  for (int k = 1; k < 20; ++k) {
    REQUIRE(lag.step(5.0) == Approx(2.0 + 3.0 * (1.0 - std::exp(-k * period / 1.7))));
  }
}

TEST_CASE("a lag at rest stays so", "[plant][lag]") {
  FirstOrderLag lag(1.7, 0.1);
  CHECK(lag.reset(3.3) == 3.3);
  for (int k = 0; k < 10; ++k) REQUIRE(lag.step(3.3) == 3.3);
}

TEST_CASE("no time constant is no lag", "[plant][lag]") {
  FirstOrderLag lag(0.0, 0.1);
  lag.reset(0.0);
  CHECK(lag.step(4.0) == 4.0);
}

TEST_CASE("severity scales the time constant of a lag", "[plant][lag]") {
  FirstOrderLag lag(2.0, 0.1);
  lag.set_severity(0.25);
  lag.reset(0.0);
  CHECK(lag.step(1.0) == Approx(1.0 - std::exp(-0.1 / 0.5)));
  lag.set_severity(0.0);
  CHECK(lag.step(9.0) == 9.0);
}

}  // namespace first_order_lag_test

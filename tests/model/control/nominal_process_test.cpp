// SPDX-License-Identifier: Apache-2.0
#include "model/control/nominal_process.hpp"

#include <catch2/catch.hpp>
#include <cmath>

namespace nominal_process_test {

using namespace loopwarden::control;

TEST_CASE("the nominal process answers after its dead time with its lag",
          "[control][planned_moves]") {
  const double dead_time_s = GENERATE(0.0, 2.0, 60.0);
  constexpr double kPeriod_s = 0.1;
  NominalProcess process({.gain = 1.5, .time_constant_s = 4.0, .dead_time_s = dead_time_s},
                         kPeriod_s);
  process.reset(2.0);
  CHECK(process.value() == Approx(3.0));
  const int delay = static_cast<int>(std::lround(dead_time_s / kPeriod_s));
  for (int k = 0; k < delay - 3; ++k) process.step(3.0);
  CHECK(process.value() == Approx(3.0));
  for (int k = 0; k < 43; ++k) process.step(3.0);
  CHECK(process.value() == Approx(4.5 - 1.5 * std::exp(-1.0)).margin(0.05));
  for (int k = 0; k < 400; ++k) process.step(3.0);
  CHECK(process.value() == Approx(4.5).margin(1e-3));
}

TEST_CASE("a nominal process without a lag follows the stem", "[control][planned_moves]") {
  NominalProcess process({.gain = -2.0}, 0.1);
  process.reset(0.0);
  process.step(1.0);
  CHECK(process.value() == -2.0);
}

}  // namespace nominal_process_test

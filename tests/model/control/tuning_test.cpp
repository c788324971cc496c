// SPDX-License-Identifier: Apache-2.0
#include "model/control/tuning.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "model/control/pid.hpp"

namespace tuning_test {

using namespace loopwarden::control;

TEST_CASE("ISA settings become gains by the spans", "[control][tuning]") {
  // 2 % of CO per % of PV over a PV span of 50 and a CO span of 10: 0.4 CO units per PV unit.
  const PidGains gains =
      from_isa({.kc = 2.0, .ti_s = 8.0, .td_s = 1.5, .derivative_filter_s = 0.3}, 50.0, 10.0);
  CHECK(gains.kp == Approx(0.4));
  CHECK(gains.ki == Approx(0.05));
  CHECK(gains.kd == Approx(0.6));
  CHECK(gains.derivative_filter_s == 0.3);
}

TEST_CASE("the thesis's tuning in both forms gives the same output", "[control][tuning]") {
  const PidGains thesis{.kp = 0.61145038, .ki = 0.070013402};
  const IsaTuning isa = to_isa(thesis, 10.0, 10.0);
  CHECK(isa.kc == Approx(0.61145038));
  CHECK(isa.ti_s == Approx(8.733).epsilon(1e-4));  // as printed in chapter 6

  const PidSettings parallel{.gains = thesis, .output_high = 10.0};
  PidSettings standard = parallel;
  standard.gains = from_isa(isa, 10.0, 10.0);
  Pid a(parallel, 0.1);
  Pid b(standard, 0.1);
  a.initialise(2.0, 0.0, 0.0);
  b.initialise(2.0, 0.0, 0.0);
  for (int k = 0; k < 500; ++k) {
    const double pv = 3.0 + std::sin(0.05 * k);
    const double u = a.step(4.0, pv, 2.0, 0.0);
    REQUIRE(b.step(4.0, pv, 2.0, 0.0) == Approx(u).epsilon(1e-12));
  }
}

TEST_CASE("conversion there and back keeps the gains", "[control][tuning]") {
  const PidGains gains{.kp = 1.7, .ki = 0.21, .kd = 0.9, .derivative_filter_s = 0.25};
  const PidGains back = from_isa(to_isa(gains, 160.0, 100.0), 160.0, 100.0);
  CHECK(back.kp == Approx(gains.kp));
  CHECK(back.ki == Approx(gains.ki));
  CHECK(back.kd == Approx(gains.kd));
  CHECK(back.derivative_filter_s == gains.derivative_filter_s);
}

TEST_CASE("no integral action is an infinite integral time", "[control][tuning]") {
  CHECK(std::isinf(to_isa({.kp = 1.0}, 1.0, 1.0).ti_s));
  const IsaTuning proportional{.kc = 3.0, .ti_s = std::numeric_limits<double>::infinity()};
  CHECK(from_isa(proportional, 1.0, 1.0).ki == 0.0);
}

}  // namespace tuning_test

// SPDX-License-Identifier: Apache-2.0
#include "model/control/cycle_statistics.hpp"

#include <catch2/catch.hpp>
#include <cmath>

namespace cycle_statistics_test {

using namespace loopwarden::control;

namespace {

constexpr double kPeriod_s = 0.1;
constexpr double kPi = 3.14159265358979;

// A cycle of 20 s with an amplitude of 2; the stem travels 0.6 per cycle.
int run(CycleStatistics& cycles, int samples, double margin, bool counts) {
  int ended = 0;
  for (int k = 0; k < samples; ++k) {
    const double error = 2.0 * std::sin(2.0 * kPi * k * kPeriod_s / 20.0);
    ended += cycles.add_error(error, margin, 0.6) ? 1 : 0;
    cycles.add_square(error, counts);
  }
  return ended;
}

}  // namespace

TEST_CASE("the baseline has variance, travel and period of the cycles",
          "[control][planned_moves]") {
  CycleStatistics cycles(kPeriod_s);
  CHECK(run(cycles, 1300, 0.1, true) == 6);
  CHECK(cycles.cycles() == 5.0);
  const LoopBaseline baseline = cycles.baseline(0.0, 0.2, 0.0);
  CHECK(baseline.variance == Approx(2.0).epsilon(0.01));
  CHECK(baseline.cycle_s == Approx(20.0).epsilon(0.01));
  CHECK(baseline.travel_rate == Approx(0.03).epsilon(0.01));
  CHECK(cycles.standard_error() < 0.05);
}

TEST_CASE("SP - PV within the margin is no cycle", "[control][planned_moves]") {
  CycleStatistics cycles(kPeriod_s);
  CHECK(run(cycles, 1300, 2.5, true) == 0);
}

TEST_CASE("cycles that a change of the set point disturbs are left out",
          "[control][planned_moves]") {
  CycleStatistics cycles(kPeriod_s);
  run(cycles, 1300, 0.1, false);
  CHECK(cycles.cycles() == 0.0);
  run(cycles, 1300, 0.1, true);
  CHECK(cycles.cycles() > 3.0);
  cycles.restart();
  CHECK(cycles.cycles() == 0.0);
}

}  // namespace cycle_statistics_test

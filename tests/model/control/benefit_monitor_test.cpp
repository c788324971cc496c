// SPDX-License-Identifier: Apache-2.0
#include "model/control/benefit_monitor.hpp"

#include <catch2/catch.hpp>

namespace benefit_monitor_test {

using namespace loopwarden::control;

namespace {

constexpr double kPeriod_s = 0.1;
const LoopBaseline kBaseline{.variance = 1.0, .travel_rate = 0.01, .cycle_s = 10.0};

DisengageReason run(BenefitMonitor& monitor, double error, double duration_s) {
  DisengageReason reason = DisengageReason::none;
  for (double t = 0.0; t < duration_s && reason == DisengageReason::none; t += kPeriod_s) {
    reason = monitor.add(error, 0.0, kBaseline);
  }
  return reason;
}

}  // namespace

TEST_CASE("the gain is RMS over that of the baseline", "[control][planned_moves]") {
  BenefitMonitor monitor(kPeriod_s);
  CHECK(run(monitor, 0.5, 30.0) == DisengageReason::none);
  CHECK(monitor.gain() == 0.0);  // the first window lasts 40 s
  CHECK(run(monitor, 0.5, 500.0) == DisengageReason::none);
  CHECK(monitor.gain() == Approx(0.5));
  monitor.restart();
  CHECK(monitor.gain() == 0.0);
}

TEST_CASE("an error that does not fall ends planned moves", "[control][planned_moves]") {
  BenefitMonitor monitor(kPeriod_s);
  DisengageReason reason = DisengageReason::none;
  // The excess counts a part of one sample that is far off, the RMS all of it.
  for (int k = 0; k < 400 && reason == DisengageReason::none; ++k) {
    reason = run(monitor, 10.0, 0.05);
    if (reason == DisengageReason::none) reason = run(monitor, 0.0, 3.85);
  }
  CHECK(reason == DisengageReason::no_gain);
}

TEST_CASE("a large error ends planned moves after two cycles of variance",
          "[control][planned_moves]") {
  BenefitMonitor monitor(kPeriod_s);
  CHECK(monitor.remaining_excess(kBaseline) == Approx(20.0));
  CHECK(run(monitor, 2.0, 6.0) == DisengageReason::none);
  CHECK(monitor.remaining_excess(kBaseline) == Approx(2.0).margin(0.5));
  CHECK(run(monitor, 2.0, 2.0) == DisengageReason::error_too_large);
}

TEST_CASE("one sample counts at most sixteen times the baseline", "[control][planned_moves]") {
  BenefitMonitor monitor(kPeriod_s);
  CHECK(monitor.add(1e6, 0.0, kBaseline) == DisengageReason::none);
  CHECK(monitor.remaining_excess(kBaseline) == Approx(18.5));
}

}  // namespace benefit_monitor_test

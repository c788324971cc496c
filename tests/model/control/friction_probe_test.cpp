// SPDX-License-Identifier: Apache-2.0
#include "model/control/friction_probe.hpp"

#include <catch2/catch.hpp>
#include <cmath>

namespace friction_probe_test {

using namespace loopwarden::control;

namespace {

constexpr double kPeriod_s = 0.1;
const PlannedMovesSettings kSettings{
    .gain = 1.5, .time_constant_s = 4.0, .dead_time_s = 2.0, .s = 0.6, .j = 0.3};

struct Bench {
  Bench() : loop(kSettings, false, kPeriod_s), probe(kSettings, kPeriod_s) {
    held.output = 5.0;
    for (int k = 0; k < 100; ++k) observe(5.0);
    probe.begin(loop.limits(), held);
  }
  void observe(double stem) {
    alternates = -alternates;
    loop.observe({.set_point = 7.5,
                  .process_variable = 7.5,
                  .applied = held.output,
                  .commanded = held.output,
                  .valve_position = stem + alternates,
                  .valve_position_valid = true,
                  .limits = limits},
                 true, false, held.output);
    held.pass(true, kPeriod_s);
  }
  // `follows`: share of CO's move that the stem makes. Returns how the probe ended.
  ProbeResult run(double follows) {
    bool pushed = false;
    for (int k = 0; k < 1000; ++k) {
      observe(5.0 + follows * (held.output - 5.0));
      const ProbeResult result = probe.step(loop, 0.5, 0.0, held);
      if (result == ProbeResult::pushed) {
        pushed = true;
        size = held.output - 5.0;
      } else if (result != ProbeResult::under_way) {
        CHECK(pushed);
        return result;
      }
    }
    return ProbeResult::under_way;
  }
  double alternates = 0.001;
  double size = 0.0;  // CO units
  OutputLimits limits{.low = 0.0, .high = 10.0};
  LoopEstimator loop;
  FrictionProbe probe;
  HeldOutput held;
};

}  // namespace

TEST_CASE("a stem that stands in a probe sticks, one that follows is healthy",
          "[control][planned_moves]") {
  Bench stuck;
  CHECK(stuck.run(0.0) == ProbeResult::sticks);
  CHECK(std::abs(stuck.size) == Approx(0.35 * 0.6));
  Bench healthy;
  CHECK(healthy.run(1.0) == ProbeResult::follows);
  CHECK(healthy.held.output == Approx(5.0));
}

TEST_CASE("a probe stays within the limits of CO", "[control][planned_moves]") {
  Bench bench;
  bench.limits = {.low = 4.9, .high = 10.0};
  CHECK(bench.run(0.0) == ProbeResult::sticks);
  CHECK(bench.size == Approx(0.21));
}

TEST_CASE("a probe is due after many moves, free landings or an interruption",
          "[control][planned_moves]") {
  Bench bench;
  CHECK_FALSE(bench.probe.is_due());
  bench.probe.count_landing(true);
  bench.probe.count_landing(false);
  bench.probe.count_landing(true);
  CHECK_FALSE(bench.probe.is_due());
  bench.probe.count_landing(true);
  CHECK(bench.probe.is_due());
  bench.probe.forget_landings();
  CHECK_FALSE(bench.probe.is_due());
  bench.probe.repeat();
  CHECK(bench.probe.is_due());
  bench.probe.forget_landings();
  for (int k = 0; k < 25; ++k) bench.probe.count_move();
  CHECK(bench.probe.is_due());
  bench.probe.begin(bench.limits, bench.held);
  CHECK_FALSE(bench.probe.is_due());
}

}  // namespace friction_probe_test

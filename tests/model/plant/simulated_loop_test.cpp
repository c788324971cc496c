// SPDX-License-Identifier: Apache-2.0
#include "model/plant/simulated_loop.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

namespace simulated_loop_test {

using namespace loopwarden;
using namespace loopwarden::plant;
namespace control = loopwarden::control;

namespace {

constexpr double kStep = 10.0 / 4096.0;

LoopModel model() {
  LoopModel m;
  m.controller.pid.gains = {.kp = 0.5, .ki = 0.2};
  m.controller.pid.output_high = 10.0;
  m.controller.output.high = 10.0;
  m.controller.set_point.high = 10.0;
  m.process = {.gain = 0.9, .time_constant_s = 2.0, .dead_time_s = 0.7};
  m.transmitter = {.resolution = kStep};
  m.scenario.set_point = {{0.0, 3.0}, {10.0, 6.0}};
  return m;
}

bool same(const LoopSample& a, const LoopSample& b) {
  return a.time_s == b.time_s && a.sp == b.sp && a.pv == b.pv && a.co == b.co && a.stem == b.stem;
}

}  // namespace

TEST_CASE("the loop begins at rest at its first set point, in automatic", "[plant][closed_loop]") {
  SimulatedLoop loop(model());
  for (int k = 0; k < 100; ++k) {
    const LoopSample sample = loop.step();
    REQUIRE(sample.time_s == Approx(0.1 * k));
    REQUIRE(sample.sp == 3.0);
    REQUIRE(sample.pv == Approx(3.0).margin(kStep));
    REQUIRE(sample.co == Approx(3.0 / 0.9).margin(2.0 * kStep));
  }
  CHECK(loop.controller().mode() == control::Mode::automatic);
}

TEST_CASE("the set point follows its profile and PV follows the set point",
          "[plant][closed_loop]") {
  SimulatedLoop loop(model());
  LoopSample sample;
  for (int k = 0; k <= 100; ++k) sample = loop.step();
  CHECK(sample.time_s == Approx(10.0));
  CHECK(sample.sp == 6.0);
  for (int k = 0; k < 600; ++k) sample = loop.step();
  CHECK(sample.sp == 6.0);
  CHECK(sample.pv == Approx(6.0).margin(2.0 * kStep));
}

TEST_CASE("CO is rounded as by a converter, and the controller knows", "[plant][closed_loop]") {
  const auto anti_windup =
      GENERATE(control::AntiWindup::integral_clamp, control::AntiWindup::back_calculation,
               control::AntiWindup::conditional);
  LoopModel m = model();
  m.controller.pid.anti_windup = anti_windup;
  constexpr double kCoarse = 0.05;
  SimulatedLoop rounded(m, kCoarse);
  SimulatedLoop exact(m);
  double worst = 0.0;
  for (int k = 0; k < 400; ++k) {
    const LoopSample sample = rounded.step();
    REQUIRE(sample.co / kCoarse == Approx(std::round(sample.co / kCoarse)).margin(1e-9));
    REQUIRE(rounded.controller().output_applied() == sample.co);
    worst = std::max(worst, std::abs(sample.co - exact.step().co));
  }
  // No kind of anti-windup mistakes the rounding for a limit.
  CHECK(worst < 3.0 * kCoarse);
}

TEST_CASE("the same seed gives the same bits, another seed others", "[plant][closed_loop]") {
  LoopModel m = model();
  m.transmitter.noise = 0.02;
  m.valve_effects = {{.name = "stiction", .parameters = {{"s", 0.5}, {"j", 0.2}}}};
  m.disturbances = {{.name = "random_load", .parameters = {{"intensity", 0.01}}}};
  m.scenario.seed = 8;
  SimulatedLoop a(m, kStep);
  SimulatedLoop b(m, kStep);
  m.scenario.seed = 9;
  SimulatedLoop c(m, kStep);
  int differ = 0;
  for (int k = 0; k < 5000; ++k) {
    const LoopSample sample = a.step();
    REQUIRE(same(sample, b.step()));
    if (sample.pv != c.step().pv) ++differ;
  }
  CHECK(differ > 1000);
}

TEST_CASE("a copy continues exactly like the original", "[plant][closed_loop]") {
  LoopModel m = model();
  m.transmitter.noise = 0.02;
  SimulatedLoop loop(m, kStep);
  for (int k = 0; k < 150; ++k) loop.step();
  SimulatedLoop copy = loop;
  for (int k = 0; k < 500; ++k) REQUIRE(same(loop.step(), copy.step()));
}

TEST_CASE("the stem and the severity of faults are shown", "[plant][closed_loop]") {
  LoopModel m = model();
  m.scenario.faults = {{.effect = {.name = "backlash", .parameters = {{"deadband", 1.0}}},
                        .schedule = {.from_s = 5.0, .ramp_s = 10.0}}};
  SimulatedLoop loop(m);
  double apart = 0.0;
  LoopSample last = loop.step();
  for (int k = 1; k < 300; ++k) {
    const LoopSample sample = loop.step();
    apart = std::max(apart, std::abs(sample.stem - last.co));
    last = sample;
  }
  CHECK(last.severity == 1.0);
  CHECK(apart == Approx(0.5).margin(0.01));
}

}  // namespace simulated_loop_test

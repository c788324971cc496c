// SPDX-License-Identifier: Apache-2.0
#include "model/analysis/limit_cycle.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <complex>
#include <numbers>

#include "model/analysis/describing_function.hpp"
#include "model/effects/backlash/backlash.hpp"
#include "model/plant/simulated_loop.hpp"
#include "model/effects/stiction/stiction_choudhury.hpp"

namespace limit_cycle_test {

using namespace loopwarden;
using namespace loopwarden::analysis;

// Returns the first harmonic of a simulated valve, from the last of three periods.
template <class Valve>
std::complex<double> measured_describing_function(Valve valve, double amplitude) {
  constexpr int kSamples = 4000;
  std::complex<double> sum = 0.0;
  for (int k = 0; k < 3 * kSamples; ++k) {
    const double angle = 2.0 * std::numbers::pi * k / kSamples;
    const double x = valve(amplitude * std::sin(angle));
    if (k >= 2 * kSamples) sum += x * std::complex<double>(std::sin(angle), std::cos(angle));
  }
  return sum * 2.0 / (kSamples * amplitude);
}

TEST_CASE("describing functions are those of the simulated valves", "[analysis][limit-cycle]") {
  for (const double ratio : {0.55, 0.8, 1.2, 2.0, 5.0, 20.0}) {
    CAPTURE(ratio);
    constexpr double kDeadband = 0.8;
    const double amplitude = ratio * kDeadband;
    effects::Backlash play(kDeadband);
    const auto backlash =
        measured_describing_function([&](double u) { return play.step(u); }, amplitude);
    const auto expected = backlash_describing_function(kDeadband, amplitude);
    CHECK(backlash.real() == Approx(expected.real()).margin(2e-3));
    CHECK(backlash.imag() == Approx(expected.imag()).margin(2e-3));
    for (const double share : {0.0, 0.3, 1.0}) {
      CAPTURE(share);
      effects::StictionChoudhury sticky({kDeadband, share * kDeadband});
      sticky.reset(-10.0);  // starts moving: a small sine would not free it from rest
      const auto measured =
          measured_describing_function([&](double u) { return sticky.step(u); }, amplitude);
      const auto formula = stiction_describing_function(kDeadband, share * kDeadband, amplitude);
      CHECK(measured.real() == Approx(formula.real()).margin(4e-3));
      CHECK(measured.imag() == Approx(formula.imag()).margin(4e-3));
    }
    CHECK(std::abs(stiction_describing_function(kDeadband, 0.0, amplitude) - expected) < 1e-12);
  }
  CHECK(backlash_describing_function(1.0, 0.5) == 0.0);
  CHECK(stiction_describing_function(1.0, 0.3, 0.49) == 0.0);
}

namespace {

plant::LoopModel plant1(const control::PidGains& gains) {
  plant::LoopModel m;
  m.controller.pid.gains = gains;
  m.controller.pid.output_high = 10.0;
  m.controller.output.high = 10.0;
  m.controller.set_point.high = 10.0;
  m.process = {.gain = 1.2264, .time_constant_s = 1.69376, .dead_time_s = 2.6256};
  m.transmitter.high = 10.0;
  m.scenario.set_point = {{0.0, 4.0}, {20.0, 5.0}};
  return m;
}

constexpr control::PidGains kThesis{.kp = 0.3494, .ki = 0.0400074};
constexpr control::PidGains kSimc{.kp = 0.263, .ki = 0.155};

struct Cycle {
  double period_s = 0.0, pv_amplitude = 0.0;
};
Cycle simulated(const plant::LoopModel& model) {
  plant::SimulatedLoop loop(model);
  double low = 1e9, high = -1e9, first = 0.0, last = 0.0, before = 5.0;
  int crossings = 0;
  for (plant::LoopSample s = loop.step(); s.time_s < 4000.0; s = loop.step()) {
    if (s.time_s < 2000.0) continue;
    low = std::min(low, s.true_pv);
    high = std::max(high, s.true_pv);
    if (before < 5.0 && s.true_pv >= 5.0 && crossings++ == 0) first = s.time_s;
    if (before < 5.0 && s.true_pv >= 5.0) last = s.time_s;
    before = s.true_pv;
  }
  return {crossings > 1 ? (last - first) / (crossings - 1) : 0.0, (high - low) / 2.0};
}

}  // namespace

TEST_CASE("the predicted limit cycle is near the simulated one, and grows as in the thesis",
          "[analysis][limit-cycle]") {
  double last_amplitude = 0.0;
  for (const double s : {0.5, 1.0, 2.0}) {
    CAPTURE(s);
    plant::LoopModel m = plant1(kSimc);
    m.valve_effects = {{.name = "stiction", .parameters = {{"s", s}, {"j", 0.6 * s}}}};
    const auto cycles = limit_cycles(linear_loop(m), *valve_nonlinearity(m));
    REQUIRE(cycles.size() == 1);
    CHECK(cycles.front().stable);
    const Cycle truth = simulated(m);
    // The triangle of CO is faster than its first harmonic: 42.1 s predicted, 32.8 s simulated.
    CHECK(cycles.front().period_s == Approx(truth.period_s).epsilon(0.35));
    CHECK(cycles.front().period_s > truth.period_s);
    CHECK(cycles.front().pv_amplitude == Approx(truth.pv_amplitude).epsilon(0.35));
    CHECK(truth.pv_amplitude > 1.5 * last_amplitude);
    last_amplitude = truth.pv_amplitude;
  }
  // With Ti above T + L the Nyquist curve approaches from the right and misses -1/N. No cycle is
  // predicted, but the loop cycles with a long triangle of CO that is no sinusoid.
  plant::LoopModel slow = plant1(kThesis);
  slow.valve_effects = {{.name = "stiction", .parameters = {{"s", 1.0}, {"j", 0.6}}}};
  CHECK(limit_cycles(linear_loop(slow), *valve_nonlinearity(slow)).empty());
  CHECK(simulated(slow).pv_amplitude > 0.2);
  const AxisReach reach = axis_reach(linear_loop(slow), *valve_nonlinearity(slow));
  CHECK(reach.loop < reach.valve);
  // A sluggish loop does not cycle with backlash.
  plant::LoopModel m = plant1(kThesis);
  m.valve_effects = {{.name = "backlash", .parameters = {{"deadband", 1.0}}}};
  CHECK(limit_cycles(linear_loop(m), *valve_nonlinearity(m)).empty());
  CHECK(simulated(m).pv_amplitude < 0.02);
}

TEST_CASE("only a loop that crosses the axis below the start of -1/N has no predicted cycle",
          "[analysis][limit-cycle]") {
  constexpr double kSum = 1.69376 + 2.6256;  // s, T + L
  int predicted = 0;
  int none = 0;
  for (const double kp : {0.1, 0.35, 0.9}) {
    // 4.2 s and 4.5 s lie close on either side of T + L.
    for (const double ti_s : {3.0, 4.2, 4.5, 6.0, 8.7, 15.0}) {
      const LinearLoop loop = linear_loop(plant1({.kp = kp, .ki = kp / ti_s}));
      for (const double j : {0.1, 0.3, 0.6, 1.0}) {
        CAPTURE(kp, ti_s, j);
        const ValveNonlinearity valve{.backlash = false, .s = 1.0, .j = j};
        const AxisReach reach = axis_reach(loop, valve);
        CHECK(reach.valve == Approx(0.25 * 3.14159265 / j));
        CHECK(std::isinf(reach.loop) == (ti_s < kSum));
        const bool empty = limit_cycles(loop, valve).empty();
        CHECK(empty == (reach.loop < reach.valve));
        (empty ? none : predicted) += 1;
      }
    }
  }
  CHECK(predicted > 30);
  CHECK(none > 15);
  CHECK(std::isinf(axis_reach(linear_loop(plant1(kSimc)), {true, 1.0, 0.0}).valve));
}

}  // namespace limit_cycle_test

// SPDX-License-Identifier: Apache-2.0
#include "model/control/compensator.hpp"

#include <catch2/catch.hpp>
#include <limits>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "model/control/loop_controller.hpp"
#include "model/effects/backlash/backlash.hpp"
#include "model/effects/hysteresis/hysteresis_offset.hpp"
#include "model/effects/hysteresis/hysteresis_width.hpp"
#include "model/plant/simulated_loop.hpp"

namespace compensator_test {

using namespace loopwarden;
using namespace loopwarden::control;

namespace {

constexpr double kPeriod = 0.1;  // s

double wave(int k) { return 5.0 + 2.0 * std::sin(2.0 * std::numbers::pi * k / 400.0); }

// Returns the correction that a compensator adds to a slow sine, sample by sample.
std::vector<double> added_to_wave(const CompensatorSettings& settings, int samples = 1200) {
  Compensator c(settings, kPeriod);
  std::vector<double> added;
  for (int k = 0; k < samples; ++k) {
    added.push_back(c.step({.set_point = 5.0, .error = 0.0, .output = wave(k)}).added);
  }
  return added;
}

plant::LoopModel plant1() {
  plant::LoopModel m;
  m.controller.pid.gains = {.kp = 0.3494, .ki = 0.0400074};
  m.controller.pid.output_high = 10.0;
  m.controller.pid.anti_windup = AntiWindup::back_calculation;
  m.controller.output.high = 10.0;
  m.controller.set_point.high = 10.0;
  m.process = {.gain = 1.2264, .time_constant_s = 1.69376, .dead_time_s = 2.6256};
  m.transmitter.high = 10.0;
  m.scenario.set_point = {{0.0, 4.0}, {20.0, 5.0}};
  return m;
}

struct Swing {
  double pv = 0.0, rms = 0.0, travel = 0.0;
};
Swing swing(const plant::LoopModel& model, double from_s = 1000.0, double to_s = 3000.0) {
  plant::SimulatedLoop loop(model);
  Swing s;
  double low = 1e9, high = -1e9, sum = 0.0, last = 0.0;
  int n = 0;
  for (plant::LoopSample x = loop.step(); x.time_s < to_s; x = loop.step()) {
    if (x.time_s < from_s) {
      last = x.stem;
      continue;
    }
    low = std::min(low, x.true_pv);
    high = std::max(high, x.true_pv);
    sum += (x.sp - x.true_pv) * (x.sp - x.true_pv);
    s.travel += std::abs(x.stem - last);
    last = x.stem;
    ++n;
  }
  s.pv = high - low;
  s.rms = std::sqrt(sum / n);
  return s;
}

}  // namespace

TEST_CASE("the knocker pulses at its period, width and amplitude, in the direction of CO",
          "[control][compensator]") {
  const std::vector<double> added = added_to_wave({.kind = CompensatorKind::knocker,
                                                   .amplitude = 0.3,
                                                   .pulse_period_s = 2.0,
                                                   .pulse_width_s = 0.4});
  int onsets = 0;
  for (int k = 1; k < 1200; ++k) {
    const double now = added[static_cast<std::size_t>(k)];
    const double before = added[static_cast<std::size_t>(k - 1)];
    CHECK((now == 0.0 || std::abs(now) == Approx(0.3)));
    if (now == 0.0 || before != 0.0) continue;
    ++onsets;
    CHECK(k % 20 == 19);
    if (k + 4 >= 1200) continue;
    CHECK(added[static_cast<std::size_t>(k + 3)] == now);  // 0.4 s
    CHECK(added[static_cast<std::size_t>(k + 4)] == 0.0);
    CHECK(now * (wave(k) - wave(k - 20)) > 0.0);
  }
  CHECK(onsets == 60);
}

TEST_CASE("a knocker that starts afresh waits a whole period for its first pulse",
          "[control][compensator]") {
  Compensator c({.kind = CompensatorKind::knocker,
                 .amplitude = 0.3,
                 .pulse_period_s = 2.0,
                 .pulse_width_s = 0.4},
                kPeriod);
  const auto first_pulse = [&] {
    int k = 0;
    while (c.step({.output = 5.0 + 0.01 * k}).added == 0.0 && k < 100) ++k;
    return k;
  };
  CHECK(first_pulse() == 19);
  for (int k = 0; k < 10; ++k) c.step({.output = 5.0});
  c.reset();
  CHECK(first_pulse() == 19);
}

TEST_CASE("reinforcement and backlash compensation jump at reversals only, and not for noise",
          "[control][compensator]") {
  const std::vector<double> reinforced =
      added_to_wave({.kind = CompensatorKind::reinforcement, .amplitude = 0.2, .noise_band = 0.01});
  const std::vector<double> gap =
      added_to_wave({.kind = CompensatorKind::backlash, .gap = 0.5, .noise_band = 0.01});
  CHECK(reinforced[50] == Approx(0.2));
  CHECK(reinforced[250] == Approx(-0.2));
  CHECK(gap[0] == 0.0);
  CHECK(gap[50] == 0.0);
  CHECK(gap[250] == Approx(-0.5));
  CHECK(gap[450] == Approx(0.0));
  int jumps = 0;
  for (std::size_t k = 1; k < gap.size(); ++k) jumps += gap[k] != gap[k - 1] ? 1 : 0;
  CHECK(jumps == 6);  // twice a period of the sine

  Compensator c({.kind = CompensatorKind::backlash, .gap = 0.5, .noise_band = 0.1}, kPeriod);
  for (int k = 0; k < 500; ++k) {
    const double noisy = 5.0 + 0.01 * k + (k % 2 == 0 ? 0.045 : -0.045);
    CHECK(c.step({.output = noisy}).added == 0.0);
  }
}

TEST_CASE("through its compensator a faulty valve delivers the output of the law",
          "[control][compensator]") {
  const auto worst = [](const CompensatorSettings& settings, auto valve) {
    Compensator c(settings, kPeriod);
    valve.reset(wave(0));
    double error = 0.0;
    for (int k = 0; k < 2000; ++k) {
      const double wanted = wave(k);
      const double out = valve.step(wanted + c.step({.output = wanted}).added);
      if (k > 400) error = std::max(error, std::abs(out - wanted));
    }
    return error;
  };
  const CompensatorSettings width{.kind = CompensatorKind::hysteresis, .width = 0.8, .knee = 0.0};
  CHECK(worst(width, effects::HysteresisWidth(0.8, 0.0)) < 1e-6);
  CHECK(worst({}, effects::HysteresisWidth(0.8, 0.0)) > 0.3);
  CHECK(worst({.kind = CompensatorKind::hysteresis, .width = 0.8, .knee = -1.0},
              effects::HysteresisWidth(0.8, -1.0)) < 1e-6);
  CHECK(worst({.kind = CompensatorKind::hysteresis, .offset = 0.7},
              effects::HysteresisOffset(0.7)) < 1e-6);
  CHECK(worst({}, effects::HysteresisOffset(0.7)) == Approx(0.7));
  // Backlash: the stem lags by half a gap, always on the same side of the law.
  CHECK(worst({.kind = CompensatorKind::backlash, .gap = 0.6}, effects::Backlash(0.6)) ==
        Approx(0.3).margin(1e-3));
}

TEST_CASE("the two-move method stops the cycle of a one-parameter sticking valve and then pauses",
          "[control][compensator]") {
  plant::LoopModel sticky = plant1();
  sticky.valve_effects = {{.name = "stiction", .parameters = {{"s", 1.0}, {"j", 1.0}}}};
  const Swing cycling = swing(sticky);
  sticky.controller.compensator = {.kind = CompensatorKind::two_move,
                                   .stick_band = 1.0,
                                   .max_mean_error = 0.5,
                                   .mean_error_time_s = 100.0};
  const Swing still = swing(sticky);
  CHECK(cycling.pv > 0.8);
  CHECK(still.pv < 1e-6);
  CHECK(still.rms < 0.2 * cycling.rms);
  // Moving friction leaves (S - J)/2 times the gain.
  sticky.valve_effects = {{.name = "stiction", .parameters = {{"s", 1.0}, {"j", 0.4}}}};
  const Swing offset = swing(sticky);
  CHECK(offset.pv < 1e-6);
  CHECK(offset.rms == Approx(0.3 * 1.2264).margin(0.1));
  // A load beyond max_mean_error disengages it, and the law handles the load.
  sticky.disturbances = {
      {.name = "step_disturbance", .parameters = {{"size", -1.5}, {"time", 1200.0}}}};
  const Swing loaded = swing(sticky, 2500.0, 5000.0);
  CHECK(loaded.rms < 0.8);
  // A moved set point is followed.
  sticky.disturbances.clear();
  sticky.scenario.set_point.emplace_back(1000.0, 6.5);
  CHECK(swing(sticky, 2500.0, 4000.0).rms < 0.6);
}

TEST_CASE("the two-move method's first move lasts its time, and a new set point ends the second",
          "[control][compensator]") {
  Compensator c({.kind = CompensatorKind::two_move,
                 .stick_band = 1.0,
                 .move_time_s = 1.0,
                 .max_mean_error = 5.0},
                kPeriod);
  CompensatorInputs in{.set_point = 5.0, .error = 0.0, .output = 5.0};
  Correction found;
  for (int k = 0; k < 2000 && !found.hold_integral; ++k) {
    in.output = wave(k);
    found = c.step(in);
  }
  REQUIRE(found.hold_integral);
  int periods = 1;
  while (periods < 100 && c.step(in).added == found.added) ++periods;
  CHECK(periods == 10);
  CHECK(c.step(in).hold_integral);
  in.set_point = 5.1;
  const Correction after = c.step(in);
  CHECK(after.release);
  CHECK(after.added == 0.0);
  CHECK_FALSE(c.step(in).hold_integral);
}

TEST_CASE("switching a compensator doesn't move the output or wind up the integral",
          "[control][compensator]") {
  const auto kind =
      GENERATE(CompensatorKind::knocker, CompensatorKind::two_move, CompensatorKind::reinforcement,
               CompensatorKind::backlash, CompensatorKind::hysteresis);
  CAPTURE(to_text(kind));
  CompensatorSettings on{.kind = kind,
                         .limit = 0.6,
                         .amplitude = 0.4,
                         .stick_band = 0.5,
                         .max_mean_error = 5.0,
                         .gap = 0.5,
                         .width = 0.5};
  ControllerSettings settings;
  settings.pid = {.gains = {.kp = 0.2, .ki = 0.02},
                  .anti_windup = AntiWindup::back_calculation,
                  .output_high = 10.0};
  settings.output.high = 10.0;
  LoopController c(settings, kPeriod, 5.0, 4.0);
  c.request_mode(Mode::automatic);
  double last = c.step({.process_variable = 5.0}).output;
  bool acted = false;
  double least_move = 0.0;
  for (int k = 0; k < 6000; ++k) {
    const double pv = 5.0 + 1.5 * std::sin(2.0 * std::numbers::pi * k / 300.0);
    const bool switches = k % 777 == 500;
    if (switches) {
      settings.compensator =
          settings.compensator.kind == CompensatorKind::none ? on : CompensatorSettings{};
      c.configure(settings);
    }
    const ControllerOutput out = c.step({.process_variable = pv});
    acted = acted || out.correction != 0.0;
    CHECK(std::abs(out.correction) <= 0.6);
    // Only a cycle's own movement of the law.
    if (switches) CHECK(std::abs(out.output - last) < 0.02);
    last = out.output;
    least_move = std::max(least_move, out.output);
  }
  CHECK(acted);
  CHECK(least_move < 10.0);
  // To manual and back: the output stays.
  c.request_mode(Mode::manual);
  CHECK(c.step({.process_variable = 5.0}).output == last);
  c.request_mode(Mode::automatic);
  CHECK(c.step({.process_variable = 5.0}).output == Approx(last).margin(0.02));

  // In shadow the same correction is calculated but not applied.
  settings.compensator = on;
  settings.compensator.shadow = true;
  LoopController plain(
      [&] {
        ControllerSettings bare = settings;
        bare.compensator = {};
        return bare;
      }(),
      kPeriod, 5.0, 4.0);
  LoopController shadow(settings, kPeriod, 5.0, 4.0);
  plain.request_mode(Mode::automatic);
  shadow.request_mode(Mode::automatic);
  bool asked = false;
  for (int k = 0; k < 3000; ++k) {
    const double pv = 5.0 + 1.5 * std::sin(2.0 * std::numbers::pi * k / 300.0);
    const ControllerOutput out = shadow.step({.process_variable = pv});
    REQUIRE(out.output == plain.step({.process_variable = pv}).output);
    CHECK(out.correction == 0.0);
    asked = asked || out.correction_shadow != 0.0;
  }
  CHECK(asked);
}

TEST_CASE("the integral that the two-move method held resumes when it no longer acts",
          "[control][compensator]") {
  ControllerSettings settings;
  settings.pid = {.gains = {.kp = 0.2, .ki = 0.02}, .output_high = 10.0};
  settings.output.high = 10.0;
  settings.compensator = {
      .kind = CompensatorKind::two_move, .stick_band = 0.5, .max_mean_error = 5.0};
  LoopController c(settings, kPeriod, 5.0, 4.0);
  c.request_mode(Mode::automatic);
  bool acts = false;
  for (int k = 0; k < 6000 && !acts; ++k) {
    const double pv = 5.0 + 1.5 * std::sin(2.0 * std::numbers::pi * k / 300.0);
    acts = c.step({.process_variable = pv}).correction != 0.0;
  }
  REQUIRE(acts);
  settings.compensator.shadow = true;
  c.configure(settings);
  c.step({.process_variable = 4.0});
  const double before = c.step({.process_variable = 4.0}).output;
  CHECK(c.step({.process_variable = 4.0}).output == Approx(before + 0.02 * 1.0 * kPeriod));
}

TEST_CASE("compensators at a limit do not wind the integral up", "[control][compensator]") {
  ControllerSettings settings;
  settings.pid = {.gains = {.kp = 0.2, .ki = 0.1},
                  .anti_windup = AntiWindup::back_calculation,
                  .tracking_time_s = 1.0,
                  .output_high = 10.0};
  settings.output.high = 10.0;
  settings.compensator = {.kind = CompensatorKind::reinforcement, .amplitude = 1.0};
  LoopController c(settings, kPeriod, 8.0, 5.0);
  c.request_mode(Mode::automatic);
  for (int k = 0; k < 3000; ++k) CHECK(c.step({.process_variable = 2.0}).output <= 10.0);
  int periods = 0;
  while (c.step({.process_variable = 9.0}).output > 9.5 && periods < 100) ++periods;
  CHECK(periods < 40);
}

TEST_CASE("backlash compensation shortens the set-point answer of a loop with play",
          "[control][compensator]") {
  plant::LoopModel m = plant1();
  m.valve_effects = {{.name = "backlash", .parameters = {{"deadband", 1.5}}}};
  m.scenario.set_point = {{0.0, 4.0}, {50.0, 5.0}, {250.0, 4.0}, {450.0, 5.0}};
  const Swing without = swing(m, 250.0, 650.0);
  m.controller.compensator = {.kind = CompensatorKind::backlash, .gap = 1.2, .noise_band = 0.02};
  CHECK(swing(m, 250.0, 650.0).rms < 0.9 * without.rms);
}

TEST_CASE("the first of two moves lasts its time after CO has arrived", "[control][compensator]") {
  const bool shadow = GENERATE(false, true);
  const double rate_per_s = GENERATE(0.1, 1.0, std::numeric_limits<double>::infinity());
  CAPTURE(shadow, rate_per_s);
  const CompensatorSettings settings{
      .kind = CompensatorKind::two_move, .shadow = shadow, .stick_band = 1.0, .move_time_s = 2.0};
  constexpr double kPeriod_s = 0.1;
  TwoMove law(settings, kPeriod_s);
  law.reset(5.0);
  const OutputLimits limits{.low = 0.0, .high = 10.0, .rate_per_s = rate_per_s};
  // It learns from two equal cycles of a triangle.
  double co = 5.0;
  double virtual_co = 5.0;
  double largest = 0.0;
  int at_its_place = 0;
  for (int k = 0; k < 4000 && !law.resting(); ++k) {
    const double phase = std::fmod(0.01 * k, 2.0);
    const double output = 5.0 + 0.6 * (phase < 1.0 ? 2.0 * phase - 1.0 : 3.0 - 2.0 * phase);
    const Correction c = law.step({.set_point = 5.0,
                                   .error = phase < 1.0 ? -1.0 : 1.0,
                                   .output = output,
                                   .applied = co,
                                   .commanded = co,
                                   .limits = limits});
    virtual_co = limit_output(limits, output + c.added, virtual_co, kPeriod_s).output;
    co = limit_output(limits, shadow ? output : output + c.added, co, kPeriod_s).output;
    const bool moves = c.hold_integral && !law.resting();
    largest = std::max(largest, std::abs(c.added));
    if (moves && has_arrived(limits, output + c.added, virtual_co, kPeriod_s)) ++at_its_place;
  }
  CHECK(law.resting());
  CHECK(largest > 1.0);
  CHECK(at_its_place * kPeriod_s >= 2.0 - 2.0 * kPeriod_s);
}

}  // namespace compensator_test

// SPDX-License-Identifier: Apache-2.0
#include "model/control/loop_controller.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <string>

namespace loop_controller_test {

using namespace loopwarden::control;

namespace {

constexpr double kPeriod = 0.1;  // s
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

ControllerSettings settings() {
  ControllerSettings s;
  s.pid.gains = {.kp = 2.0, .ki = 0.5};
  return s;
}

ControllerInputs pv(double value) { return {.process_variable = value}; }

LoopController automatic(const ControllerSettings& s, double set_point, double output) {
  LoopController controller(s, kPeriod, set_point, output);
  controller.request_mode(Mode::automatic);
  return controller;
}

}  // namespace

TEST_CASE("a new controller is in manual and keeps its output", "[control][modes]") {
  LoopController controller(settings(), kPeriod, 50.0, 30.0);
  const ControllerOutput out = controller.step(pv(42.0));
  CHECK(out.mode == Mode::manual);
  CHECK(out.output == 30.0);
  controller.request_output(35.0);
  CHECK(controller.step(pv(42.0)).output == 35.0);
}

TEST_CASE("manual to automatic is bumpless", "[control][modes]") {
  SECTION("with set-point tracking neither output nor set point moves") {
    LoopController controller(settings(), kPeriod, 50.0, 30.0);
    controller.step(pv(42.0));
    controller.request_mode(Mode::automatic);
    const ControllerOutput out = controller.step(pv(42.0));
    CHECK(out.mode == Mode::automatic);
    CHECK(out.set_point == 42.0);
    CHECK(out.output == 30.0);
  }
  SECTION("without tracking, the output moves by one period's integral action") {
    ControllerSettings s = settings();
    s.set_point_tracks_in_manual = false;
    LoopController controller(s, kPeriod, 50.0, 30.0);
    controller.step(pv(42.0));
    controller.request_mode(Mode::automatic);
    CHECK(controller.step(pv(42.0)).output == Approx(30.0 + 0.5 * 8.0 * kPeriod));
    CHECK(controller.set_point_target() == 50.0);
  }
}

TEST_CASE("automatic to manual holds the present output", "[control][modes]") {
  LoopController controller = automatic(settings(), 50.0, 30.0);
  double output = 0.0;
  for (int k = 0; k < 20; ++k) output = controller.step(pv(45.0)).output;
  controller.request_mode(Mode::manual);
  const ControllerOutput out = controller.step(pv(45.0));
  CHECK(out.mode == Mode::manual);
  CHECK(out.output == output);
  controller.request_mode(Mode::manual);  // asked for again: the output still doesn't move
  CHECK(controller.step(pv(20.0)).output == output);
}

TEST_CASE("a repeated request for manual does not stop an output on its way", "[control][modes]") {
  ControllerSettings s = settings();
  s.output.rate_per_s = 10.0;
  LoopController controller(s, kPeriod, 50.0, 30.0);
  controller.request_output(40.0);
  controller.step(pv(42.0));
  controller.request_mode(Mode::manual);
  double output = 0.0;
  for (int k = 0; k < 20; ++k) output = controller.step(pv(42.0)).output;
  CHECK(output == 40.0);
}

TEST_CASE("every way out of fallback is bumpless", "[control][modes]") {
  LoopController controller = automatic(settings(), 50.0, 30.0);
  for (int k = 0; k < 20; ++k) controller.step(pv(45.0));
  ControllerOutput out{};
  for (int k = 0; k < 5; ++k) out = controller.step_fallback(OutputAction::go_to(12.0));
  CHECK(out.mode == Mode::fallback);
  CHECK(out.output == 12.0);
  CHECK(controller.requested_mode() == Mode::automatic);

  SECTION("to automatic, by one period's integral action") {
    CHECK(controller.step(pv(44.0)).output == Approx(12.0 + 0.5 * 6.0 * kPeriod));
  }
  SECTION("to automatic without an error, not at all") {
    CHECK(controller.step(pv(50.0)).output == Approx(12.0).epsilon(1e-15));
  }
  SECTION("to manual, at the present output") {
    controller.request_mode(Mode::manual);
    CHECK(controller.step(pv(44.0)).output == 12.0);
  }
}

TEST_CASE("fallback in manual does not return to the old request", "[control][modes]") {
  LoopController controller(settings(), kPeriod, 50.0, 30.0);
  controller.request_output(70.0);
  controller.step(pv(45.0));
  controller.step_fallback(OutputAction::go_to(5.0));
  CHECK(controller.step(pv(45.0)).output == 5.0);
}

TEST_CASE("holding in fallback holds the output that was really applied", "[control][modes]") {
  LoopController controller = automatic(settings(), 50.0, 30.0);
  controller.step(pv(45.0));
  controller.applied(29.0);
  CHECK(controller.step_fallback(OutputAction::hold()).output == 29.0);
}

TEST_CASE("fallback moves to its value at the output's rate", "[control][modes]") {
  ControllerSettings s = settings();
  s.output.rate_per_s = 10.0;
  LoopController controller = automatic(s, 50.0, 30.0);
  const ControllerOutput first = controller.step_fallback(OutputAction::go_to(0.0));
  CHECK(first.output == Approx(29.0));
  CHECK(first.rate_limited);
  for (int k = 0; k < 29; ++k) controller.step_fallback(OutputAction::go_to(0.0));
  CHECK(controller.output_applied() == Approx(0.0).margin(1e-12));
}

TEST_CASE("an operator can't ask for fallback", "[control][modes]") {
  LoopController controller(settings(), kPeriod, 50.0, 30.0);
  controller.request_mode(Mode::fallback);
  CHECK(controller.requested_mode() == Mode::manual);
}

TEST_CASE("requests that are not finite are ignored", "[control][modes]") {
  const double bad = GENERATE(values({kNan, kInfinity, -kInfinity}));
  CAPTURE(bad);
  LoopController controller(settings(), kPeriod, 50.0, 30.0);
  controller.request_output(bad);
  controller.request_set_point(bad);
  CHECK(controller.set_point_target() == 50.0);
  CHECK(controller.step(pv(50.0)).output == 30.0);
  controller.assume_output(bad);
  controller.applied(bad);
  CHECK(controller.output_applied() == 30.0);
}

TEST_CASE("a PV that is not a number leaves no trace", "[control][modes]") {
  LoopController controller = automatic(settings(), 50.0, 30.0);
  const double before = controller.step(pv(50.0)).output;
  CHECK_FALSE(std::isfinite(controller.step(pv(kNan)).output));
  CHECK(controller.output_applied() == before);
  CHECK(controller.step_fallback(OutputAction::hold()).output == before);
  CHECK(controller.step(pv(50.0)).output == Approx(before).epsilon(1e-15));
}

TEST_CASE("a PV that is not valid is not tracked in manual", "[control][modes]") {
  LoopController controller(settings(), kPeriod, 50.0, 30.0);
  controller.step(pv(42.0));
  controller.step({.process_variable = 7.0, .process_variable_valid = false});
  CHECK(controller.set_point_target() == 42.0);
}

TEST_CASE("assuming an output starts the law from it", "[control][modes]") {
  LoopController controller = automatic(settings(), 50.0, 0.0);
  controller.step(pv(50.0));
  controller.assume_output(64.0);
  CHECK(controller.step(pv(50.0)).output == Approx(64.0).epsilon(1e-15));
}

TEST_CASE("the set point ramps, and from PV after a change of mode", "[control][modes]") {
  ControllerSettings s = settings();
  s.set_point.rate_up_per_s = 1.0;
  s.set_point.rate_down_per_s = 1.0;
  s.set_point_tracks_in_manual = false;
  LoopController controller = automatic(s, 50.0, 30.0);
  CHECK(controller.step(pv(40.0)).set_point == Approx(40.1));
  CHECK(controller.step(pv(40.0)).set_point == Approx(40.2));
  for (int k = 0; k < 100; ++k) controller.step(pv(45.0));
  CHECK(controller.step(pv(50.0)).set_point == 50.0);
  controller.step_fallback(OutputAction::hold());
  CHECK(controller.step(pv(47.0)).set_point == Approx(47.1));
}

TEST_CASE("new limits of the set point act at once", "[control][modes]") {
  ControllerSettings s = settings();
  LoopController controller = automatic(s, 50.0, 30.0);
  controller.step(pv(50.0));
  s.set_point.high = 40.0;
  controller.configure(s);
  CHECK(controller.step(pv(50.0)).set_point == 40.0);
  CHECK(controller.set_point_target() == 40.0);
}

TEST_CASE("retuning while running doesn't move the output", "[control][modes]") {
  ControllerSettings s = settings();
  LoopController controller = automatic(s, 50.0, 30.0);
  ControllerOutput out{};
  for (int k = 0; k < 10; ++k) out = controller.step(pv(48.0));
  s.pid.gains = {.kp = 5.0, .ki = 0.1};
  controller.configure(s);
  out.output += 0.5 * 2.0 * kPeriod;  // as without retuning
  CHECK(controller.step(pv(48.0)).output == Approx(out.output));
  CHECK(controller.step(pv(48.0)).output == Approx(out.output + 0.1 * 2.0 * kPeriod));
}

TEST_CASE("the output's own limits act in every mode", "[control][limits]") {
  ControllerSettings s = settings();
  s.output.low = 20.0;
  s.output.high = 80.0;
  LoopController controller(s, kPeriod, 50.0, 30.0);
  controller.request_output(95.0);
  CHECK(controller.step(pv(50.0)).output == 80.0);
  CHECK(controller.step_fallback(OutputAction::go_to(0.0)).output == 20.0);
  controller.request_mode(Mode::automatic);
  controller.request_set_point(100.0);
  const ControllerOutput out = controller.step(pv(0.0));
  for (int k = 0; k < 200; ++k) controller.step(pv(0.0));
  CHECK(controller.step(pv(0.0)).output == 80.0);
  CHECK(controller.step(pv(0.0)).at_high);
  CHECK(out.output <= 80.0);
}

TEST_CASE("anti-windup uses the output that was really applied", "[control][limits]") {
  const auto kind = GENERATE(AntiWindup::back_calculation, AntiWindup::conditional);
  // SP - PV = 10 for a long time, then -1. Returns the periods until the output has fallen by 1.
  const auto periods_to_turn = [&](auto&& restrain, ControllerSettings s) {
    s.pid.anti_windup = kind;
    LoopController controller = automatic(s, 50.0, 30.0);
    double out = 30.0;
    for (int k = 0; k < 600; ++k) {
      out = controller.step(pv(40.0)).output;
      restrain(controller, out);
    }
    const double top = controller.output_applied();
    int periods = 0;
    while (controller.output_applied() > top - 1.0 && periods < 10000) {
      out = controller.step(pv(51.0)).output;
      restrain(controller, out);
      ++periods;
    }
    return periods;
  };
  const auto free = [](LoopController&, double) {};

  ControllerSettings s = settings();
  SECTION("a device that stops at 60") {
    const auto device = [](LoopController& c, double out) { c.applied(std::min(out, 60.0)); };
    CHECK(periods_to_turn(device, s) <= 30);
  }
  SECTION("the output's rate limit") {
    // 0.05 CO units per period, while the integral would move it ten times as fast.
    s.output.rate_per_s = 0.5;
    CHECK(periods_to_turn(free, s) <= 60);
  }
  SECTION("the output's limit") {
    s.output.high = 60.0;
    CHECK(periods_to_turn(free, s) <= 30);
  }
}

TEST_CASE("the deadband holds the output, not the integral", "[control][limits]") {
  const auto kind =
      GENERATE(AntiWindup::integral_clamp, AntiWindup::back_calculation, AntiWindup::conditional);
  ControllerSettings s = settings();
  s.pid.anti_windup = kind;
  s.output.deadband = 2.0;
  LoopController controller = automatic(s, 50.0, 30.0);
  // Ki e = 0.1 per second: 2 CO units take 20 s.
  int periods = 0;
  while (controller.step(pv(49.8)).output == 30.0 && periods < 1000) ++periods;
  CHECK(periods == Approx(200).margin(2));
}

TEST_CASE("a ramp finer than the converter's resolution arrives", "[control][limits]") {
  ControllerSettings s = settings();
  s.output.rate_per_s = 0.05;  // 0.005 a period
  s.pid.tolerance = 0.05;
  LoopController controller(s, kPeriod, 50.0, 30.0);
  controller.request_output(31.0);
  double device = 0.0;
  for (int k = 0; k < 201; ++k) {
    device = 0.05 * std::round(controller.step(pv(50.0)).output / 0.05);
    controller.applied(device);
  }
  CHECK(device == Approx(31.0));
}

TEST_CASE("a rate-limited step starts from the actual position of the device",
          "[control][limits]") {
  ControllerSettings s = settings();
  s.output.rate_per_s = 10.0;
  s.pid.tolerance = 0.05;
  LoopController controller(s, kPeriod, 50.0, 30.0);
  controller.request_output(60.0);
  controller.step(pv(50.0));
  controller.applied(20.0);  // another program moved it
  CHECK(controller.step(pv(50.0)).output == Approx(21.0));
}

TEST_CASE("the jacket acts on the integral, or in shadow only reports what it would do",
          "[control][jacket]") {
  ControllerSettings s = settings();
  s.jacket.form = JacketForm::paper;
  s.jacket.gain_per_s = 0.4;
  const bool shadow = GENERATE(false, true);
  s.jacket.shadow = shadow;
  LoopController controller = automatic(s, 50.0, 30.0);
  const ControllerInputs in{
      .process_variable = 50.0, .valve_position = 27.0, .valve_position_valid = true};
  const ControllerOutput out = controller.step(in);
  CHECK(out.jacket_shadow_rate == Approx(-0.4 * 3.0));
  CHECK(out.jacket_rate == Approx(shadow ? 0.0 : -0.4 * 3.0));
  CHECK(out.output == Approx(shadow ? 30.0 : 30.0 - 0.4 * 3.0 * kPeriod));
}

TEST_CASE("modes are named as operators know them", "[control][modes]") {
  CHECK(to_text(Mode::manual) == std::string("MAN"));
  CHECK(to_text(Mode::automatic) == std::string("AUTO"));
  CHECK(to_text(Mode::fallback) == std::string("FALLBACK"));
}

}  // namespace loop_controller_test

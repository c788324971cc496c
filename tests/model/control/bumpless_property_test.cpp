// SPDX-License-Identifier: Apache-2.0
// Tests over pairs of configurations that new settings do not move the output.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>

#include "model/control/loop_controller.hpp"
#include "tests/support/property.hpp"

namespace bumpless_property_test {

using namespace loopwarden::control;
namespace property = loopwarden::tests::property;

namespace {

constexpr double kPeriod = 0.1;   // s
constexpr double kSpan = 100.0;   // CO units
constexpr double kShare = 0.001;  // share of the span: the largest departure of CO from its course

template <class T>
T any_of(std::initializer_list<T> values) {
  return values.begin()[property::one_of(values.size())];
}

CompensatorSettings any_compensator() {
  using Kind = CompensatorKind;
  CompensatorSettings c;
  c.kind = any_of({Kind::none, Kind::knocker, Kind::two_move, Kind::reinforcement, Kind::backlash,
                   Kind::hysteresis});
  c.shadow = property::coin() || acts_in_simulation_only(c.kind);
  c.limit = property::number(0.1, 20.0);
  c.amplitude = property::number(0.1, 10.0);
  c.stick_band = property::number(0.1, 10.0);
  c.max_mean_error = 100.0;
  c.gap = property::number(0.1, 10.0);
  c.width = property::number(0.1, 10.0);
  c.noise_band = property::number(0.0, 1.0);
  return c;
}

JacketSettings any_jacket() {
  using Form = JacketForm;
  const Form form = any_of({Form::off, Form::paper, Form::bounded, Form::dwell});
  return {.form = form,
          .shadow = property::coin() || form == Form::paper,
          .gain_per_s = property::number(0.0, 50.0),
          .dead_zone = property::number(0.0, 2.0),
          .max_mean_error = property::number(0.1, 50.0)};
}

ControllerSettings any_settings() {
  ControllerSettings s;
  s.pid.gains = {.kp = property::number(0.0, 20.0),
                 .ki = property::number(0.0, 20.0),
                 .kd = property::number(0.0, 20.0),
                 .derivative_filter_s = property::number(0.0, 5.0)};
  s.pid.action = any_of({Action::reverse, Action::direct});
  s.pid.anti_windup =
      any_of({AntiWindup::integral_clamp, AntiWindup::back_calculation, AntiWindup::conditional});
  s.pid.tracking_time_s = property::coin() ? property::number(0.0, 20.0) : 0.0;
  s.pid.output_high = kSpan;
  s.output.low = property::number(0.0, 30.0);
  s.output.high = property::number(70.0, kSpan);
  s.output.deadband = property::coin() ? property::number(0.0, 5.0) : 0.0;
  s.pid.tolerance = s.output.deadband;
  if (property::coin()) s.output.rate_per_s = property::number(0.1, 500.0);
  s.set_point.low = property::number(0.0, 60.0);
  s.set_point.high = property::number(s.set_point.low, 100.0);
  if (property::coin()) s.set_point.rate_up_per_s = property::number(0.1, 50.0);
  if (property::coin()) s.set_point.rate_down_per_s = property::number(0.1, 50.0);
  s.set_point_tracks_in_manual = property::coin();
  s.compensator = any_compensator();
  s.jacket = any_jacket();
  return s;
}

}  // namespace

TEST_CASE("CO stays on its course under the old settings, whatever a reload changes",
          "[control][bumpless]") {
  property::for_all("new settings", 3000, [] {
    const ControllerSettings old_settings = any_settings();
    ControllerSettings new_settings = any_settings();
    const double start = property::number(old_settings.output.low, old_settings.output.high);
    LoopController controller(old_settings, kPeriod, 50.0, start);
    const bool automatic = property::coin();
    if (automatic) {
      controller.request_mode(Mode::automatic);
    } else {
      controller.request_output(
          property::number(old_settings.output.low, old_settings.output.high));
    }
    ControllerInputs in{.process_variable = property::number(0.0, 100.0),
                        .valve_position = start,
                        .valve_position_valid = true};
    controller.step(in);
    controller.request_set_point(property::number(0.0, 100.0));
    // PV has moved, and is constant from then on.
    in.process_variable = property::number(0.0, 100.0);
    const std::int64_t periods = property::integer(2, 200);
    for (std::int64_t k = 0; k < periods; ++k) controller.step(in);

    // ControlCycle holds back settings whose limits exclude CO.
    const double output = controller.output_commanded();
    new_settings.output.low = std::min(new_settings.output.low, output);
    new_settings.output.high = std::max(new_settings.output.high, output);

    LoopController as_before = controller;
    controller.configure(new_settings);
    const double course = as_before.step(in).output;
    const ControllerOutput now = controller.step(in);
    // The output lags if the new limits or the new rate restrict it.
    const double rate = new_settings.output.rate_per_s;
    const double allowed = std::isfinite(rate) ? rate * kPeriod : kShare * kSpan;
    property::require(now.output >= std::min(course, output) - allowed - 1e-9 &&
                          now.output <= std::max(course, output) + allowed + 1e-9,
                      "CO left its course");
    if (course == output) {
      property::require(std::abs(now.output - output) <= kShare * kSpan, "CO stood and moves");
    }
    if (!std::isfinite(rate) && course >= new_settings.output.low &&
        course <= new_settings.output.high && new_settings.output.deadband == 0.0) {
      property::require(std::abs(now.output - course) <= kShare * kSpan, "CO lags behind");
    }
  });
}

TEST_CASE("if only the law changes, CO has the value of the old settings", "[control][bumpless]") {
  property::for_all("a new law", 1000, [] {
    ControllerSettings settings = any_settings();
    LoopController controller(settings, kPeriod, 50.0, 50.0);
    controller.request_mode(Mode::automatic);
    // Here PV moves all the time.
    double pv = property::number(0.0, 100.0);
    const double slope = property::number(-2.0, 2.0);
    const auto next = [&] {
      return ControllerInputs{
          .process_variable = pv += slope, .valve_position = 49.0, .valve_position_valid = true};
    };
    const std::int64_t periods = property::integer(2, 50);
    for (std::int64_t k = 0; k < periods; ++k) controller.step(next());
    const ControllerSettings other = any_settings();
    settings.pid = other.pid;
    settings.pid.tolerance = settings.output.deadband;
    settings.set_point = other.set_point;
    settings.jacket = other.jacket;
    settings.compensator = other.compensator;
    LoopController as_before = controller;
    controller.configure(settings);
    const ControllerInputs in = next();
    const double course = as_before.step(in).output;
    property::require(std::abs(controller.step(in).output - course) < 1e-9, "CO left its course");
  });
}

TEST_CASE("after the period of taking over, the new settings decide", "[control][bumpless]") {
  ControllerSettings s;
  s.pid.gains = {.kp = 1.0, .ki = 1.0};
  LoopController controller(s, kPeriod, 50.0, 30.0);
  controller.request_mode(Mode::automatic);
  const ControllerInputs in{.process_variable = 48.0};
  for (int k = 0; k < 10; ++k) controller.step(in);
  s.pid.gains = {.kp = 4.0, .ki = 3.0};
  controller.configure(s);
  const double taken_over = controller.step(in).output;
  CHECK(controller.step(in).output == Approx(taken_over + 3.0 * 2.0 * kPeriod));
  CHECK(controller.step({.process_variable = 47.0}).output ==
        Approx(taken_over + 3.0 * 5.0 * kPeriod + 4.0 * 1.0));
}

TEST_CASE("a command in the period of new settings moves the output as requested",
          "[control][bumpless]") {
  ControllerSettings s;
  LoopController controller(s, kPeriod, 50.0, 30.0);
  controller.step({.process_variable = 50.0});
  s.output.high = 60.0;
  s.output.deadband = 5.0;
  controller.configure(s);
  controller.request_output(55.0);
  CHECK(controller.step({.process_variable = 50.0}).output == 55.0);
  // An earlier request, which the old deadband held back, does not act now.
  controller.request_output(58.0);
  CHECK(controller.step({.process_variable = 50.0}).output == 55.0);
  s.output.deadband = 0.0;
  controller.configure(s);
  CHECK(controller.step({.process_variable = 50.0}).output == 55.0);
}

TEST_CASE("later requests are independent of the previous settings", "[control][bumpless]") {
  ControllerSettings s;
  s.output.high = 60.0;
  LoopController controller(s, kPeriod, 50.0, 30.0);
  controller.step({.process_variable = 50.0});
  s.output.high = 80.0;
  controller.configure(s);
  controller.step({.process_variable = 50.0});
  controller.request_output(70.0);
  CHECK(controller.step({.process_variable = 50.0}).output == 70.0);
}

TEST_CASE("an output that the old limits held does not move at the rate limit",
          "[control][bumpless]") {
  ControllerSettings s;
  s.pid.gains = {.kp = 2.0, .ki = 0.0};
  s.pid.output_high = 100.0;
  s.set_point.high = 100.0;
  s.output = {.low = 0.0, .high = 50.0, .rate_per_s = 1.0};
  LoopController controller(s, kPeriod, 50.0, 20.0);
  const ControllerInputs in{.process_variable = 50.0};
  const auto run = [&](double high) {
    s.output.high = high;
    controller.configure(s);
    double output = 0.0;
    for (int k = 0; k < 1000; ++k) output = controller.step(in).output;
    return output;
  };
  SECTION("in automatic") {
    controller.request_mode(Mode::automatic);
    controller.step(in);
    controller.request_set_point(90.0);  // the law asks for 100
    CHECK(run(50.0) == Approx(50.0));
  }
  SECTION("in manual") {
    controller.request_output(75.0);
    for (int k = 0; k < 5; ++k) controller.step(in);
    CHECK(run(50.0) == Approx(50.0));
  }
  CHECK(run(100.0) == Approx(50.0));
}

}  // namespace bumpless_property_test

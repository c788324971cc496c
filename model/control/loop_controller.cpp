// SPDX-License-Identifier: Apache-2.0
#include "model/control/loop_controller.hpp"

#include <algorithm>
#include <cmath>

namespace loopwarden::control {
namespace {

// What the output's deadband holds back is no windup.
PidSettings pid_settings(const ControllerSettings& settings) noexcept {
  PidSettings pid = settings.pid;
  pid.tolerance = std::max(pid.tolerance, settings.output.deadband);
  return pid;
}

}  // namespace

LoopController::LoopController(const ControllerSettings& settings, double period_s,
                               double initial_set_point, double initial_output) noexcept
    : settings_(settings),
      period_s_(period_s),
      pid_(pid_settings(settings), period_s),
      set_point_(settings.set_point, initial_set_point),
      jacket_(settings.jacket, period_s),
      compensator_(settings.compensator, period_s),
      manual_output_(initial_output),
      applied_(initial_output),
      commanded_(initial_output) {}

void LoopController::configure(const ControllerSettings& settings) noexcept {
  settings_ = settings;
  pid_.configure(pid_settings(settings));
  set_point_.configure(settings.set_point);
  jacket_.configure(settings.jacket);
  if (settings.compensator != compensator_.settings()) {
    absorb_correction();
    compensator_.configure(settings.compensator);
  }
}

void LoopController::request_mode(Mode manual_or_automatic) noexcept {
  if (manual_or_automatic == Mode::fallback) return;
  if (manual_or_automatic == Mode::manual && requested_ != Mode::manual) manual_output_ = applied_;
  requested_ = manual_or_automatic;
}

void LoopController::request_output(double output) noexcept {
  if (std::isfinite(output)) manual_output_ = output;
}

void LoopController::assume_output(double output) noexcept {
  if (std::isfinite(output)) {
    stand_at(output);
    manual_output_ = output;
  }
  mode_ = Mode::fallback;  // whatever comes next starts afresh from here
}

ControllerOutput LoopController::limit(double wanted) noexcept {
  const Limited limited = limit_output(settings_.output, wanted, commanded_, period_s_);
  ControllerOutput out;
  out.output = limited.output;
  out.calculated = wanted;
  out.at_low = limited.at_low;
  out.at_high = limited.at_high;
  out.rate_limited = limited.rate_limited;
  out.mode = mode_;
  if (std::isfinite(limited.output)) stand_at(limited.output);  // until the caller knows better
  return out;
}

ControllerOutput LoopController::step(const ControllerInputs& in) noexcept {
  return requested_ == Mode::automatic ? step_automatic(in) : step_manual(in);
}

ControllerOutput LoopController::step_automatic(const ControllerInputs& in) noexcept {
  if (mode_ != Mode::automatic) {
    if (set_point_.ramped()) set_point_.restart_ramp(in.process_variable);
    jacket_.reset();
    compensator_.reset();
    added_ = 0.0;
    hold_integral_ = false;
  }
  const double set_point = set_point_.step(period_s_);
  if (mode_ != Mode::automatic) pid_.initialise(applied_, set_point, in.process_variable);
  mode_ = Mode::automatic;

  const double error = pid_.error(set_point, in.process_variable);
  const double wanted_rate = jacket_.step({.error = error,
                                           .integral_rate = pid_.integral_rate(error),
                                           .output = applied_,
                                           .valve_position = in.valve_position,
                                           .valve_position_valid = in.valve_position_valid});
  const double acting_rate = settings_.jacket.shadow ? 0.0 : wanted_rate;

  const double held_rate = hold_integral_ ? -pid_.integral_rate(error) : acting_rate;
  const double law = pid_.step(set_point, in.process_variable, applied_ - added_, held_rate);

  const Correction wanted =
      compensator_.step({.set_point = set_point, .error = error, .output = law});
  double output = law;
  double added = 0.0;
  if (!settings_.compensator.shadow) {
    if (wanted.release) {
      output += added_;
      absorb_correction();
    }
    added = wanted.added;
    hold_integral_ = wanted.hold_integral;
  }
  added_ = added;

  ControllerOutput out = limit(output + added);
  out.set_point = set_point;
  out.jacket_rate = acting_rate;
  out.jacket_shadow_rate = wanted_rate;
  out.correction = added;
  out.correction_shadow = wanted.added;
  return out;
}

ControllerOutput LoopController::step_manual(const ControllerInputs& in) noexcept {
  mode_ = Mode::manual;
  if (settings_.set_point_tracks_in_manual && in.process_variable_valid) {
    set_point_.request(in.process_variable);
    set_point_.restart_ramp(in.process_variable);
  }
  ControllerOutput out = limit(manual_output_);
  out.set_point = set_point_.working();
  return out;
}

ControllerOutput LoopController::step_fallback(OutputAction action) noexcept {
  // What was asked for in manual before the fault is not resumed: the output stays where it went.
  mode_ = Mode::fallback;
  ControllerOutput out = limit(action.kind == OutputAction::Kind::hold ? applied_ : action.value);
  manual_output_ = out.output;
  out.set_point = set_point_.working();
  return out;
}

}  // namespace loopwarden::control

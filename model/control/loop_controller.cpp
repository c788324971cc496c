// SPDX-License-Identifier: Apache-2.0
#include "model/control/loop_controller.hpp"

#include <algorithm>
#include <cmath>

namespace loopwarden::control {
namespace {

// The difference that the output's deadband holds back is no windup.
PidSettings pid_settings(const ControllerSettings& settings) noexcept {
  PidSettings pid = settings.pid;
  pid.tolerance = std::max(pid.tolerance, settings.output.deadband);
  return pid;
}

}  // namespace

LoopController::Law::Law(const ControllerSettings& all, double period,
                         double initial_set_point) noexcept
    : settings(all),
      period_s(period),
      pid(pid_settings(all), period),
      set_point(all.set_point, initial_set_point),
      jacket(all.jacket, period),
      compensator(all.compensator, period) {}

LoopController::LoopController(const ControllerSettings& settings, double period_s,
                               double initial_set_point, double initial_output) noexcept
    : period_s_(period_s),
      law_(settings, period_s, initial_set_point),
      before_(law_),
      manual_output_(initial_output),
      applied_(initial_output),
      commanded_(initial_output) {}

void LoopController::Law::absorb_correction() noexcept {
  pid.shift(added);
  added = 0.0;
  hold_integral = false;
}

void LoopController::Law::configure(const ControllerSettings& all) noexcept {
  settings = all;
  pid.configure(pid_settings(all));
  set_point.configure(all.set_point);
  jacket.configure(all.jacket);
  if (all.compensator != compensator.settings()) {
    absorb_correction();
    compensator.configure(all.compensator);
  }
}

void LoopController::configure(const ControllerSettings& settings) noexcept {
  if (!taking_over_) before_ = law_;
  taking_over_ = true;
  law_.configure(settings);
}

void LoopController::request_mode(Mode manual_or_automatic) noexcept {
  if (manual_or_automatic == Mode::fallback) return;
  if (manual_or_automatic == Mode::manual && requested_ != Mode::manual) manual_output_ = applied_;
  requested_ = manual_or_automatic;
}

void LoopController::request_output(double output) noexcept {
  if (!std::isfinite(output)) return;
  manual_output_ = output;
  if (mode_ == Mode::manual) taking_over_ = false;  // it is to move
}

void LoopController::assume_output(double output) noexcept {
  if (std::isfinite(output)) {
    set_output(output);
    manual_output_ = output;
  }
  mode_ = Mode::fallback;  // the next mode starts from this output
}

ControllerOutput LoopController::limit(double wanted) noexcept {
  const Limited limited = limit_output(law_.settings.output, wanted, commanded_, period_s_);
  ControllerOutput out;
  out.output = limited.output;
  out.calculated = wanted;
  out.at_low = limited.at_low;
  out.at_high = limited.at_high;
  out.rate_limited = limited.rate_limited;
  out.mode = mode_;
  if (std::isfinite(limited.output)) set_output(limited.output);  // until applied() is called
  return out;
}

// Returns the request to the new limits in the first period under new settings: `wanted`, unless
// the output would then leave the course that it had under the old limits. It may lag on that
// course.
double LoopController::kept_on_course(double wanted) const noexcept {
  const OutputLimits& limits = law_.settings.output;
  const Limited before = limit_output(before_.settings.output, wanted, commanded_, period_s_);
  const double course = before.output;
  const double output = limit_output(limits, wanted, commanded_, period_s_).output;
  // A ramp under the old rate limit continues at the new one; an output at rest stays.
  const bool moves = before.rate_limited && std::isfinite(limits.rate_per_s);
  const double allowed = moves ? limits.rate_per_s * period_s_ : 0.0;
  const bool leaves = output < std::min(course, commanded_) - allowed ||
                      output > std::max(course, commanded_) + allowed;
  return leaves ? course : wanted;
}

ControllerOutput LoopController::step(const ControllerInputs& in) noexcept {
  const ControllerOutput out = requested_ == Mode::automatic ? step_automatic(in) : step_manual(in);
  taking_over_ = false;
  return out;
}

LoopController::Law::Result LoopController::Law::step(const ControllerInputs& in, double applied,
                                                      double commanded, bool starts) noexcept {
  if (starts) {
    if (set_point.ramped()) set_point.restart_ramp(in.process_variable);
    jacket.reset();
    compensator.reset();
    added = 0.0;
    hold_integral = false;
  }
  Result result;
  result.set_point = set_point.step(period_s);
  if (starts) pid.initialise(applied, result.set_point, in.process_variable);

  const double error = pid.error(result.set_point, in.process_variable);
  result.jacket_shadow_rate = jacket.step({.error = error,
                                           .integral_rate = pid.integral_rate(error),
                                           .output = applied,
                                           .valve_position = in.valve_position,
                                           .valve_position_valid = in.valve_position_valid});
  result.jacket_rate = settings.jacket.shadow ? 0.0 : result.jacket_shadow_rate;

  const double held_rate = hold_integral ? -pid.integral_rate(error) : result.jacket_rate;
  const double law = pid.step(result.set_point, in.process_variable, applied - added, held_rate);

  result.correction = compensator.step({.set_point = result.set_point,
                                        .error = error,
                                        .output = law,
                                        .process_variable = in.process_variable,
                                        .applied = applied,
                                        .commanded = commanded,
                                        .valve_position = in.read_back,
                                        .valve_position_valid = in.read_back_valid,
                                        .limits = settings.output},
                                       in.moves);
  result.wanted = law;
  if (!settings.compensator.shadow) {
    if (result.correction.release) {
      added += result.correction.added;
      result.wanted += added;
      absorb_correction();
    } else {
      result.added = result.correction.added;
    }
    hold_integral = result.correction.hold_integral;
  }
  added = result.added;
  result.wanted += added;
  return result;
}

ControllerOutput LoopController::step_automatic(const ControllerInputs& in) noexcept {
  const bool starts = mode_ != Mode::automatic;
  mode_ = Mode::automatic;
  Law::Result now = law_.step(in, applied_, commanded_, starts);
  if (taking_over_ && !starts) {
    const double course = kept_on_course(before_.step(in, applied_, commanded_, false).wanted);
    const double bump = now.wanted - course;
    if (std::isfinite(bump)) {  // otherwise the caller detects the non-finite result
      law_.pid.shift(-bump);
      now.wanted = course;
    }
  }
  ControllerOutput out = limit(now.wanted);
  out.set_point = now.set_point;
  out.jacket_rate = now.jacket_rate;
  out.jacket_shadow_rate = now.jacket_shadow_rate;
  out.correction = now.added;
  out.correction_shadow = now.correction.added;
  return out;
}

ControllerOutput LoopController::step_manual(const ControllerInputs& in) noexcept {
  if (taking_over_ && mode_ == Mode::manual) manual_output_ = kept_on_course(manual_output_);
  mode_ = Mode::manual;
  if (law_.settings.set_point_tracks_in_manual && in.process_variable_valid) {
    law_.set_point.request(in.process_variable);
    law_.set_point.restart_ramp(in.process_variable);
  }
  ControllerOutput out = limit(manual_output_);
  out.set_point = law_.set_point.working();
  return out;
}

ControllerOutput LoopController::step_fallback(OutputAction action) noexcept {
  // A request in manual from before the fault is not resumed: the output keeps the fault's value.
  mode_ = Mode::fallback;
  taking_over_ = false;
  ControllerOutput out = limit(action.kind == OutputAction::Kind::hold ? applied_ : action.value);
  manual_output_ = out.output;
  out.set_point = law_.set_point.working();
  return out;
}

}  // namespace loopwarden::control

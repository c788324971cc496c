// SPDX-License-Identifier: Apache-2.0
#include "daemon/rt/command.hpp"

#include <cmath>

namespace loopwarden::daemon::rt {
namespace {

bool outside(const std::optional<double>& value, double low, double high) noexcept {
  return value && !(*value >= low && *value <= high);
}

Refusal judge_values(const Command& command, const control::ControllerSettings& limits) noexcept {
  if (outside(command.set_point, limits.set_point.low, limits.set_point.high)) {
    return Refusal::set_point_out_of_limits;
  }
  if (outside(command.output, limits.output.low, limits.output.high)) {
    return Refusal::output_out_of_limits;
  }
  for (const std::optional<double>& gain : {command.kp, command.ki, command.kd}) {
    if (gain && !(*gain >= 0.0 && std::isfinite(*gain))) return Refusal::gain_out_of_limits;
  }
  return Refusal::none;
}

}  // namespace

Refusal judge(const Command& command, const LoopAvailability& availability,
              const LoopSettings& settings, control::JacketForm jacket) noexcept {
  using control::Mode;
  const Refusal value = judge_values(command, settings.controller);
  if (value != Refusal::none) return value;
  if (command.jacket && jacket == control::JacketForm::off) return Refusal::no_jacket;
  if (command.jacket == JacketMode::on && !settings.jacket_may_act) {
    return Refusal::jacket_may_not_act;
  }
  const control::CompensatorSettings& compensator = settings.controller.compensator;
  if (command.jacket == JacketMode::on && !compensator.shadow &&
      compensator.kind != control::CompensatorKind::none) {
    return Refusal::compensator_acts;
  }
  if (command.moves == MovesMode::on) {
    if (!settings.moves_may_act) return Refusal::moves_may_not_act;
    const control::JacketSettings& in_force = settings.controller.jacket;
    if (in_force.form != control::JacketForm::off && !in_force.shadow) return Refusal::jacket_acts;
  }
  const Mode mode = command.mode.value_or(availability.mode);
  // A request for the mode in force changes no value and is always accepted.
  if (mode == Mode::automatic && availability.mode != Mode::automatic) {
    if (!availability.output_known) return Refusal::output_unknown;
    if (availability.manual_after_fault) return Refusal::manual_after_fault;
  }
  if (command.output && mode == Mode::automatic) return Refusal::output_in_automatic;
  if (command.output && availability.output_in_fault) return Refusal::output_in_fault;
  if (command.set_point && mode == Mode::manual && settings.controller.set_point_tracks_in_manual) {
    return Refusal::set_point_tracks;
  }
  return Refusal::none;
}

bool is_same(double value, double is, double low, double high) noexcept {
  return std::abs(value - is) <= kSameShare * (high - low);
}

void leave_out_in_force(Command& command, const InForce& now, const LoopAvailability& availability,
                        const LoopSettings& settings) noexcept {
  using control::Mode;
  const control::PidSettings& pid = settings.controller.pid;
  if (command.mode == now.mode) command.mode.reset();
  const Mode mode = command.mode.value_or(now.mode);
  if (command.set_point && command.mode != Mode::automatic &&
      is_same(*command.set_point, now.set_point, settings.pv_check.low, settings.pv_check.high)) {
    command.set_point.reset();
  }
  if (command.output && mode == Mode::manual && !command.mode && !availability.output_in_fault &&
      is_same(*command.output, now.output, pid.output_low, pid.output_high)) {
    command.output.reset();
  }
  const control::PidGains gains{.kp = now.kp, .ki = now.ki, .kd = now.kd};
  control::PidGains wanted = gains;
  set_gains(command, wanted);
  if (wanted.kp == gains.kp && wanted.ki == gains.ki && wanted.kd == gains.kd) {
    command.kp.reset();
    command.ki.reset();
    command.kd.reset();
  }
}

Refusal judge(const Expectation& expected, const InForce& now,
              const LoopSettings& settings) noexcept {
  const auto differs = [](const std::optional<double>& value, double is, double low, double high) {
    return value && !is_same(*value, is, low, high);
  };
  const control::PidSettings& pid = settings.controller.pid;
  if (expected.mode && *expected.mode != now.mode) return Refusal::mode_changed;
  if (differs(expected.set_point, now.set_point, settings.pv_check.low, settings.pv_check.high)) {
    return Refusal::set_point_changed;
  }
  const bool both_unknown =
      expected.output && std::isnan(*expected.output) && std::isnan(now.output);
  if (!both_unknown && differs(expected.output, now.output, pid.output_low, pid.output_high)) {
    return Refusal::output_changed;
  }
  if (differs(expected.kp, now.kp, 0.0, now.kp) || differs(expected.ki, now.ki, 0.0, now.ki) ||
      differs(expected.kd, now.kd, 0.0, now.kd)) {
    return Refusal::gains_changed;
  }
  return Refusal::none;
}

}  // namespace loopwarden::daemon::rt
